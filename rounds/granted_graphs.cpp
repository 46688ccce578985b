#include "rounds/granted_graphs.hpp"

#include "core/errors.hpp"

#include <algorithm>

namespace consort {

std::string two_masters(Round round) {
  return "round " + std::to_string(round) +
         " was granted twice, or never: do two `consort run` with the same --name and key go on at once?";
}

std::shared_ptr<const GrantedGraphs::Topology> GrantedGraphs::topology_from(const std::vector<WeightedEdge>& edges) const {
  const std::size_t agents = member_of_.size();
  for (const auto& [edge, weight] : edges) {
    if (edge.from.value > agents || edge.to.value > agents) {
      throw RunError("a grant names an edge " + std::to_string(edge.from.value) + " -> " + std::to_string(edge.to.value) +
                     ", but there are only " + std::to_string(agents) + " agents");
    }
  }
  auto topology = std::make_shared<Topology>(Topology{Graph(agents, edges), {}, {}, {}});
  topology->local_listeners.resize(members_);
  topology->remote_listeners.resize(members_);
  topology->unanswered.resize(members_);
  std::vector<std::vector<AgentId>> remote_senders(members_);
  for (const auto& [edge, weight] : edges) {
    const std::uint32_t sender = member_of_[index_of(edge.from)], receiver = member_of_[index_of(edge.to)];
    if (sender == kNobody && receiver != kNobody) remote_senders[receiver].push_back(edge.from);
    if (sender == kNobody) continue;
    if (receiver == kNobody)
      topology->remote_listeners[sender].push_back(edge.to);
    else
      topology->local_listeners[sender].push_back(receiver);
  }
  for (std::size_t member = 0; member < members_; ++member) {
    auto &listeners = topology->remote_listeners[member], &senders = remote_senders[member];
    std::sort(listeners.begin(), listeners.end());
    std::sort(senders.begin(), senders.end());
    topology->unanswered[member] = !std::includes(listeners.begin(), listeners.end(), senders.begin(), senders.end());
  }
  return topology;
}

void GrantedGraphs::extend(std::span<const GrantedSegment> segments, Round slowest, Round first) {
  while (segments_.size() > 1 && segments_[1].first <= slowest) segments_.pop_front();
  for (const GrantedSegment& segment : segments) {
    if (!segments_.empty() && segments_.back().first >= segment.first) throw RunError(two_masters(segment.first));
    if (segment.graph >= graphs_.size()) graphs_.resize(segment.graph + 1);
    if (segment.stated) graphs_[segment.graph] = topology_from(*segment.stated);
    if (!graphs_[segment.graph] && segment.first < first) continue;  // stated before this process joined, and over by then
    if (!graphs_[segment.graph]) throw RunError("a grant refers to graph " + std::to_string(segment.graph) + ", which was never stated");
    segments_.push_back({segment.first, graphs_[segment.graph]});
  }
}

void GrantedGraphs::replace(std::span<const GrantedSegment> segments) {
  segments_.clear();
  for (const GrantedSegment& segment : segments)
    if (segment.stated) segments_.push_back({segment.first, topology_from(*segment.stated)});
}

GrantedGraphs::Segment GrantedGraphs::at(Round k) const {
  const auto after = std::upper_bound(segments_.begin(), segments_.end(), k, [](Round round, const Segment& s) { return round < s.first; });
  if (after == segments_.begin()) return {};
  return {std::prev(after)->first, std::prev(after)->topology, after == segments_.end() ? kNever : after->first};
}

}  // namespace consort
