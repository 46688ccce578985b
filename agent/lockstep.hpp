#pragma once
/// The rounds of the agents hosted by one process, in lockstep with their in-neighbours. Knows no transport and no clock: messages and
/// grants come in by call, messages go out through `Send`. The same rounds as simulate(), in whatever order the messages arrive.

#include "core/trace.hpp"
#include "idl/wire.hpp"
#include "protocols/protocol.hpp"

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <vector>

namespace consort {

class Lockstep {
 public:
  /// Hands one message to whatever carries it to other processes. `member` is the index among the members, in assignment order.
  using Send = std::function<void(std::size_t member, Round round, std::span<const double> payload)>;
  /// Hands the controls of all members that take part in a round, one after the other, to whatever carries them to the plant.
  using Act = std::function<void(Round round, std::span<const double> controls)>;

  /// Throws ConfigError where a protocol refuses its values. `members` are hosted here; `run` holds what is common. `act` is called only
  /// if the run steers a plant.
  Lockstep(const Assignment& run, std::span<const MemberTask> members, Send send, Act act = {});
  virtual ~Lockstep() = default;
  Lockstep(const Lockstep&) = delete;
  Lockstep& operator=(const Lockstep&) = delete;

  /// Rounds below grant.until may run. A grant that came before, or an older one, changes nothing. Throws RunError if the grant refers to a
  /// graph that was never stated.
  virtual void grant(const Grant& grant);
  /// Takes a remote agent's message; true if it was new and expected by somebody here.
  bool receive(const Information& message);
  /// Takes what the plant lets the members measure in one round. Throws RunError if it has another length than the members expect.
  virtual void receive(const Measurement& measurement);
  /// Takes what an agent announced. Before a round runs, everything must be here that its members are told by then.
  void learn(AgentId agent, const Values& announcement);
  /// These agents, none of them a member, are gone: what has come of them still counts; nobody waits for them.
  void depart(std::span<const AgentId> agents);
  /// Runs every round that can run now. Throws RunError naming agent, round and protocol where a protocol's numbers break down.
  virtual void advance();

  /// Every member has reached the grant's report point since the reports were last taken.
  [[nodiscard]] bool report_due() const { return report_due_; }
  /// The report that is due says how each member stands, and its links.
  [[nodiscard]] bool whole_report_due() const { return report_due_ && whole_; }
  std::vector<MemberReport> take_reports();
  /// What has not been reported yet, and how each member stands.
  std::vector<MemberReport> take_all();
  /// Every member has left: no round is to come.
  [[nodiscard]] bool over() const { return left_ == members_.size(); }
  [[nodiscard]] std::vector<LinkReport> links() const;
  [[nodiscard]] const Protocol& protocol(std::size_t member) const { return *members_[member].protocol; }
  [[nodiscard]] const Layout& recorded_layout(std::size_t member) const { return members_[member].recorded; }

  /// The slowest member: its round, and whom it waits for (empty: for a grant).
  struct Progress {
    AgentId agent;
    Round round = 0;
    std::vector<AgentId> waiting_for;
    bool for_measurement = false;
  };
  [[nodiscard]] Progress slowest() const;
  [[nodiscard]] Round granted_until() const { return until_; }

 protected:
  /// A graph with the members that hear each member of this process, so that local messages need no look-up.
  struct Topology {
    Graph graph;
    std::vector<std::vector<std::uint32_t>> local_listeners;  // by member
    std::vector<bool> heard_elsewhere;                        // by member: somebody in another process hears it
  };
  struct Segment {
    Round first;
    std::shared_ptr<const Topology> topology;
  };
  /// What the plant let the members measure in one round.
  struct Measured {
    Round round;
    std::vector<double> values;
  };
  struct Member {
    AgentId id;
    Attendance attendance;
    std::size_t measurements;   // length of y; 0: it measures nothing
    std::size_t distances;      // numbers that follow it: how far its senders are away
    std::span<const double> y;  // of round k
    [[nodiscard]] std::size_t told_by_plant() const { return measurements + distances; }
    std::unique_ptr<Protocol> protocol;
    std::vector<Told> to_learn;       // what it is told later, the next one last
    std::vector<const Values*> told;  // by agent: what it announced, as far as this member knows
    Mailbox mailbox;
    std::vector<double> payload, estimate;
    Layout recorded;  // what its reports hold beside the estimate
    MemberReport report;
    HistoryHash hash;
    AgentCounters counters;
    Round k = 0;
    bool emitted = false;                      // this round's message is out
    std::size_t missing = 0;                   // messages of round k still to come, once emitted
    std::span<const Neighbour> in_neighbours;  // of round k, once emitted
    std::vector<Neighbour> remaining;          // where they lie if somebody is gone
    std::vector<AgentId> given_up;             // who is gone and was not heard in a round that is over or waited for
    std::shared_ptr<const Topology> topology;  // of round k, valid below topology_until
    Round topology_until = 0;
  };

  std::shared_ptr<const Topology> topology_from(std::vector<WeightedEdge> edges) const;
  /// False where no grant has told the graph of its round.
  bool find_topology(Member& member) const;
  void check_length(const Measurement& measurement) const;
  [[nodiscard]] bool find_measurement(std::size_t index);
  void steer(std::size_t index);
  [[nodiscard]] Sense sense_of(const Member& member) const;
  /// `all`: whatever it is told by its round must be here.
  void tell(Member& member, bool all) const;
  void find_neighbours(Member& member) const;
  void emit(std::size_t index);
  void finish_round(std::size_t index);
  void report_state(Member& member);
  static void add_report(Member& member);
  virtual void deliver(Member& member, std::uint32_t index, AgentId from, Round round, std::span<const double> payload);

  std::uint32_t agents_;
  Seconds dt_;
  Round rounds_, report_interval_;
  Send send_;
  Act act_;
  std::vector<Member> members_;
  std::vector<std::uint32_t> member_of_;               // agent index -> member, or kNobody
  std::vector<std::vector<std::uint32_t>> listeners_;  // agent index -> members that may ever hear it
  std::map<AgentId, Values> announced_;
  std::vector<AgentId> gone_;         // ascending
  std::size_t left_ = 0;              // members whose time is over
  std::vector<std::uint32_t> ready_;  // members that may be able to go on
  std::deque<Segment> segments_;
  std::vector<std::shared_ptr<const Topology>> graphs_;  // by number; the orchestrator reuses numbers
  std::deque<Measured> measured_;                        // ascending; from the slowest member's round on
  std::vector<double> controls_;                         // of the round that is being finished, member after member
  std::size_t steered_ = 0;                              // members whose controls are there
  Round first_ = 0;                                      // before it, none of the members takes part
  Round until_ = 0, report_at_ = 0;
  std::size_t reached_report_ = 0;  // members at or beyond report_at_
  bool report_due_ = false, whole_ = false;
};

}  // namespace consort
