#pragma once
/// The agent process on DDS: drives the rounds of the agents it hosts. The step runs where the last missing message arrives (DDS's receive
/// thread); the main thread sends telemetry and answers commands, off the critical path.

#include "process/meeting.hpp"
#include "process/run_member.hpp"
#include "rounds/rounds.hpp"

#include <map>
#include <memory>
#include <optional>

namespace consort {

struct NodeOptions {
  std::vector<AgentId> agents;    ///< hosted here, ascending
  std::uint32_t first_epoch = 0;  ///< in that run, it takes part
  Round first_round = 0;          ///< from this round on, not in an earlier stay
  Arrival arrival;                ///< how it comes into the run
  bool lossy = false;             ///< packets may be lost on the way
};

class Node final : public RunMember {
 public:
  Node(const wire::Participant& participant, NodeOptions options);
  ~Node() override;

 private:
  // Called on DDS's receive threads.
  void on_assignment(Assignment&& part);
  void on_information(wire::InformationReader::Burst& burst);
  void on_measurement(const Measurement& measurement);
  void on_standing(const Standing& standing);
  void on_announcement(Layouts&& layouts);
  void grant(const Grant& grant) override;
  void beat(std::size_t phase, Round k) override;
  void depart(std::span<const AgentId> agents) override;
  void come_back(std::span<const AgentId> agents, Round round) override;

  // Called on the main thread.
  void begin_run(Lock& lock) override;
  void collect_members();
  void open_information(Lock& lock, const std::vector<AgentId>& senders);
  void open_loop(Lock& lock);
  void open_standings(Lock& lock, const std::vector<AgentId>& senders);
  void open_announcements(Lock& lock);
  void write_layouts(Lock& lock);
  void pass_on(Lock& lock);
  void leave(Lock& lock);

  [[nodiscard]] bool report_due() const override { return rounds_ && rounds_->report_due(); }
  bool fill(wire::Telemetry& telemetry) override;
  std::vector<MemberReport> held_reports() override { return rounds_->hosted().collect_reports(true); }
  [[nodiscard]] Round met_until() const override { return meeting_.met_until(); }
  [[nodiscard]] std::string unmet() const override { return meeting_.unmet(); }
  [[nodiscard]] bool may_greet() const override { return meeting_.may_greet(); }
  [[nodiscard]] bool greeting_needed() const override;
  void greet() override;
  void describe(wire::Presence& presence) const override;
  bool ask() override { return rounds_ && rounds_->ask(); }
  [[nodiscard]] std::uint64_t heard() const override { return rounds_ ? rounds_->heard() + rounds_->finished() : 0; }
  [[nodiscard]] std::uint64_t came_twice() const override { return rounds_ ? rounds_->came_twice() : 0; }
  [[nodiscard]] bool more_to_do() const override { return !to_pass_on_.empty() || (over() && (!last_words_ || may_leave())); }
  bool do_more(Lock& lock) override;
  [[nodiscard]] wire::ReaderEvents reader_events() const override;
  [[nodiscard]] std::uint64_t sent_again_bytes() const override;
  [[nodiscard]] std::uint64_t missed_inputs() const override { return rounds_->missed_inputs(); }

  [[nodiscard]] bool may_leave() const { return delivery_ || everybody_reached(rounds_->hosted().last()); }
  [[nodiscard]] bool over() const { return rounds_ && epoch_ && current(*epoch_) && rounds_->hosted().over(); }
  [[nodiscard]] const Assignment& assignment() const { return parts_.begin()->second; }
  void run_rounds();
  void learn(const Layouts& layouts);
  /// These, heard for the first time, are all whom anybody here may ever hear, and nobody is left out.
  [[nodiscard]] bool hears_everybody(const std::vector<AgentId>& senders) const {
    return meeting_.heard() == senders && senders.size() + agents_.size() == assignment().agents;
  }

  const NodeOptions options_;

  // Guarded by the lock, as all that follows.
  std::map<std::uint32_t, Assignment> parts_;  // of the newest epoch, by part
  std::vector<MemberTask> members_;
  std::unique_ptr<Rounds> rounds_;
  AgentsMeeting meeting_;
  std::map<AgentId, Layouts> announced_;  // of the newest epoch heard of
  std::vector<AgentId> to_pass_on_;       // those of them that our readers have not been told
  bool last_words_ = false;               // all members have left, and that has been reported

  wire::Writer<Layouts> layouts_;
  std::map<AgentId, wire::InformationWriter> information_;
  std::vector<wire::InformationWriter*> outlet_;  // by member; null where nobody elsewhere may hear it
  std::vector<wire::InformationReader> information_readers_;
  std::optional<wire::AnnouncementWriter> announcements_;
  std::vector<wire::AnnouncementReader> announcement_readers_;
  std::optional<wire::MeasurementReader> measurements_;
  std::optional<wire::ActuationWriter> actuations_;
  std::vector<wire::StandingWriter> standings_;
  std::vector<wire::StandingReader> standing_readers_;
  bool asks_plant_ = false, answers_plant_ = false;
  wire::Reader<Assignment> assignments_;
};

}  // namespace consort
