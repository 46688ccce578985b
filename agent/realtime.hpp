#pragma once
/// The same rounds, paced by a clock instead of by the neighbours' messages: what has not come when the round ends is missing, and nobody
/// is waited for. Knows no transport, and no clock either: its owner says when a round begins and ends.

#include "agent/lockstep.hpp"

namespace consort {

class Realtime : public Lockstep {
 public:
  /// As Lockstep. A message may be used for run.delivery.lifespan: in its own round, or in the next one after it has come, and then as
  /// long as there is no newer one.
  Realtime(const Assignment& run, std::span<const MemberTask> members, Send send, Act act = {});

  /// The grant's segments are all that hold from now on.
  void grant(const Grant& grant) override;
  using Lockstep::receive;
  void receive(const Measurement& measurement) override;
  void advance() override {}  // the clock does

  /// Every member that takes part in round k emits. Who is behind skips the rounds before k: its state stands still over them.
  void begin_round(Round k);
  /// Every member that takes part in round k absorbs what is here.
  void end_round(Round k);

  [[nodiscard]] std::vector<NetworkTotals> network() const;
  /// Rounds in which a member's measurement had not come: the one before was used.
  [[nodiscard]] std::uint64_t missed_inputs() const { return missed_inputs_; }

 private:
  /// What a member knows of one sender's messages.
  struct Incoming {
    NetworkCounters counters;
    Round newest = 0;             // the latest round received, plus one
    std::uint64_t missing = 0;    // bit b: the message of round last_ended - b was expected and has not come
    std::uint64_t came = 0;       // bit b: it came in time
    std::vector<double> payload;  // of the message used last, and
    Received used;                // what was said of it
    Round used_in = 0;            // plus one: the round it was due in; 0: none yet
    double weight = 1.0;          // of the edge, when it was there last
  };
  struct Extra {
    std::vector<Incoming> incoming;  // by sender, as the mailbox lists them
    std::vector<double> y;           // the newest measurement, of round y_of - 1
    Round y_of = 0;                  // 0: none yet
    Round last_ended = 0;            // plus one
    std::vector<Neighbour> heard;
    std::vector<Received> inbox;
    bool acted = false;  // it has absorbed, so it has a control
  };

  void deliver(Member& member, std::uint32_t index, AgentId from, Round round, std::span<const double> payload) override;
  void keep_late(Member& member, Incoming& incoming, AgentId from, Round round, std::span<const double> payload) const;
  [[nodiscard]] static std::size_t slot_of(const Member& member, AgentId from);
  void catch_up(std::size_t index, Round k);
  void note_round(Member& member, Extra& extra, Round k) const;
  [[nodiscard]] Inbox with_held(Member& member, Extra& extra, Round k, Inbox fresh) const;
  [[nodiscard]] bool measured(std::size_t index) const;

  Round lifespan_;
  std::vector<Extra> extra_;  // by member
  std::uint64_t missed_inputs_ = 0;
};

}  // namespace consort
