#pragma once
/// Turns what a run reports into rows of its record. Used by the writer's thread alone.

#include "core/experiment.hpp"
#include "core/metrics/metrics.hpp"
#include "core/trace.hpp"
#include "orchestrator/report/record_columns.hpp"
#include "orchestrator/report/record_graphs.hpp"
#include "orchestrator/report/results.hpp"
#include "orchestrator/report/sqlite.hpp"
#include "orchestrator/run/run.hpp"

#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

namespace consort::recording {

/// Metrics and criteria of a summary, as tables results and criteria; of one that is not complete no criterion is met or not.
void write_results(Database& database, const Summary& summary);

struct Begin {
  Job job;
  std::string protocol, at;
  std::vector<RecordColumn> columns;
};
struct Rows {
  std::size_t run;
  Round round;
  std::size_t agents, dimension, offset;  // of Batch::values
};
struct Happened {
  std::size_t run;
  Round round;
  std::string kind, text;
};
struct AgentRows {
  std::size_t run;
  std::vector<AgentCounters> counters;
  std::vector<std::uint64_t> hashes;
};
struct End {
  std::size_t run;
  Round rounds;
  bool converged;
  double seconds;
  AgentCounters totals;
  std::uint64_t hash;
  std::string at;  // empty: it did not come to its end
  std::vector<LinkTotals> links;
  std::vector<NetworkTotals> network;
  std::vector<Performance> processes;
  Metrics metrics;
};

/// What waits to be written, in order.
struct Batch {
  std::vector<std::variant<Begin, Rows, Happened, AgentRows, End, Summary>> entries;
  std::vector<double> values;
  void clear() {
    entries.clear();
    values.clear();
  }
};

std::string utc_now();

class Writer {
 public:
  Writer(const std::filesystem::path& file, const Experiment& experiment);
  /// `committed` is told of the newest rows that are on the disk, also when what follows them fails.
  void write(const Batch& batch, const std::function<void(const Rows&)>& committed);

 private:
  void write(const Begin& begin, const Batch&);
  void write(const Rows& rows, const Batch& batch);
  void write(const Happened& event, const Batch&);
  void write(const AgentRows& rows, const Batch&);
  void write(const End& end, const Batch&);
  void write(const Summary& summary, const Batch&);
  void describe_columns(const Begin& begin);
  /// The graphs of the rounds before `end`, as far as they are not there yet.
  void write_graphs(std::size_t run, Round end);
  template <class Counters>
  void write_links(std::size_t run, const std::vector<OfLink<Counters>>& links, const char* insert);
  void write_processes(const End& end);
  void add_columns(const std::vector<RecordColumn>& columns);

  const Experiment& experiment_;
  Database database_;
  std::optional<Statement> insert_estimate_;
  std::set<std::string> columns_;
  RecordGraphs graphs_;
};

}  // namespace consort::recording
