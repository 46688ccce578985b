#include "orchestrator/report/record_graphs.hpp"

#include "core/trace.hpp"

#include <algorithm>
#include <span>
#include <variant>

namespace consort {
namespace {

constexpr std::size_t kMostGraphRows = 100'000;  // of segments and edges, unless the experiment wants all
constexpr std::size_t kDrawsPerRow = 10;         // a draw costs as much of a row
constexpr std::size_t kMostGraphsHeld = 64;      // known by their address, without a look at their edges

}  // namespace

void RecordGraphs::begin_run(const Job& job) {
  if (experiment_.recording.graphs == false) return;
  schedule_.emplace(experiment_.schedule(job.seed));
  if (const auto* random = std::get_if<RandomLinks>(&experiment_.topology)) draws_ = random->base->edges().size();
  next_segment_ = 0;
}

std::optional<Round> RecordGraphs::write(std::size_t run, Round end) {
  while (schedule_ && next_segment_ < std::min(end, experiment_.rounds)) {
    const Schedule::Segment segment = schedule_->segment(next_segment_);
    const auto graph = number_of(segment.graph);
    if (!graph) {
      schedule_.reset();
      return next_segment_;
    }
    const Round last = std::min(segment.last, experiment_.rounds - 1);
    Statement row = database_.prepare("INSERT INTO segments VALUES (?, ?, ?, ?)");
    row.bind(0, static_cast<std::int64_t>(run));
    row.bind(1, static_cast<std::int64_t>(next_segment_));
    row.bind(2, static_cast<std::int64_t>(last));
    row.bind(3, *graph);
    row.execute();
    graph_rows_ += 1 + draws_ / kDrawsPerRow;
    next_segment_ = last + 1;
  }
  return std::nullopt;
}

// Equal graphs have one number; a new one's edges are written. Nothing if that would be too much.
std::optional<std::int64_t> RecordGraphs::number_of(const std::shared_ptr<const Graph>& graph) {
  const bool enough = !experiment_.recording.graphs && graph_rows_ >= kMostGraphRows;
  if (const auto known = by_object_.find(graph); known != by_object_.end()) return enough ? std::nullopt : std::optional(known->second);
  const auto edges = graph->edges();
  if (enough || (!experiment_.recording.graphs && graph_rows_ + edges.size() > kMostGraphRows)) return std::nullopt;
  HistoryHash content;
  for (const auto& [edge, weight] : edges) {
    content.mix(std::uint64_t{edge.from.value} << 32 | edge.to.value);
    content.extend(std::span(&weight, 1));
  }
  const auto [known, is_new] = by_content_.try_emplace({content.value(), edges.size()}, static_cast<std::int64_t>(by_content_.size()));
  if (by_object_.size() == kMostGraphsHeld) by_object_.clear();
  by_object_.emplace(graph, known->second);
  if (is_new) write_edges(known->second, edges);
  return known->second;
}

void RecordGraphs::write_edges(std::int64_t graph, const std::vector<WeightedEdge>& edges) {
  Statement row = database_.prepare("INSERT INTO edges VALUES (?, ?, ?, ?)");
  row.bind(0, graph);
  for (const auto& [edge, weight] : edges) {
    row.bind(1, static_cast<std::int64_t>(edge.from.value));
    row.bind(2, static_cast<std::int64_t>(edge.to.value));
    row.bind(3, weight);
    row.execute();
  }
  graph_rows_ += edges.size();
}

}  // namespace consort
