#pragma once
/// Who measures whom, and whose part acts on whose: the parts of the plant's section that are about pairs of agents.

#include "models/registry.hpp"
#include "orchestrator/script/numbers.hpp"

namespace consort::script {

/// An agent's number.
std::optional<AgentId> read_agent(Mistakes&, const YAML::Node&, const std::string& what, std::size_t agents);
/// A list of agents; ascending, each once.
std::vector<AgentId> read_agents(Mistakes&, const YAML::Node&, const std::string& what, std::size_t agents);

/// `plant.sensing`: own, neighbours, or {relative: {1: [2]}, absolute: [2]}.
void read_sensing(Mistakes&, const YAML::Node&, std::size_t agents, PlantSpec& plant);
/// `plant.couplings`: [{edge: 1 -> 2, A: ..., C: ...}] with the names the model documents.
void read_couplings(Mistakes&, const YAML::Node&, std::size_t agents, const PlantEntry& model, PlantSpec& plant);

}  // namespace consort::script
