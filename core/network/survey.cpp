#include "core/network/survey.hpp"

#include <algorithm>
#include <map>
#include <set>

namespace consort {

namespace {

constexpr double kSegmentWork = 100.0;  // what a segment costs beside its agents and edges, as so many of them
constexpr double kDrawWork = 4.0;       // what an edge costs that is drawn
constexpr double kWindowWork = 0.25;    // what windows may cost, of what the segments may

using Range = std::pair<std::size_t, std::size_t>;  // segments [first, end) in which the same agents are there

// The sliding window over one such range, as far as `work` suffices.
Survey::Spanning spanning_of(const Survey& survey, Range range, double& work) {
  const auto spanning = [&work](const Graph& graph) {
    work -= static_cast<double>(graph.agents() + graph.edge_count());
    return has_spanning_tree(graph);
  };
  const auto union_between = [&](std::size_t first, std::size_t end) {
    if (end == first + 1) return survey.graphs[first];
    std::vector<Graph> graphs;
    for (std::size_t i = first; i < end; ++i) graphs.push_back(*survey.graphs[i]);
    return std::make_shared<const Graph>(union_of(graphs));
  };
  // For each segment s the first segment e(s) such that the union of s..e(s) spans; e never moves back. A window that starts with the
  // first round of s must reach the first round of e(s).
  Round window = 0;
  const auto found = [&window] { return window > 0 ? std::optional(window) : std::nullopt; };
  std::size_t end = range.first + 1;
  for (std::size_t start = range.first; start < range.second; ++start) {
    if (work < 0.0) return {found(), 0, survey.segments[start].first};
    end = std::max(end, start + 1);
    auto together = union_between(start, end);
    bool spans = spanning(*together);
    while (!spans && end < range.second && work >= 0.0) {
      together = std::make_shared<const Graph>(union_of(std::vector{*together, *survey.graphs[end++]}));
      spans = spanning(*together);
    }
    if (spans) {
      window = std::max(window, survey.segments[end - 1].first - survey.segments[start].first + 1);
      continue;
    }
    // The rounds end before the union spans. That is no news while fewer are left than such a window may take.
    const Round left = survey.segments[range.second - 1].last + 1 - survey.segments[start].first;
    const bool torn = window == 0 || left >= 2 * window, more = !survey.complete && range.second == survey.segments.size();
    if (work < 0.0 || (torn && more)) return {found(), 0, survey.segments[start].first};
    if (torn) return {std::nullopt, survey.segments[start].first};
    return {std::max(window, left + 1), 0};
  }
  return {window, 0};
}

}  // namespace

std::optional<Survey::Failure> Survey::failure(const std::function<bool(const Graph&)>& property) const {
  std::map<const Graph*, bool> known;
  std::optional<Failure> out;
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const auto [it, fresh] = known.emplace(graphs[s].get(), false);
    if (fresh) it->second = property(*graphs[s]);
    if (it->second) continue;
    if (!out) out = Failure{segments[s].first, 0};
    out->count += segments[s].last - segments[s].first + 1;
  }
  return out;
}

Survey::Spanning Survey::spanning() const {
  Round window = 0;
  double left = work;
  for (Range range{0, 0}; range.first < segments.size(); range.first = range.second) {
    while (range.second < segments.size() && *members[range.second] == *members[range.first]) ++range.second;
    if (members[range.first]->size() < 2) continue;  // one agent agrees with itself
    const Spanning here = spanning_of(*this, range, left);
    if (!here.window || here.looked_until) return here;
    window = std::max(window, *here.window);
  }
  return {std::max<Round>(window, 1), 0};
}

std::vector<std::size_t> Survey::distinct() const {
  std::set<const Graph*> seen;
  std::vector<std::size_t> out;
  for (std::size_t s = 0; s < graphs.size(); ++s)
    if (seen.insert(graphs[s].get()).second) out.push_back(s);
  return out;
}

Survey survey(const Schedule& schedule, Round rounds, double work) {
  Survey out;
  out.work = kWindowWork * work;
  const double drawn = schedule.draws_edges() ? kDrawWork * schedule.most_edges() : 0.0;
  Survey::Members all(schedule.agents());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = agent_at(i);
  const auto everybody = std::make_shared<const Survey::Members>(std::move(all));
  for (Round k = 0; k < rounds && (work > 0.0 || k == 0);) {
    Schedule::Segment segment = schedule.segment(k);
    segment.first = std::max(segment.first, k);
    segment.last = std::min(segment.last, rounds - 1);
    work -= kSegmentWork + drawn + static_cast<double>(segment.graph->agents() + segment.graph->edge_count());
    k = segment.last + 1;
    out.rounds = k;
    out.members.push_back(everybody);
    out.graphs.push_back(segment.graph);
    out.segments.push_back(std::move(segment));
  }
  out.complete = out.rounds == rounds;
  return out;
}

Survey survey(const Experiment& experiment, double work) {
  Survey out = survey(experiment.schedule(experiment.seed), experiment.rounds, work);
  if (experiment.presence.empty()) return out;
  std::map<std::pair<const Graph*, Survey::Members>, std::shared_ptr<const Graph>> parts;
  std::shared_ptr<const Survey::Members> newest;
  for (std::size_t s = 0; s < out.segments.size(); ++s) {
    Survey::Members there;
    for (const AgentId agent : *out.members[s])
      if (experiment.presence_of(agent).holds(out.segments[s].first)) there.push_back(agent);
    if (!newest || *newest != there) newest = std::make_shared<const Survey::Members>(there);
    out.members[s] = newest;
    if (there.size() == experiment.agents) continue;
    auto& part = parts[{out.segments[s].graph.get(), there}];
    if (!part) part = std::make_shared<const Graph>(part_of(*out.segments[s].graph, there));
    out.graphs[s] = part;
  }
  return out;
}

}  // namespace consort
