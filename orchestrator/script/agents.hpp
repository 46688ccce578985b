#pragma once
/// The agents part of the experiment file: protocols, initial values, exceptions.

#include "core/experiment.hpp"
#include "orchestrator/script/yaml.hpp"

#include <filesystem>
#include <map>

namespace consort::script {

inline constexpr std::uint64_t kMostAgents = 100'000;

/// Where a value stands in the file: "initial P", "override 10 initial P", "parameter Q" -> place.
using Places = std::map<std::string, YAML::Mark>;

/// Fills count, protocols, initial and overrides of `experiment`. Data files are found from `directory`.
void read_agents(Mistakes&, const YAML::Node&, const std::filesystem::path& directory, Experiment& experiment, Places& places);

}  // namespace consort::script
