#pragma once
/// Rounds paced by a clock instead of by the neighbours' messages: what has not come when the round ends is missing, and nobody is waited
/// for. Knows no clock: its owner says when a round begins and ends.

#include "rounds/rounds.hpp"

namespace consort {

class Realtime final : public Rounds {
 public:
  /// See rounds_of(). A message may be used for run.delivery.lifespan: in its own round, or in the next one after it has come, and then as
  /// long as there is no newer one.
  Realtime(const Assignment& run, std::span<const MemberTask> tasks, Send send, Act act = {});

  /// The grant's segments are all that hold from now on.
  void grant(const Grant& grant) override { hosted_.replace(grant); }
  bool receive(const Information& message) override;
  void receive(const Measurement& measurement) override;
  void depart(std::span<const AgentId> agents) override { hosted_.depart(agents); }
  void come_back(std::span<const AgentId>, Round) override {}  // who is heard again is there
  void advance() override {}                                   // the clock does
  /// Every member that takes part in round k emits. Who is behind misses the rounds before k: its state stands still over them.
  void begin_round(Round k) override;
  /// Every member that takes part in round k absorbs what is here.
  void end_round(Round k) override;
  [[nodiscard]] bool report_due() const override { return false; }  // reports leave by the clock, too
  [[nodiscard]] bool whole_report_due() const override { return false; }
  std::vector<MemberReport> collect_reports() override { return hosted_.collect_reports(false); }
  [[nodiscard]] std::vector<NetworkTotals> network() const override;
  [[nodiscard]] std::uint64_t missed_inputs() const override { return missed_inputs_; }
  [[nodiscard]] Hosted& hosted() override { return hosted_; }
  void answer(const Standing&) override {}
  bool ask() override { return false; }  // what is late is of no use
  [[nodiscard]] std::uint64_t finished() const override { return 0; }
  [[nodiscard]] std::uint64_t heard() const override { return 0; }
  [[nodiscard]] std::uint64_t came_twice() const override { return 0; }
  [[nodiscard]] std::uint64_t sent_again_bytes() const override { return 0; }

 private:
  // What a member knows of one sender's messages.
  struct Incoming {
    NetworkCounters counters;
    Round newest = 0;             // the latest round received, plus one
    std::uint64_t missing = 0;    // bit b: the message of round last_ended - b was expected and has not come
    std::uint64_t came = 0;       // bit b: it came in time
    std::vector<double> payload;  // of the message used last, and
    Received used;                // what was said of it
    Round used_in = 0;            // plus one: the round it was due in; 0: none yet
    double weight = 1.0;          // of the edge, when it was there last

    void use(const Received& received, Round round);
  };
  struct Listener {
    std::vector<Incoming> incoming;  // by sender, as the mailbox lists them
    std::vector<double> y;           // the newest measurement, of round y_of - 1
    Round y_of = 0;                  // 0: none yet
    Round last_ended = 0;            // plus one
    std::vector<Neighbour> heard;
    std::vector<Received> inbox;
    bool acted = false;  // it has absorbed, so it has a control
  };

  void deliver(std::uint32_t member, AgentId from, Round round, std::span<const double> message);
  void use_late(Member& member, Incoming& incoming, AgentId from, Round round, std::span<const double> message) const;
  [[nodiscard]] static std::size_t slot_of(const Member& member, AgentId from);
  void catch_up(std::size_t member, Round k);
  static void count_round(const Member& member, Listener& listener, Round k);
  [[nodiscard]] Inbox with_held(const Member& member, Listener& listener, Round k, Inbox fresh) const;

  Round rounds_, lifespan_;
  Act act_;
  Hosted hosted_;
  std::vector<Listener> listeners_;  // by member
  std::vector<double> controls_;     // of the round that ends, member after member
  std::uint64_t missed_inputs_ = 0;
};

}  // namespace consort
