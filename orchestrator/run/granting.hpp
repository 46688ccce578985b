#pragma once
/// Lockstep: which rounds may be run next, and with which graphs. Nobody is granted rounds beyond one in which somebody's process comes, or
/// something happens to one, before that has happened. Pure: how far everybody has come, and how long that took, is told.

#include "core/experiment.hpp"
#include "core/messages.hpp"

#include <memory>
#include <optional>
#include <vector>

namespace consort {

/// States each graph once, then refers to it by number; numbers are reused in turn, so a schedule without end does not pile up.
class GraphNumbers {
 public:
  GrantedSegment segment(Round first, const std::shared_ptr<const Graph>& graph);

 private:
  std::vector<std::shared_ptr<const Graph>> graphs_;
  std::uint32_t next_ = 0;
};

/// For how long a process that is stopped stands still: in lockstep nobody can reach the round of its `continue` before it, so it sleeps
/// for as long as the rounds in between stand for.
Seconds time_until_proceed(const Experiment& experiment, const Fault& stop);

class Granting {
 public:
  /// What happens before a round begins, while everybody stands before it.
  struct Pause {
    Round round = 0;
    std::vector<Fault> faults;  ///< kills and stops
    bool joins = false;         ///< somebody comes
    std::vector<AgentId> back;  ///< of those, who has been there before
  };

  /// `experiment` must outlive this.
  Granting(const Experiment& experiment, Seed seed, std::uint32_t epoch);

  /// Everybody has come as far as this: what is to happen before more may be granted, one pause at a time.
  std::optional<Pause> due(Round reached);
  /// The next grant, sized by the speed seen so far: `seconds` since round 0 began.
  Grant grant(Round reached, double seconds);
  /// Everybody who is there has come as far as this, and some wait for that: who has left, but may have to send its last messages again.
  std::optional<Grant> release(Round reached);
  /// Who joins has heard of no graph yet.
  void state_graphs_again() { graphs_ = {}; }
  /// Everybody has come to the point where the newest grant asked for a report, and there are rounds left.
  [[nodiscard]] bool is_time(Round reached) const { return report_at_ < experiment_.rounds && reached >= report_at_; }
  /// Rounds below this one have been granted.
  [[nodiscard]] Round granted() const { return granted_; }

 private:
  [[nodiscard]] Round next_pause() const;
  [[nodiscard]] bool kills_at(Round round) const;

  const Experiment& experiment_;
  std::uint32_t epoch_;
  Schedule schedule_;
  Round interval_;
  GraphNumbers graphs_;
  Round granted_ = 0, stated_until_ = 0, report_at_ = 0, half_ = 0, paused_ = 0, told_reached_ = 0;
};

}  // namespace consort
