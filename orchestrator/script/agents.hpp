#pragma once
/// The agents part of the experiment file: protocols, initial values, exceptions; and every agent made once, to hear its protocol's
/// objections early.

#include "core/experiment.hpp"
#include "orchestrator/script/yaml.hpp"

#include <filesystem>
#include <map>

namespace consort::script {

/// Where a value stands in the file: "initial P", "override 10 initial P", "parameter Q" -> place.
using Places = std::map<std::string, YAML::Mark>;

/// Fills count, protocols, initial and overrides of `experiment`. Data files are found from `directory`.
void read_agents(Mistakes&, const YAML::Node&, const std::filesystem::path& directory, Experiment& experiment, Places& places);

/// Makes every agent of every protocol and link once; what they refuse becomes a mistake at the value's place.
void try_agents(Mistakes&, const YAML::Mark& agents_mark, const YAML::Mark& links_mark, const Experiment& experiment, const Places& places);

/// The metric names this experiment will have.
std::vector<std::string> metric_names(const Experiment& experiment);

}  // namespace consort::script
