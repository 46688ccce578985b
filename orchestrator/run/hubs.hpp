#pragma once
/// The orchestrator's end of the wire towards all its processes: how many hubs there are, in which domain and on which ports, and with what
/// options a process finds them.

#include "orchestrator/run/assignments.hpp"
#include "orchestrator/run/hub.hpp"
#include "orchestrator/run/placement.hpp"
#include "orchestrator/run/ports.hpp"
#include "orchestrator/run/run.hpp"
#include "orchestrator/run/wiring.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace consort {

class Hubs {
 public:
  /// `placement` says how processes find each other. Throws RunError where DDS cannot be had, ConfigError if another run of that name goes
  /// on.
  Hubs(const Experiment& experiment, const RunOptions& options, const Placement& placement, const Hub::Callbacks& callbacks);

  /// How processes find this run and each other.
  [[nodiscard]] const Wiring& wiring() const { return wiring_; }

  void broadcast(const Grant& grant) const;
  void broadcast(const wire::Command& command) const;
  void assign(const Assignments& assignments, Round now, const std::vector<AgentId>& gone) const;
  /// `process`: the plant's.
  void assign_plant(const Assignments& assignments, std::size_t process) const;
  /// Waits until the commands have arrived, but for no longer than a second each.
  void let_commands_arrive() const;

  /// What this end would not take, since the last call.
  [[nodiscard]] std::vector<Refusal> take_refusals() const;
  [[nodiscard]] unsigned domain() const { return wiring_.domain; }
  /// Other runs on this host use the same domain now.
  [[nodiscard]] bool share_domain() const { return shared_ && shared_->with_others(); }

 private:
  void open_multicast(const Hub::Callbacks& callbacks);
  void claim_own_ports();
  void open_neighbours(const Hub::Callbacks& callbacks);

  const RunOptions& options_;
  Wiring wiring_;
  std::optional<PortBlock> ports_;         // where the options bring none
  std::optional<DomainShare> shared_;      // else: with whom it shares those of the domain
  std::optional<SoleRun> sole_;            // else: others of its name are kept out
  dds::configuration::Settings settings_;  // common to the hubs
  std::vector<std::unique_ptr<Hub>> hubs_;
};

}  // namespace consort
