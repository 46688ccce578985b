#pragma once
/// The agents that one process hosts in one run: who of them hears whom, on which graph each of their rounds runs, what goes out of the
/// process, what is reported. When a round begins and ends is for its owner to say.

#include "rounds/granted_graphs.hpp"
#include "rounds/member.hpp"

#include <functional>

namespace consort {

/// Hands one message to whatever carries it to other processes. `member` is the index among the members, in assignment order.
using Send = std::function<void(std::size_t member, Round round, std::span<const double> message)>;
/// Hands the controls of all members that take part in a round, one after the other, to whatever carries them to the plant.
using Act = std::function<void(Round round, std::span<const double> controls)>;

class Hosted {
 public:
  Hosted(const Assignment& run, std::span<const MemberTask> tasks, Send send);

  [[nodiscard]] std::size_t size() const { return places_.size(); }
  [[nodiscard]] Member& operator[](std::size_t member) { return places_[member].member; }
  [[nodiscard]] const Member& operator[](std::size_t member) const { return places_[member].member; }
  /// The members that may ever hear that agent; none of an agent that the run does not have.
  [[nodiscard]] std::span<const std::uint32_t> listeners(AgentId agent) const;
  /// The member that agent is; nothing if it is not hosted here.
  [[nodiscard]] std::optional<std::size_t> member_with(AgentId agent) const;
  /// The first round in which a member takes part.
  [[nodiscard]] Round first() const { return first_; }
  /// The round in which the last of them has left.
  [[nodiscard]] Round last() const;

  /// An agent has announced this. Before a round runs, everything must be here that its members are told by then.
  void learn(AgentId agent, const Values& announcement);
  void depart(std::span<const AgentId> agents);

  /// Rounds below grant.until may run: the segments follow those of grants before, or are all that hold from now on.
  void extend(const Grant& grant);
  void replace(const Grant& grant);
  [[nodiscard]] bool granted() const { return !graphs_.empty(); }
  [[nodiscard]] Round granted_until() const { return until_; }
  /// False where no grant has told the graph of the member's round.
  bool find_topology(std::size_t member);
  /// Who hears the member in other processes, ascending, on the graph that find_topology() has found.
  [[nodiscard]] std::span<const AgentId> remote_listeners(std::size_t member) const {
    return places_[member].topology->remote_listeners[member];
  }
  /// On that graph, somebody elsewhere whom it hears does not hear it.
  [[nodiscard]] bool unanswered(std::size_t member) const { return places_[member].topology->unanswered[member]; }
  /// The member's round begins: its message leaves, if somebody elsewhere hears it. The members here that do are returned.
  std::span<const std::uint32_t> begin(std::size_t member, std::span<const double> y);
  /// Whose announcement the member lacks for its round; nothing: it lacks none.
  std::optional<AgentId> lacking(std::size_t member) { return places_[member].member.learn(announced_); }
  /// The member's round ends, with what is in its mailbox, or with this inbox; or it goes by without the member.
  void finish(std::size_t member);
  void finish(std::size_t member, Inbox inbox);
  void miss(std::size_t member);

  /// How many numbers the plant sends this member in a round, and how many of them it measures.
  [[nodiscard]] std::size_t numbers_from_plant(std::size_t member) const {
    return places_[member].measurements + places_[member].distances;
  }
  [[nodiscard]] std::size_t measurements(std::size_t member) const { return places_[member].measurements; }
  /// Throws RunError if the measurement has another length than the members that take part in its round expect.
  void check_length(const Measurement& measurement) const;

  /// What has not been collected yet; `whole`: and how each member stands.
  std::vector<MemberReport> collect_reports(bool whole);
  /// Every member has left: no round is to come.
  [[nodiscard]] bool over() const { return left_ == places_.size(); }
  [[nodiscard]] std::vector<LinkTotals> links() const;
  /// The round of the slowest member.
  [[nodiscard]] Round slowest_round() const;

  /// The slowest member: its round, and whom it waits for (empty: for a grant).
  struct Progress {
    AgentId agent;
    Round round = 0;
    std::vector<AgentId> waiting_for;
    bool for_measurement = false;
  };
  [[nodiscard]] Progress slowest() const;

 private:
  struct Place {
    Member member;
    std::size_t measurements;  // length of y; 0: it measures nothing
    std::size_t distances;     // numbers that follow it: how far its senders are away
    MemberReport report;
    std::shared_ptr<const GrantedGraphs::Topology> topology;  // of its round, valid below topology_until
    Round topology_until = 0;
  };
  void round_over(Place& place);
  static void add_report(Place& place);
  void grant_until(const Grant& grant);

  Round rounds_, report_interval_;
  bool steers_;
  Send send_;
  std::vector<Place> places_;
  std::vector<std::vector<std::uint32_t>> listeners_;  // agent index -> members that may ever hear it
  std::vector<std::uint32_t> member_of_;               // agent index -> member, or kNobody
  Announced announced_;
  std::vector<AgentId> gone_;  // ascending
  std::size_t left_ = 0;       // members whose time is over
  GrantedGraphs graphs_;
  Round first_ = 0;  // before it, none of the members takes part
  Round until_ = 0;
};

}  // namespace consort
