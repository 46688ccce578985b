#pragma once
/// The plant process on DDS: meets the orchestrator and the agents' processes, then drives the rounds of the physics. The step runs where
/// the last actuation arrives (DDS's receive thread); the main thread sends telemetry and answers commands.

#include "plant/rounds.hpp"
#include "process/pacer.hpp"
#include "process/run_member.hpp"

#include <map>
#include <memory>
#include <optional>
#include <set>

namespace consort {

class PlantNode final : public RunMember {
 public:
  PlantNode(const wire::Participant& participant, const Meeting& meeting);

  void run() override;

 private:
  // Called on DDS's receive threads.
  void on_assignment(PlantAssignment&& part);
  void on_grant(Grant&& grant);
  void on_actuation(const Actuation& actuation);
  void depart(std::span<const AgentId> agents) override;
  void come_back(std::span<const AgentId> agents, Round round) override;

  // Called on the main thread.
  void say_hello(Lock& lock) override { announce(lock, wire::State::hello); }
  void tell(const std::string& line) const override;
  void serve(Lock& lock);
  void begin_run(Lock& lock);
  void meet_agents(Lock& lock, Round window);
  void beat(Round k);
  [[nodiscard]] Performance performance() const;
  void greet();
  void send_reports(Lock& lock, bool last);
  void announce(Lock& lock, wire::State state, const std::string& note = {});
  [[nodiscard]] Round met_until() const;
  [[nodiscard]] std::string unmet() const;
  [[nodiscard]] bool somebody_joins() const;

  // Guarded by the lock, as all that follows.
  std::map<std::uint32_t, PlantAssignment> parts_;  // of the newest epoch, by part
  std::uint32_t newest_epoch_ = 0;
  std::unique_ptr<PlantRounds> rounds_;
  bool steered_ = false;
  std::optional<Delivery> delivery_;  // in real time
  Seconds dt_ = 1.0;
  Round last_round_ = 0;
  bool assigned_ = false;  // a complete assignment waits
  Round ready_until_ = 0;  // what the newest `ready` of this epoch said; 0: none yet
  Round granted_until_ = 0;
  std::set<std::uint32_t> found_;       // processes that read their measurement
  std::set<std::uint32_t> greeted_by_;  // processes whose greeting has come: the connection works
  bool greeted_ = true;                 // everybody found so far has been greeted

  wire::Writer<wire::Presence> presence_;
  wire::Writer<wire::Telemetry> telemetry_;
  std::map<std::uint32_t, wire::MeasurementWriter> measurements_;
  std::optional<wire::ActuationReader> actuations_;
  wire::Reader<PlantAssignment> assignments_;
  wire::Reader<Grant> grants_;
  wire::Reader<wire::Command> commands_;
  wire::ReaderEvents events_before_;  // before the clock started: nothing was due then
  std::optional<Pacer> pacer_;        // destroyed first, and never under the lock: it calls back
};

}  // namespace consort
