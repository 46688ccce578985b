#pragma once
/// The plant process on DDS: drives the rounds of the physics. The step runs where the last actuation arrives (DDS's receive thread); the
/// main thread sends telemetry and answers commands.

#include "plant/rounds.hpp"
#include "process/meeting.hpp"
#include "process/run_member.hpp"

#include <map>
#include <memory>
#include <optional>

namespace consort {

class PlantNode final : public RunMember {
 public:
  PlantNode(const wire::Participant& participant, const Arrival& arrival);

 private:
  // Called on DDS's receive threads.
  void on_assignment(PlantAssignment&& part);
  void on_actuation(const Actuation& actuation);
  void on_standing(const Standing& standing);
  void grant(const Grant& grant) override;
  void beat(std::size_t phase, Round k) override;
  void depart(std::span<const AgentId> agents) override;
  void come_back(std::span<const AgentId> agents, Round round) override;

  // Called on the main thread.
  void begin_run(Lock& lock) override;
  void open_loop(Lock& lock);
  [[nodiscard]] bool report_due() const override { return rounds_ && rounds_->report_due(); }
  bool fill(wire::Telemetry& telemetry) override;
  std::vector<MemberReport> held_reports() override { return rounds_->collect_reports(true); }
  [[nodiscard]] Round met_until() const override { return rounds_ ? meeting_.met_until(next(), rounds_->round()) : 0; }
  [[nodiscard]] std::string unmet() const override;
  [[nodiscard]] bool may_greet() const override { return rounds_ != nullptr; }
  [[nodiscard]] bool greeting_needed() const override { return rounds_ && meeting_.greeting_needed(next(), granted_until_); }
  void greet() override;
  bool ask() override { return rounds_ && rounds_->ask(); }
  [[nodiscard]] std::uint64_t heard() const override { return rounds_ ? rounds_->heard() + rounds_->round() : 0; }
  [[nodiscard]] std::uint64_t came_twice() const override { return rounds_ ? rounds_->came_twice() : 0; }
  void describe(wire::Presence& presence) const override;
  [[nodiscard]] wire::ReaderEvents reader_events() const override;
  [[nodiscard]] std::uint64_t sent_again_bytes() const override;
  [[nodiscard]] std::uint64_t missed_inputs() const override { return rounds_->missed_inputs(); }

  [[nodiscard]] PlantMeeting::Next next() const {
    return [this](std::uint32_t process) { return rounds_->next(process); };
  }
  void run_rounds();

  // Guarded by the lock, as all that follows.
  std::map<std::uint32_t, PlantAssignment> parts_;  // of the newest epoch, by part
  std::unique_ptr<PlantRounds> rounds_;
  PlantMeeting meeting_;
  Seconds dt_ = 1.0;
  Round last_round_ = 0;
  Round granted_until_ = 0;

  std::map<std::uint32_t, wire::MeasurementWriter> measurements_;
  std::optional<wire::ActuationReader> actuations_;
  std::optional<wire::StandingWriter> standings_;
  std::optional<wire::StandingReader> standing_reader_;
  wire::Reader<PlantAssignment> assignments_;
};

}  // namespace consort
