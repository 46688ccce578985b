#pragma once
/// What disturbs a plant, as the experiment file has it: the plant's list, and events that make measurements worse.

#include "core/experiment.hpp"
#include "orchestrator/script/agents.hpp"

#include <vector>

namespace consort::script {

/// `disturbances: [...]` of a plant, appended to `all`. The number of agents and dt must be known. Data files are found from `directory`.
void read_disturbances(Mistakes&, const YAML::Node&, const std::filesystem::path& directory, const Experiment&, Places&,
                       std::vector<Disturbance>& all);

/// A `degrade` event: from round `first` on, the measurements of the agents it names are disturbed too.
void read_degradation(Mistakes&, const YAML::Node&, const std::string& what, Round first, const std::filesystem::path& directory,
                      Experiment& experiment, Places& places);

}  // namespace consort::script
