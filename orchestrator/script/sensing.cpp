#include "orchestrator/script/sensing.hpp"

#include "orchestrator/script/edges.hpp"
#include "orchestrator/script/wording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

namespace consort::script {

std::optional<AgentId> read_agent(Mistakes& mistakes, const YAML::Node& node, const std::string& what, std::size_t agents) {
  const auto id = whole_number(node);
  if (id && *id >= 1 && *id <= agents) return AgentId{static_cast<std::uint32_t>(*id)};
  mistakes.add(node, fmt::format("{}: found {}; allowed: an agent from 1 to {}", what, describe(node), agents));
  return std::nullopt;
}

std::vector<AgentId> read_agents(Mistakes& mistakes, const YAML::Node& node, const std::string& what, std::size_t agents) {
  std::vector<AgentId> out;
  if (!node.IsSequence()) {
    mistakes.add(node, fmt::format("{}: found {}; allowed: a list of agents", what, describe(node)));
    return out;
  }
  for (std::size_t i = 0; i < node.size(); ++i)
    if (const auto agent = read_agent(mistakes, node[i], fmt::format("{}[{}]", what, i), agents)) out.push_back(*agent);
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

void read_sensing(Mistakes& mistakes, const YAML::Node& node, std::size_t agents, PlantSpec& plant) {
  static const std::array<std::string, 2> kSensing{"own", "neighbours"};
  if (!node.IsMap()) {
    if (const auto choice = read_choice(mistakes, node, "plant.sensing", kSensing))
      plant.sensing = *choice == 0 ? PlantSpec::Sensing::own : PlantSpec::Sensing::neighbours;
    return;
  }
  const Section section(mistakes, node, "plant.sensing", "/definitions/relative_sensing");
  plant.sensing = PlantSpec::Sensing::relative;
  if (const auto absolute = section.find("absolute"); present(absolute))
    plant.absolute = read_agents(mistakes, absolute, section.path("absolute"), agents);
  const YAML::Node relative = section.find("relative");
  if (!present(relative)) return;
  if (!relative.IsMap()) {
    mistakes.add(relative, fmt::format("{}: found {}; allowed: a mapping from an agent to those it measures, such as {{1: [2], 4: [3]}}",
                                       section.path("relative"), describe(relative)));
    return;
  }
  for (const auto& entry : relative) {
    const auto agent = read_agent(mistakes, entry.first, section.path("relative"), agents);
    if (!agent) continue;
    const std::string what = fmt::format("{}.{}", section.path("relative"), agent->value);
    auto measured = read_agents(mistakes, entry.second, what, agents);
    if (std::binary_search(measured.begin(), measured.end(), *agent))
      mistakes.add(entry.second, fmt::format("{}: found the agent itself; allowed: other agents", what));
    if (!measured.empty()) plant.relative[*agent] = std::move(measured);
  }
}

void read_couplings(Mistakes& mistakes, const YAML::Node& node, std::size_t agents, const PlantEntry& model, PlantSpec& plant) {
  if (model.couplings.empty()) {
    mistakes.add(node, fmt::format("plant.couplings: the parts of model {} do not act on each other; allowed: model linear", model.name));
    return;
  }
  if (!node.IsSequence()) {
    mistakes.add(node, fmt::format("plant.couplings: found {}; allowed: a list such as [{{edge: 1 -> 2, A: [[0.8, 1]]}}]", describe(node)));
    return;
  }
  std::vector<std::string> names{"edge"};
  for (const ValueDoc& doc : model.couplings) names.emplace_back(doc.name);
  std::set<Edge> seen;
  for (std::size_t i = 0; i < node.size(); ++i) {
    const std::string what = fmt::format("plant.couplings[{}]", i);
    if (!node[i].IsMap() || !node[i]["edge"].IsDefined()) {
      mistakes.add(node[i], fmt::format("{}: found {}; allowed: a mapping with the names {}", what, describe(node[i]), listed(names)));
      continue;
    }
    PlantSpec::Coupling coupling;
    const auto edges = read_edge(mistakes, node[i]["edge"], what + ".edge", agents);
    if (edges.size() > 1) mistakes.add(node[i]["edge"], fmt::format("{}.edge: found several edges; allowed: one, such as 1 -> 2", what));
    if (edges.size() != 1) continue;
    coupling.edge = edges.front();
    if (!seen.insert(coupling.edge).second)
      mistakes.add(node[i], fmt::format("{}: found the edge {} a second time; allowed: each edge once", what, edge_text(coupling.edge)));
    for (const auto& entry : node[i]) {
      if (!known(mistakes, entry.first, what, names) || entry.first.Scalar() == "edge") continue;
      const std::string name = entry.first.Scalar();
      if (const auto value = read_matrix(mistakes, entry.second, what + "." + name)) coupling.values.set(name, *value);
    }
    plant.couplings.push_back(std::move(coupling));
  }
}

}  // namespace consort::script
