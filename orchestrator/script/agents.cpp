#include "orchestrator/script/agents.hpp"

#include "core/counted.hpp"
#include "orchestrator/script/numbers.hpp"
#include "orchestrator/script/wording.hpp"
#include "protocols/registry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace consort::script {

namespace {

std::vector<std::string> protocol_names() {
  std::vector<std::string> names;
  for (const auto& entry : protocol_table()) names.emplace_back(entry.name);
  return names;
}

const ProtocolEntry* entry_of(std::string_view name) {
  const auto table = protocol_table();
  const auto it = std::find_if(table.begin(), table.end(), [name](const ProtocolEntry& entry) { return entry.name == name; });
  return it == table.end() ? nullptr : &*it;
}

// Names that at least one of the protocols knows, in the order of their tables.
std::vector<std::string> known_names(const std::vector<ProtocolChoice>& protocols, std::span<const ValueDoc> ProtocolEntry::*docs) {
  std::vector<std::string> names;
  for (const auto& choice : protocols)
    for (const auto& doc : entry_of(choice.name)->*docs)
      if (std::find(names.begin(), names.end(), doc.name) == names.end()) names.emplace_back(doc.name);
  return names;
}

// Parameters that every protocol knows: an exception for one agent holds in each of them.
std::vector<std::string> common_parameters(const std::vector<ProtocolChoice>& protocols) {
  auto names = known_names(protocols, &ProtocolEntry::parameters);
  std::erase_if(names, [&protocols](const std::string& name) {
    return !std::all_of(protocols.begin(), protocols.end(), [&name](const ProtocolChoice& choice) {
      const auto docs = entry_of(choice.name)->parameters;
      return std::any_of(docs.begin(), docs.end(), [&name](const ValueDoc& doc) { return doc.name == name; });
    });
  });
  return names;
}

std::optional<ProtocolChoice> read_protocol(Mistakes& mistakes, const YAML::Node& node, const std::string& what, Places& places) {
  const YAML::Node name_node = node.IsMap() ? std::as_const(node)["name"] : node;
  if (!name_node.IsDefined() || !name_node.IsScalar()) {
    mistakes.add(node, fmt::format("{}: found {}; allowed: a name or {{name: ..., parameters}}, with one of the names {}", what,
                                   node.IsMap() ? "a mapping without a name" : describe(node), listed(protocol_names())));
    return std::nullopt;
  }
  const auto names = protocol_names();
  const auto index = read_choice(mistakes, name_node, what, names);
  if (!index) return std::nullopt;
  ProtocolChoice choice{names[*index], {}};
  places.emplace(choice.name, node.Mark());
  if (!node.IsMap()) return choice;
  std::vector<std::string> allowed{"name"};
  for (const auto& doc : entry_of(choice.name)->parameters) allowed.emplace_back(doc.name);
  for (const auto& entry : node) {
    if (!known(mistakes, entry.first, what + " " + choice.name, allowed) || entry.first.Scalar() == "name") continue;
    const std::string name = entry.first.Scalar();
    places.emplace(choice.name + " " + name, entry.second.Mark());
    const auto value = read_value(mistakes, doc_of(entry_of(choice.name)->parameters, name), entry.second, what + "." + name);
    if (value) choice.parameters.set(name, *value);
  }
  return choice;
}

void read_protocols(Mistakes& mistakes, const Section& section, Experiment& experiment, Places& places) {
  const auto one = section.find("protocol"), several = section.find("protocols");
  if (present(one) == present(several)) {
    mistakes.add(section.node(), fmt::format("agents: found {}; allowed: exactly one of 'protocol' and 'protocols'",
                                             present(one) ? "both 'protocol' and 'protocols'" : "neither 'protocol' nor 'protocols'"));
    return;
  }
  if (present(one)) {
    if (auto choice = read_protocol(mistakes, one, "agents.protocol", places)) experiment.protocols.push_back(std::move(*choice));
    return;
  }
  if (!several.IsSequence() || several.size() == 0) {
    mistakes.add(several, fmt::format("agents.protocols: found {}; allowed: a list of protocols", describe(several)));
    return;
  }
  for (std::size_t i = 0; i < several.size(); ++i) {
    auto choice = read_protocol(mistakes, several[i], fmt::format("agents.protocols[{}]", i), places);
    if (!choice) continue;
    const bool twice = std::any_of(experiment.protocols.begin(), experiment.protocols.end(),
                                   [&](const auto& other) { return other.name == choice->name; });
    if (twice)
      mistakes.add(several[i],
                   fmt::format("agents.protocols[{}]: found '{}' a second time; allowed: each protocol once, since metrics carry its name",
                               i, choice->name));
    experiment.protocols.push_back(std::move(*choice));
  }
}

void read_initial(Mistakes& mistakes, const YAML::Node& node, const std::filesystem::path& directory, Experiment& experiment,
                  Places& places) {
  const auto names = known_names(experiment.protocols, &ProtocolEntry::initial);
  if (!node.IsMap()) {
    mistakes.add(node, fmt::format("agents.initial: found {}; allowed: a mapping with the names {}", describe(node), listed(names)));
    return;
  }
  for (const auto& entry : node) {
    if (!known(mistakes, entry.first, "agents.initial", names)) continue;
    const std::string name = entry.first.Scalar();
    places.emplace("initial " + name, entry.second.Mark());
    auto values = read_per_agent(mistakes, entry.second, "agents.initial." + name, directory, experiment.agents);
    if (values) experiment.initial.push_back({name, std::move(*values)});
  }
}

void read_override(Mistakes& mistakes, AgentId agent, const YAML::Node& node, const std::string& what, Experiment& experiment,
                   Places& places) {
  const Section section(mistakes, node, what, "/definitions/override");
  AgentOverride& out = experiment.overrides[agent];
  const auto read = [&](const std::string& key, const std::vector<std::string>& names, Values& values) {
    const YAML::Node part = section.find(key);
    if (!present(part)) return;
    if (!part.IsMap()) {
      mistakes.add(part,
                   fmt::format("{}: found {}; allowed: a mapping with the names {}", section.path(key), describe(part), listed(names)));
      return;
    }
    for (const auto& entry : part) {
      if (!known(mistakes, entry.first, section.path(key), names)) continue;
      const std::string name = entry.first.Scalar();
      places.emplace(fmt::format("override {} {}", agent.value, name), entry.second.Mark());
      const std::string place = section.path(key) + "." + name;
      const auto value = key == "parameters" ? read_value(mistakes, doc_of(entry_of(experiment.protocols.front().name)->parameters, name),
                                                          entry.second, place)
                                             : read_matrix(mistakes, entry.second, place);
      if (value) values.set(name, *value);
    }
  };
  read("initial", known_names(experiment.protocols, &ProtocolEntry::initial), out.initial);
  read("parameters", common_parameters(experiment.protocols), out.parameters);
}

void read_overrides(Mistakes& mistakes, const YAML::Node& node, Experiment& experiment, Places& places) {
  if (!node.IsMap()) {
    mistakes.add(
        node, fmt::format(
                  "agents.overrides: found {}; allowed: a mapping from agent number to what differs, such as {{3: {{initial: {{x: 1}}}}}}",
                  describe(node)));
    return;
  }
  for (const auto& entry : node) {
    const auto id = whole_number(entry.first);
    if (!id || *id < 1 || *id > experiment.agents) {
      mistakes.add(entry.first,
                   fmt::format("agents.overrides: found {}; allowed: an agent from 1 to {}", describe(entry.first), experiment.agents));
      continue;
    }
    read_override(mistakes, AgentId{static_cast<std::uint32_t>(*id)}, entry.second, fmt::format("agents.overrides.{}", *id), experiment,
                  places);
  }
}

}  // namespace

void read_agents(Mistakes& mistakes, const YAML::Node& node, const std::filesystem::path& directory, Experiment& experiment,
                 Places& places) {
  const Section section(mistakes, node, "agents", "/definitions/agents");
  if (!section.is_map()) return;
  const auto count_node = section.required("count");
  const auto count = present(count_node) ? read_whole(mistakes, count_node, "agents.count", 1, kMostAgents) : std::nullopt;
  experiment.agents = count.value_or(0);
  read_protocols(mistakes, section, experiment, places);
  if (!count || experiment.protocols.empty()) return;  // what follows is judged by them
  if (const auto initial = section.find("initial"); present(initial)) read_initial(mistakes, initial, directory, experiment, places);
  if (const auto overrides = section.find("overrides"); present(overrides)) read_overrides(mistakes, overrides, experiment, places);
}

}  // namespace consort::script
