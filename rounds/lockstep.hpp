#pragma once
/// Rounds in lockstep with the in-neighbours: a member goes on when leave to, its measurement and every message of its round are here. The
/// same rounds as simulate(), in whatever order things come.

#include "rounds/rounds.hpp"

#include <deque>

namespace consort {

class Lockstep final : public Rounds {
 public:
  /// See rounds_of().
  Lockstep(const Assignment& run, std::span<const MemberTask> tasks, Send send, Act act = {});

  /// A grant that came before, or an older one, changes nothing.
  void grant(const Grant& grant) override;
  bool receive(const Information& message) override;
  void receive(const Measurement& measurement) override;
  void depart(std::span<const AgentId> agents) override;
  void advance() override;
  void begin_round(Round) override {}
  void end_round(Round) override {}
  [[nodiscard]] bool report_due() const override { return report_due_; }
  [[nodiscard]] bool whole_report_due() const override { return report_due_ && whole_; }
  std::vector<MemberReport> collect_reports() override;
  [[nodiscard]] std::vector<NetworkTotals> network() const override { return {}; }
  [[nodiscard]] std::uint64_t missed_inputs() const override { return 0; }
  [[nodiscard]] Hosted& hosted() override { return hosted_; }

 private:
  // What the plant let the members measure in one round.
  struct Measured {
    Round round;
    std::vector<double> values;
  };

  void deliver(std::uint32_t member, AgentId from, Round round, std::span<const double> message);
  [[nodiscard]] bool find_measurement(std::size_t member);
  void begin(std::size_t member);
  void finish(std::size_t member);
  void steer(std::size_t member, Round k);
  [[nodiscard]] Round report_point(const Member& member) const;

  Act act_;
  Hosted hosted_;
  std::vector<std::size_t> missing_;        // by member: messages of its round still to come, once that has begun
  std::vector<std::span<const double>> y_;  // by member: of its round
  std::vector<std::uint32_t> ready_;        // members that may be able to go on
  std::deque<Measured> measured_;           // ascending; from the slowest member's round on
  std::vector<double> controls_;            // of the round that is being finished, member after member
  std::size_t steered_ = 0;                 // members whose controls are there
  Round report_at_ = 0;
  std::size_t reached_report_ = 0;  // members at or beyond their report point
  bool report_due_ = false, whole_ = false;
};

}  // namespace consort
