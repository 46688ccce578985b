#pragma once
/// The orchestrator's end of the wire towards some of its processes. Reliable topics cost every participant a packet per matched process at
/// each heartbeat, so one participant that serves a thousand processes drowns in its own discovery; many that serve twenty each do not.

#include "idl/wire.hpp"

#include <dds/dds.hpp>

#include <functional>
#include <string>
#include <vector>

namespace consort {

class Hub {
 public:
  /// Called on DDS's receive threads.
  struct Callbacks {
    std::function<void(wire::Presence&&)> on_presence;
    std::function<void(Layouts&&)> on_layouts;
    std::function<void(wire::Telemetry&&)> on_telemetry;
    std::function<void(const std::string& sender, bool alive)> on_liveliness;  ///< of processes that nobody here has started
  };
  /// `domain` is the number within this process. Throws dds::core::Exception.
  Hub(unsigned domain, const std::string& configuration, const wire::RunKey& key, const Callbacks& callbacks)
      : domain_(domain, configuration),
        participant_(domain_, {"consort", wire::Build::own()}, key),
        assignments(participant_),
        plant_assignments(participant_),
        grants(participant_),
        commands(participant_),
        presence_(participant_, callbacks.on_presence, callbacks.on_liveliness),
        layouts_(participant_, callbacks.on_layouts),
        telemetry_(participant_, callbacks.on_telemetry) {}

  /// What this end would not take, since the last call.
  std::vector<Refusal> take_refusals() { return participant_.take_refusals(); }

 private:
  dds::domain::Domain domain_;
  wire::Participant participant_;

 public:
  wire::Writer<Assignment> assignments;
  wire::Writer<PlantAssignment> plant_assignments;
  wire::Writer<Grant> grants;
  wire::Writer<wire::Command> commands;

 private:
  wire::PresenceReader presence_;
  wire::Reader<Layouts> layouts_;
  wire::Reader<wire::Telemetry> telemetry_;
};

}  // namespace consort
