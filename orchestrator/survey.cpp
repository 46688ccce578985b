#include "orchestrator/survey.hpp"

#include <algorithm>
#include <map>

namespace consort {

namespace {

// Edges and agents looked at in all: a second or two of graph searches.
constexpr std::size_t kWorkBudget = 5'000'000;

Graph union_between(const std::vector<Schedule::Segment>& segments, std::size_t first, std::size_t end) {
  std::vector<Graph> graphs;
  for (std::size_t i = first; i < end; ++i) graphs.push_back(*segments[i].graph);
  return union_of(graphs);
}

}  // namespace

std::optional<Survey::Failure> Survey::failure(const std::function<bool(const Graph&)>& property) const {
  std::map<const Graph*, bool> known;
  std::optional<Failure> out;
  for (const auto& segment : segments) {
    const auto [it, fresh] = known.emplace(segment.graph.get(), false);
    if (fresh) it->second = property(*segment.graph);
    if (it->second) continue;
    if (!out) out = Failure{segment.first, 0};
    out->count += segment.last - segment.first + 1;
  }
  return out;
}

Survey::Spanning Survey::spanning() const {
  // For each segment s the first segment e(s) such that the union of s..e(s) spans; e never moves back. A window that starts with the
  // first round of s must reach the first round of e(s).
  Round window = 0;
  std::size_t end = 1;
  for (std::size_t start = 0; start < segments.size(); ++start) {
    end = std::max(end, start + 1);
    Graph together = union_between(segments, start, end);
    while (!has_spanning_tree(together) && end < segments.size()) together = union_of(std::vector{together, *segments[end++].graph});
    if (has_spanning_tree(together)) {
      window = std::max(window, segments[end - 1].first - segments[start].first + 1);
      continue;
    }
    // The run ends before the union spans. That is no news while fewer rounds are left than such a window may take.
    const Round left = rounds - segments[start].first;
    if (window == 0 || left >= 2 * window) return {std::nullopt, segments[start].first};
    return {std::max(window, left + 1), 0};
  }
  return {window, 0};
}

Survey survey(const Schedule& schedule, Round rounds) {
  Survey out;
  std::size_t work = 0;
  for (Round k = 0; k < rounds && work < kWorkBudget;) {
    Schedule::Segment segment = schedule.segment(k);
    segment.first = std::max(segment.first, k);
    segment.last = std::min(segment.last, rounds - 1);
    work += segment.graph->agents() + segment.graph->edge_count();
    k = segment.last + 1;
    out.rounds = k;
    out.segments.push_back(std::move(segment));
  }
  out.complete = out.rounds == rounds;
  return out;
}

}  // namespace consort
