#pragma once
/// How a run is carried out: placement, transport, stop rule, telemetry, record, discovery.

#include "core/experiment.hpp"
#include "orchestrator/script/script.hpp"
#include "orchestrator/script/yaml.hpp"

namespace consort::script {

/// The sections at the `top` of the file that say so. Agents and protocols must be known.
void read_settings(Mistakes&, const Section& top, const ScriptOverrides& overrides, Experiment& experiment);

/// `rounds`, a time over dt, if it is from `least` to the most rounds a run may have.
std::optional<Round> whole_rounds(Mistakes&, const YAML::Node&, const std::string& what, double rounds, Round least, Seconds dt);

}  // namespace consort::script
