#pragma once
/// The plant part of the experiment file: model, initial state, sensing (disturbances.hpp: what disturbs it).

#include "core/experiment.hpp"
#include "orchestrator/script/agents.hpp"

namespace consort::script {

/// Fills experiment.plant. The number of agents and dt must be known. Data files are found from `directory`.
void read_plant(Mistakes&, const YAML::Node&, const std::filesystem::path& directory, Experiment& experiment, Places& places);

/// Makes the plant once; what model or disturbances refuse becomes a mistake at the value's place.
void try_plant(Mistakes&, const YAML::Mark& plant_mark, const Experiment& experiment, const Places& places);

}  // namespace consort::script
