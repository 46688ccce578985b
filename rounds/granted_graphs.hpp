#pragma once
/// Which graph holds in which round, as grants say it, for the agents of one process.

#include "core/messages.hpp"

#include <deque>
#include <memory>
#include <vector>

namespace consort {

/// What a run grants fits together; what two grant does not.
std::string two_masters(Round round);

class GrantedGraphs {
 public:
  static constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();

  /// A graph with the members that hear each member of this process, so that local messages need no look-up.
  struct Topology {
    Graph graph;
    std::vector<std::vector<std::uint32_t>> local_listeners;  ///< by member
    std::vector<std::vector<AgentId>> remote_listeners;       ///< by member: who hears it in other processes, ascending
    std::vector<bool> unanswered;                             ///< by member: somebody elsewhere whom it hears does not hear it
  };
  struct Segment {
    Round first = 0;
    std::shared_ptr<const Topology> topology;
    Round end = 0;  ///< the first round after it, as far as is known
  };

  /// `member_of`: by agent, its number among `members`, or kNobody.
  GrantedGraphs(std::vector<std::uint32_t> member_of, std::size_t members) : member_of_(std::move(member_of)), members_(members) {}

  /// The segments follow those granted before. Nobody will ask for rounds before `slowest`, and nobody ever did for those before `first`.
  /// Throws RunError if one refers to a graph that was never stated, or does not follow.
  void extend(std::span<const GrantedSegment> segments, Round slowest, Round first);
  /// The segments are all that hold from now on.
  void replace(std::span<const GrantedSegment> segments);
  [[nodiscard]] bool empty() const { return segments_.empty(); }
  /// The segment of round k; without a topology where no grant has told it.
  [[nodiscard]] Segment at(Round k) const;

 private:
  [[nodiscard]] std::shared_ptr<const Topology> topology_from(const std::vector<WeightedEdge>& edges) const;

  std::vector<std::uint32_t> member_of_;
  std::size_t members_;
  std::deque<Segment> segments_;
  std::vector<std::shared_ptr<const Topology>> graphs_;  // by number; the orchestrator reuses numbers
};

}  // namespace consort
