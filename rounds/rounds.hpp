#pragma once
/// The rounds of the agents that one process hosts, whatever paces them: the messages of others (Lockstep) or a clock (Realtime). Knows no
/// transport: what comes from outside comes by call, what goes out goes through Send and Act.

#include "rounds/hosted.hpp"

namespace consort {

/// Hands what the members lack, and how far they have come, to whatever carries it to those they hear. Epoch and process are for the
/// carrier to fill in.
using Tell = std::function<void(Standing&&)>;

class Rounds {
 public:
  virtual ~Rounds() = default;
  Rounds() = default;
  Rounds(const Rounds&) = delete;
  Rounds& operator=(const Rounds&) = delete;

  /// Rounds below grant.until may run. Throws RunError if the grant refers to a graph that was never stated.
  virtual void grant(const Grant& grant) = 0;
  /// A remote agent's message has come; false if nobody here ever hears that agent.
  virtual bool receive(const Information& message) = 0;
  /// What the plant lets the members measure in one round has come. Throws RunError if it has another length than the members expect.
  virtual void receive(const Measurement& measurement) = 0;
  /// These agents, none of them a member, are gone: what has come of them still counts; nobody waits for them.
  virtual void depart(std::span<const AgentId> agents) = 0;
  /// These, gone until now, take part again from that round on.
  virtual void come_back(std::span<const AgentId> agents, Round round) = 0;
  /// Runs every round that can run now. Throws RunError naming agent, round and protocol where a protocol's numbers break down.
  virtual void advance() = 0;
  /// A clock says that round k begins and ends: the same with every round that has to run now.
  virtual void begin_round(Round k) = 0;
  virtual void end_round(Round k) = 0;

  /// Every member has reached the grant's report point since reports were last collected.
  [[nodiscard]] virtual bool report_due() const = 0;
  /// The report that is due says how each member stands, and its links.
  [[nodiscard]] virtual bool whole_report_due() const = 0;
  virtual std::vector<MemberReport> collect_reports() = 0;
  /// What the network did to the messages of each link, where a clock decides what is late.
  [[nodiscard]] virtual std::vector<NetworkTotals> network() const = 0;
  /// Rounds in which a member's measurement had not come: the one before was used.
  [[nodiscard]] virtual std::uint64_t missed_inputs() const = 0;

  [[nodiscard]] virtual Hosted& hosted() = 0;

  // --- where messages may be lost, and are waited for

  /// Another process tells how far it has come and what it lacks of the members: that is sent again.
  virtual void answer(const Standing& standing) = 0;
  /// Tells what the members lack; false if they lack nothing that could come.
  virtual bool ask() = 0;
  /// How many rounds the members have finished together.
  [[nodiscard]] virtual std::uint64_t finished() const = 0;
  /// How many messages have come that they can use.
  [[nodiscard]] virtual std::uint64_t heard() const = 0;
  /// How many of those that had been asked for have come once more: they were only late.
  [[nodiscard]] virtual std::uint64_t came_twice() const = 0;
  [[nodiscard]] virtual std::uint64_t sent_again_bytes() const = 0;
};

/// As the run says. Throws ConfigError where a protocol refuses its values. `tasks` are those of the members, `run` holds what is common.
/// `act` is called only if the run steers a plant, `tell` only in lockstep.
std::unique_ptr<Rounds> rounds_of(const Assignment& run, std::span<const MemberTask> tasks, Send send, Act act = {}, Tell tell = {});

}  // namespace consort
