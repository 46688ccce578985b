#pragma once
/// Makes the agents of one run as every driver does: protocol, parameters, initial values, and what the plant lets them know.

#include "core/experiment.hpp"
#include "core/trace.hpp"
#include "models/physics.hpp"
#include "protocols/registry.hpp"

#include <memory>
#include <optional>

namespace consort {

class AgentMaker {
 public:
  /// Throws ConfigError where the plant refuses its values.
  AgentMaker(const Experiment& experiment, const ProtocolChoice& choice, Seed run_seed)
      : AgentMaker(experiment, find_protocol(choice.name), choice, run_seed) {}
  /// Of a protocol that need not be in the table; `entry` outlives this.
  AgentMaker(const Experiment& experiment, const ProtocolEntry& entry, const ProtocolChoice& choice, Seed run_seed);
  /// Throws ConfigError where the protocol refuses its values, or does not fit the plant.
  [[nodiscard]] std::unique_ptr<Protocol> make(AgentId agent) const;
  /// The trace of such a run before its first report: layouts, sizes, what the estimate is of. `first`: the protocol of agent 1.
  [[nodiscard]] Trace empty_trace(const Protocol& first) const;
  [[nodiscard]] Trace empty_trace() const { return empty_trace(*make(agent_at(0))); }
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

}  // namespace consort
