#pragma once
/// The table of protocols: one visible line each, in the table of its family (protocols/<family>/table.cpp).

#include "core/metrics/metrics.hpp"
#include "protocols/protocol.hpp"

#include <memory>
#include <optional>
#include <span>
#include <string_view>

namespace consort {

struct TheoryCase;
class Findings;

/// What a protocol knows of itself. Whoever asks "which protocol is this?" asks its entry.
struct ProtocolEntry {
  std::string_view name;
  std::string_view summary;      ///< one line
  std::string_view source;       ///< authors, year, equations
  std::string_view assumptions;  ///< what theory asks for, one line
  std::span<const ValueDoc> parameters;
  std::span<const ValueDoc> initial;
  std::span<const ValueDoc> estimate = {};  ///< what its estimate holds
  std::span<const ValueDoc> recorded = {};  ///< what else of its state is worth recording
  bool announces = false;                   ///< its agents tell everybody about themselves in their layout messages
  Truth truth = Truth::none;
  bool steers = false;       ///< its agents give the plant a control
  bool needs_plant = false;  ///< it measures or steers a plant, and an experiment without one is a mistake
  std::span<const MetricEntry> metrics =
      {};  ///< it offers these beyond those that are true of any run; of two with one name its own counts
  void (*examine)(const TheoryCase&, Findings&) = nullptr;  ///< what theory asks of an experiment; null: nothing
  /// They agree on the plant's states, which they steer, and not on estimates.
  [[nodiscard]] bool agrees_on_states() const { return steers && truth == Truth::none; }
  /// Throws ConfigError (naming parameter, what was found, what is allowed).
  std::unique_ptr<Protocol> (*make)(const Values& parameters, const Setup& setup);
};

// The families, each compiled apart.
std::span<const ProtocolEntry> consensus_protocols();
std::span<const ProtocolEntry> control_protocols();
std::span<const ProtocolEntry> adaptive_protocols();
std::span<const ProtocolEntry> filters_protocols();
std::span<const ProtocolEntry> everybody_protocols();
std::span<const ProtocolEntry> sensor_network_protocols();
/// All of them, family after family.
std::span<const ProtocolEntry> protocol_table();
/// Makes one agent's protocol. Throws ConfigError, also if the protocol needs a plant and `plant_controls` says that there is none, or if
/// u_i has another length than the plant takes (`plant_controls`).
std::unique_ptr<Protocol> make_protocol(const ProtocolEntry& entry, const Values& parameters, const Setup& setup,
                                        std::optional<std::size_t> plant_controls);
/// Throws ConfigError naming the nearest match.
const ProtocolEntry& find_protocol(std::string_view name);

}  // namespace consort
