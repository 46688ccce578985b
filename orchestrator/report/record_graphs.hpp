#pragma once
/// The graphs of a run's rounds in its record: tables segments and edges. Used by the writer's thread alone.

#include "core/experiment.hpp"
#include "orchestrator/report/sqlite.hpp"
#include "orchestrator/run/run.hpp"

#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace consort {

class RecordGraphs {
 public:
  RecordGraphs(Database& database, const Experiment& experiment) : database_(database), experiment_(experiment) {}
  void begin_run(const Job& job);
  /// Those of the rounds before `end`, as far as they are not there yet. The round from which on they are left out, the first time they
  /// are.
  std::optional<Round> write(std::size_t run, Round end);

 private:
  std::optional<std::int64_t> number_of(const std::shared_ptr<const Graph>& graph);
  void write_edges(std::int64_t graph, const std::vector<WeightedEdge>& edges);

  Database& database_;
  const Experiment& experiment_;
  std::optional<Schedule> schedule_;  // of the run that is going on; nothing where its graphs are not recorded, or not any more
  Round next_segment_ = 0;
  std::map<std::shared_ptr<const Graph>, std::int64_t> by_object_;
  std::map<std::pair<std::uint64_t, std::size_t>, std::int64_t> by_content_;  // by hash and number of edges
  std::size_t graph_rows_ = 0;                                                // of segments and edges
  std::size_t draws_ = 0;                                                     // that it takes to find the graph of a segment
};

}  // namespace consort
