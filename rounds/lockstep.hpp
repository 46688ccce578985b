#pragma once
/// Rounds in lockstep with the in-neighbours: a member goes on when leave to, its measurement and every message of its round are here. The
/// same rounds as simulate(), in whatever order things come, and if they do not come: what is lacking is asked for.

#include "rounds/flow.hpp"
#include "rounds/rounds.hpp"

#include <deque>
#include <map>

namespace consort {

class Lockstep final : public Rounds {
 public:
  /// See rounds_of().
  Lockstep(const Assignment& run, std::span<const MemberTask> tasks, Send send, Act act = {}, Tell tell = {});

  /// A grant that came before, or an older one, changes nothing.
  void grant(const Grant& grant) override;
  bool receive(const Information& message) override;
  void receive(const Measurement& measurement) override;
  void depart(std::span<const AgentId> agents) override;
  void come_back(std::span<const AgentId> agents, Round round) override;
  void advance() override;
  void begin_round(Round) override {}
  void end_round(Round) override {}
  [[nodiscard]] bool report_due() const override { return report_due_; }
  [[nodiscard]] bool whole_report_due() const override { return report_due_ && whole_; }
  std::vector<MemberReport> collect_reports() override;
  [[nodiscard]] std::vector<NetworkTotals> network() const override { return {}; }
  [[nodiscard]] std::uint64_t missed_inputs() const override { return 0; }
  [[nodiscard]] Hosted& hosted() override { return hosted_; }
  void answer(const Standing& standing) override;
  bool ask() override;
  [[nodiscard]] std::uint64_t finished() const override { return finished_; }
  [[nodiscard]] std::uint64_t heard() const override { return heard_; }
  [[nodiscard]] std::uint64_t came_twice() const override { return came_twice_; }
  [[nodiscard]] std::uint64_t sent_again_bytes() const override { return sent_again_bytes_; }

 private:
  // What the plant let the members measure in one round.
  struct Measured {
    Round round;
    std::vector<double> values;
  };

  // What has been asked for, by who lacks it and who has sent it.
  struct Asked {
    Round round = 0;
    std::uint32_t times = 0;
  };

  void deliver(std::uint32_t member, AgentId from, Round round, std::span<const double> message);
  [[nodiscard]] const Measured* measured(Round k) const;
  [[nodiscard]] bool needs_measurement(std::size_t member) const;
  [[nodiscard]] bool find_measurement(std::size_t member);
  [[nodiscard]] bool may_begin(std::uint32_t member);
  void begin(std::size_t member);
  void finish(std::size_t member);
  void steer(std::size_t member, Round k);
  [[nodiscard]] Round report_point(const Member& member) const;
  void go_on_blocked();
  void say_round(std::size_t member);
  void note_twice(std::size_t member, AgentId from, Round round);
  void ask_for(std::size_t member, AgentId from);
  void ask_for_measurement(std::size_t member);
  void act_again(const Standing::Gap& gap);
  bool tell();

  Send send_;
  Act act_;
  Tell tell_;
  Hosted hosted_;
  Flow flow_;
  Round pace_, ahead_;                      // so often somebody to whom nothing comes back is told
  std::vector<std::size_t> missing_;        // by member: messages of its round still to come, once that has begun
  std::vector<std::span<const double>> y_;  // by member: of its round
  std::vector<std::uint32_t> ready_;        // members that may be able to go on
  std::deque<Measured> measured_;           // ascending; from the slowest member's round on
  std::vector<double> controls_;            // of the round that is being finished, member after member
  std::size_t steered_ = 0;                 // members whose controls are there
  Round report_at_ = 0;
  std::size_t reached_report_ = 0;  // members at or beyond their report point
  bool report_due_ = false, whole_ = false;
  std::vector<std::uint32_t> blocked_;                      // members that are too far ahead of a listener, as far as is known
  std::vector<Round> told_;                                 // by member: the round it has told last
  Round told_plant_ = 0;                                    // the slowest member's round, told last
  Standing standing_;                                       // being put together
  std::map<std::pair<std::size_t, AgentId>, Asked> asked_;  // by member and sender; 0: the plant
  SentWindow acted_;                                        // the newest controls
  std::uint64_t finished_ = 0, heard_ = 0, came_twice_ = 0, sent_again_bytes_ = 0;
};

}  // namespace consort
