#pragma once
/// The plant part of the experiment file: model, initial state, sensing, disturbances.

#include "core/experiment.hpp"
#include "orchestrator/script/agents.hpp"

namespace consort::script {

/// Fills experiment.plant. The number of agents and dt must be known. Data files are found from `directory`.
void read_plant(Mistakes&, const YAML::Node&, const std::filesystem::path& directory, Experiment& experiment, Places& places);

/// A `degrade` event: from round `first` on, the measurements of the agents it names are disturbed too.
void read_degradation(Mistakes&, const YAML::Node&, const std::string& what, Round first, const std::filesystem::path& directory,
                      Experiment& experiment, Places& places);

/// Makes the plant once; what model or disturbances refuse becomes a mistake at the value's place.
void try_plant(Mistakes&, const YAML::Mark& plant_mark, const Experiment& experiment, const Places& places);

}  // namespace consort::script
