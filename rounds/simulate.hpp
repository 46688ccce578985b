#pragma once
/// simulate(): the whole experiment in one thread and without a clock. The oracle of every other mode.

#include "core/experiment.hpp"
#include "core/trace.hpp"
#include "models/physics.hpp"
#include "protocols/registry.hpp"

#include <functional>
#include <memory>
#include <optional>

namespace consort {

/// Called for each reported round, in order; may be empty. Return false to end the run early (an interrupted user).
using ReportSink = std::function<bool(const RoundReport&)>;

/// Makes the agents of one run as every driver does: protocol, parameters, initial values, and what the plant lets them know.
class AgentMaker {
 public:
  /// Throws ConfigError where the plant refuses its values.
  AgentMaker(const Experiment& experiment, const ProtocolChoice& choice, Seed run_seed);
  /// Throws ConfigError where the protocol refuses its values, or does not fit the plant.
  [[nodiscard]] std::unique_ptr<Protocol> make(AgentId agent) const;
  /// Length of the longest u that the plant takes from an agent; 0 without a plant.
  [[nodiscard]] std::size_t largest_control() const { return largest_control_; }
  /// The plant at round 0; nothing without one.
  [[nodiscard]] const std::optional<Physics>& physics() const { return physics_; }

 private:
  const Experiment& experiment_;
  const ProtocolChoice& choice_;
  Seed seed_;
  const ProtocolEntry& entry_;
  std::optional<Physics> physics_;
  std::size_t largest_control_ = 0;
};

/// Runs one protocol of the experiment with one seed. Exactly the rounds of docs/architecture.md.
/// Throws ConfigError (a protocol refuses its values) or RunError (an estimate became non-finite: names agent, round, protocol).
Trace simulate(const Experiment& experiment, const ProtocolChoice& protocol, Seed run_seed, const ReportSink& sink = {});

}  // namespace consort
