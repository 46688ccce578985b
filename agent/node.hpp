#pragma once
/// The agent process on DDS: meets the orchestrator and its neighbours, then drives the rounds of the agents it hosts. The step runs where
/// the last missing message arrives (DDS's receive thread); the main thread sends telemetry and answers commands, off the critical path.

#include "core/errors.hpp"
#include "process/pacer.hpp"
#include "process/run_member.hpp"
#include "rounds/rounds.hpp"

#include <map>
#include <optional>
#include <set>

namespace consort {

struct NodeOptions {
  std::vector<AgentId> agents;    ///< hosted here, ascending
  std::uint32_t first_epoch = 0;  ///< in that run, it takes part
  Round first_round = 0;          ///< from this round on, not in an earlier stay
  Meeting meeting;                ///< how it comes into the run
  bool lossy = false;             ///< packets may be lost on the way
};

class Node final : public RunMember {
 public:
  Node(const wire::Participant& participant, NodeOptions options);
  ~Node() override;

  void run() override;

 private:
  // Called on DDS's receive threads.
  void on_assignment(Assignment&& part);
  void on_grant(Grant&& grant);
  void on_information(wire::InformationReader::Burst& burst);
  void on_greeting(AgentId sender);
  void on_measurement(const Measurement& measurement);
  void on_announcement(Layouts&& layouts);
  void depart(std::span<const AgentId> agents) override;
  void come_back(std::span<const AgentId> agents, Round round) override;

  // Called on the main thread.
  void say_hello(Lock& lock) override { announce(lock, wire::State::hello); }
  void tell(const std::string& line) const override;
  void serve(Lock& lock);
  void begin_run(Lock& lock);
  void meet_neighbours(Lock& lock);
  void meet_plant(Lock& lock);
  void meet_announcers(Lock& lock);
  void pass_on(Lock& lock);
  void send_reports(Lock& lock, bool last);
  void take_leave(Lock& lock);
  void announce(Lock& lock, wire::State state, const std::string& note = {});
  void take(const Grant& grant);
  void start_clock(const Grant& grant);
  void beat(std::size_t phase, Round k);
  [[nodiscard]] Performance performance() const;
  [[nodiscard]] wire::ReaderEvents reader_events() const;
  void greet();
  [[nodiscard]] bool may_greet() const;
  [[nodiscard]] bool greeting_needed() const;
  [[nodiscard]] Round met_until() const;
  [[nodiscard]] std::string unmet() const;

  NodeOptions options_;
  std::string host_;

  // Guarded by the lock, as all that follows.
  std::map<std::uint32_t, Assignment> parts_;  // of the newest epoch, by part
  std::uint32_t newest_epoch_ = 0;
  std::vector<MemberTask> members_;
  std::optional<Grant> granted_early_;  // of a run that has not begun here
  std::unique_ptr<Rounds> rounds_;
  std::optional<Delivery> delivery_;  // in real time
  bool assigned_ = false;             // a complete assignment waits
  Round ready_until_ = 0;             // what the newest `ready` of this epoch said; 0: none yet

  std::map<AgentId, std::size_t> readers_of_;  // reader processes matched so far, by hosted agent that is heard elsewhere
  std::vector<AgentId> heard_remotely_;        // remote agents whose Information is subscribed, ascending
  std::set<AgentId> greeted_by_;               // those of them whose greeting has come: the connection works
  std::set<AgentId> gone_;                     // nobody waits to meet them
  bool greeted_ = false;                       // everybody who reads us now has been greeted
  bool plant_found_ = false;                   // it reads our actuation
  bool plant_greeted_us_ = false;
  std::map<AgentId, Layouts> announced_;  // of the newest epoch heard of
  std::vector<AgentId> to_pass_on_;       // those of them that our readers have not been told

  wire::Writer<wire::Presence> presence_;
  wire::Writer<Layouts> layouts_;
  wire::Writer<wire::Telemetry> telemetry_;
  std::map<AgentId, wire::InformationWriter> information_;
  std::vector<wire::InformationWriter*> outlet_;  // by member; null where nobody elsewhere may hear it
  std::vector<wire::InformationReader> information_readers_;
  std::optional<wire::AnnouncementWriter> announcements_;
  std::vector<wire::AnnouncementReader> announcement_readers_;
  std::optional<wire::MeasurementReader> measurements_;
  std::optional<wire::ActuationWriter> actuations_;
  wire::Reader<Assignment> assignments_;
  wire::Reader<Grant> grants_;
  wire::Reader<wire::Command> commands_;
  wire::ReaderEvents events_before_;  // before the clock started: nothing was due then
  std::optional<Pacer> pacer_;        // destroyed first, and never under the lock: it calls back
};

}  // namespace consort
