#pragma once
/// Puts the agents' reports together, round by round: agents run ahead of each other, a round is handed on when everybody has reported it.

#include "core/trace.hpp"
#include "idl/wire.hpp"

#include <deque>
#include <functional>
#include <vector>

namespace consort {

class Collector {
 public:
  Collector(std::size_t agents, std::size_t dimension, Round rounds, Round report_interval);

  /// Takes one agent's reports. What does not fit the run (unknown agent, wrong size, a round not reported, twice) is counted and left out.
  void add(const wire::MemberReport& report);
  /// Calls `use` for every round that is complete now, ascending, until it returns false.
  void hand_on(const std::function<bool(const RoundReport&)>& use);

  [[nodiscard]] std::uint64_t left_out() const { return left_out_; }
  /// Agents that have not reported the oldest incomplete round.
  [[nodiscard]] std::vector<AgentId> missing() const;

 private:
  struct Row {
    std::vector<double> estimates;
    std::vector<std::uint64_t> hashes;
    std::vector<AgentCounters> counters;
    std::vector<bool> here;
    std::size_t count = 0;
  };
  [[nodiscard]] bool is_reported(Round k) const { return k <= rounds_ && (k % interval_ == 0 || k == rounds_); }
  [[nodiscard]] std::size_t number_of(Round k) const { return k / interval_ + (k % interval_ != 0 ? 1 : 0); }
  [[nodiscard]] Round round_of(std::size_t number) const;

  std::size_t agents_, dimension_;
  Round rounds_, interval_;
  std::size_t first_ = 0;  // number of rows_.front()
  std::deque<Row> rows_;
  std::vector<Row> spare_;  // rows to use again
  std::uint64_t left_out_ = 0;
};

}  // namespace consort
