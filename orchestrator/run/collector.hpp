#pragma once
/// Puts the agents' reports together, round by round: agents run ahead of each other, a round is handed on when everybody has reported it.

#include "core/trace.hpp"
#include "idl/wire.hpp"

#include <deque>
#include <functional>
#include <map>
#include <set>
#include <vector>

namespace consort {

class Collector {
 public:
  /// `state_dimension`: of an agent's part of the plant, 0 without one. `presence`: agents that join or leave on the way; an agent that
  /// leaves reports the round it leaves in, which then counts as its last word. `recorded_dimension`: of what an agent records beside its
  /// estimate.
  Collector(std::size_t agents, std::size_t dimension, Round rounds, Round report_interval, std::size_t state_dimension = 0,
            const std::map<AgentId, Attendance>& presence = {}, std::size_t recorded_dimension = 0);

  /// Takes one agent's reports (of who has come back: what it counted in earlier stays is added), or (`of_plant`) those of its part of the
  /// plant. What does not fit the run (unknown agent, wrong size, a round not reported, twice) is counted and left out.
  void add(const MemberReport& report, bool of_plant = false);
  /// These agents are gone: what they have reported counts; from then on they, and their parts of the plant, are absent.
  void depart(std::span<const AgentId> agents);
  /// Calls `use` for every round that is complete now, ascending, until it returns false.
  void hand_on(const std::function<bool(const RoundReport&)>& use);

  /// The last round the agent has reported, and (real time) the rounds of all its stays that it has left out.
  [[nodiscard]] Round reached(AgentId agent) const;
  [[nodiscard]] std::uint64_t slept(AgentId agent) const;
  /// The last round the plant has reported.
  [[nodiscard]] Round plant_reached() const { return plant_reached_; }
  [[nodiscard]] std::uint64_t left_out() const { return left_out_; }
  /// Agents that have not reported the oldest incomplete round.
  [[nodiscard]] std::vector<AgentId> missing() const;

 private:
  /// What one kind of reporter (the agents, or the plant on their parts) said of one round.
  struct Half {
    std::vector<double> numbers;
    std::vector<double> recorded;  // beside the numbers
    std::vector<std::uint64_t> hashes;
    std::vector<AgentCounters> counters;
    std::vector<bool> here;
    std::size_t count = 0;
  };
  struct Row {
    Half agents, plant;
  };
  /// The last word of an agent that has left.
  struct Last {
    std::uint64_t hash;
    AgentCounters counters;
  };
  using LastWords = std::map<AgentId, std::map<Round, Last>>;  // of each stay, by the round in which it ended
  [[nodiscard]] Row new_row(Round k) const;
  [[nodiscard]] Half new_half(Round k, std::size_t dimension, std::size_t recorded, const LastWords& last) const;
  static void fill_absent(Half& half, AgentId agent, const Last& last);
  [[nodiscard]] Attendance attendance_of(AgentId agent) const;
  void update_progress(AgentId agent, Round k, std::uint64_t slept, bool of_plant);
  void set_last(AgentId agent, const Attendance& stay, const Last& last, bool of_plant);
  [[nodiscard]] AgentCounters of_earlier_stays(AgentId agent, Round k) const;
  [[nodiscard]] bool is_reported(Round k) const { return k <= rounds_ && (k % interval_ == 0 || k == rounds_); }
  [[nodiscard]] std::size_t number_of(Round k) const { return k / interval_ + (k % interval_ != 0 ? 1 : 0); }
  [[nodiscard]] Round round_of(std::size_t number) const;

  std::size_t agents_, dimension_, state_dimension_, recorded_dimension_;
  Round rounds_, interval_;
  std::map<AgentId, Attendance> presence_;
  std::set<Round> ends_;  // of stays: every agent may say how it stands then
  LastWords last_agents_, last_plant_;
  struct Departed {
    Round from;
    Last last;
    Round until = Attendance{}.until;  // or it begins another stay
  };
  std::map<AgentId, std::vector<Departed>> departed_;
  std::map<AgentId, Departed> newest_;  // of each agent: the round after its newest report, and what that said
  std::size_t first_ = 0;               // number of rows_.front()
  std::deque<Row> rows_;
  struct Progress {
    Round reached = 0;
    std::map<Round, std::uint64_t> slept;  // by the end of the stay
  };
  std::map<AgentId, Progress> progress_;
  Round plant_reached_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace consort
