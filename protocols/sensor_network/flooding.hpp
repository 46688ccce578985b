#pragma once
/// The largest value that anybody present has, found by messages alone; several values at once, component by component.
///
/// Every agent sends the largest value it knows and how many rounds ago somebody who has it sent it out. Whoever has a value sends it out
/// anew in every round, so what a present agent has is never older than its distance in rounds, at most one less than there are agents.
/// What is older than the agreed number of rounds L belongs to somebody who left, or who no longer reaches us: it is forgotten, by
/// everybody in the same round, and the next largest takes its place. A message therefore has two numbers per value, however many agents
/// there are, and nothing has to be started again when somebody joins or leaves.
///
/// The end is seen locally: a value that has not changed for L rounds is final, until somebody joins or leaves. With L at least the
/// number of agents and links that lose and delay nothing, everybody who is reached by the one with the largest value ends
///     within 2 L rounds of the start or of a joining, within 3 L rounds of a leaving.
/// Links that lose or delay messages need a larger L.

#include "core/types.hpp"

#include <algorithm>
#include <span>

namespace consort {

class FloodedMaximum {
 public:
  /// What the agent has itself (l x 1, finite), and L >= 1.
  FloodedMaximum(Vector own, Round rounds)
      : own_(std::move(own)), largest_(own_), ages_(Vector::Zero(own_.size())), before_(own_), rounds_(rounds) {}

  /// What to send: the largest value known, and its age in rounds. Both l x 1.
  [[nodiscard]] const Vector& largest() const { return largest_; }
  [[nodiscard]] const Vector& ages() const { return ages_; }

  /// Begins a round; then heard() for every message of it, then end().
  void begin() {
    before_ = largest_;
    for (Eigen::Index c = 0; c < own_.size(); ++c)
      if (ages_[c] >= rounds_ || own_[c] >= largest_[c]) restart(c);
  }
  /// What an in-neighbour sent `delay` rounds ago.
  void heard(const Eigen::Map<const Vector>& values, const Eigen::Map<const Vector>& ages, Round delay) {
    for (Eigen::Index c = 0; c < own_.size(); ++c) {
      const double age = ages[c] + delay;
      if (age >= rounds_ || values[c] < largest_[c] || (values[c] == largest_[c] && age >= ages_[c])) continue;
      largest_[c] = values[c];
      ages_[c] = age;
    }
  }
  void end() {
    for (Eigen::Index c = 0; c < own_.size(); ++c)
      if (own_[c] < largest_[c]) ages_[c] += 1.0;  // one's own is sent out anew
    unchanged_ = largest_ == before_ ? std::min(unchanged_ + 1, rounds_) : 0;
  }

  /// The largest value is final, unless somebody joins or leaves.
  [[nodiscard]] bool ended() const { return unchanged_ >= rounds_; }

 private:
  void restart(Eigen::Index c) {
    largest_[c] = own_[c];
    ages_[c] = 0.0;
  }

  Vector own_, largest_, ages_, before_;
  Round rounds_, unchanged_ = 0;
};

}  // namespace consort
