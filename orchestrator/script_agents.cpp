#include "orchestrator/script_agents.hpp"

#include "agent/registry.hpp"
#include "core/metrics.hpp"
#include "orchestrator/wording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <set>
#include <utility>

namespace consort::script {

namespace {

constexpr std::uint64_t kMostAgents = 100'000;
constexpr std::uint64_t kMostComponents = 10'000;

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

bool known(Mistakes& mistakes, const YAML::Node& key, const std::string& what, const std::vector<std::string>& names) {
  const std::string name = key.IsScalar() ? key.Scalar() : describe(key);
  if (std::find(names.begin(), names.end(), name) != names.end()) return true;
  mistakes.add(key, fmt::format("{}: found the unknown name '{}'; allowed: {}{}", what, name, listed(names), did_you_mean(name, names)));
  return false;
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
    if (const auto value = read_matrix(mistakes, entry.second, what + "." + name, true)) choice.parameters.set(name, *value);
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

// --- numbers for every agent ---------------------------------------------------------------------------------------------

// One line per agent, comma-separated.
std::optional<PerAgent> read_number_file(Mistakes& mistakes, const YAML::Node& node, const std::string& what,
                                         const std::filesystem::path& directory, std::size_t agents) {
  const auto name = read_text(mistakes, node, what);
  if (!name) return std::nullopt;
  const std::filesystem::path file = directory / *name;
  std::ifstream in(file);
  if (!in) {
    mistakes.add(node, fmt::format("{}: found '{}', which cannot be read; allowed: a file beside the experiment", what, *name));
    return std::nullopt;
  }
  const std::size_t before = mistakes.count();
  PerAgent::List list;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.find_first_not_of(" \t") == std::string::npos || line.front() == '#') continue;
    std::vector<double> row;
    for (std::size_t start = 0; start <= line.size();) {
      const std::size_t comma = std::min(line.find(',', start), line.size());
      const std::string text = line.substr(start, comma - start);
      const std::size_t first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
      const auto value = first == std::string::npos ? std::nullopt : plain_number(YAML::Node(text.substr(first, last - first + 1)));
      if (!value) mistakes.add(file.string(), number, start + 1, fmt::format("found '{}'; allowed: a finite number", text));
      row.push_back(value.value_or(0.0));
      start = comma + 1;
    }
    list.values.push_back(Eigen::Map<const Vector>(row.data(), static_cast<Eigen::Index>(row.size())));
  }
  if (mistakes.count() != before) return std::nullopt;
  if (list.values.size() != agents) {
    mistakes.add(node, fmt::format("{}: found {} lines in '{}'; allowed: {}, one per agent", what, list.values.size(), *name, agents));
    return std::nullopt;
  }
  return PerAgent{list};
}

std::optional<std::pair<double, double>> read_pair(Mistakes& mistakes, const YAML::Node& node, const std::string& what, bool ascending) {
  const auto low = node.IsSequence() && node.size() == 2 ? plain_number(node[0]) : std::nullopt;
  const auto high = low ? plain_number(node[1]) : std::nullopt;
  if (high && (!ascending || *low <= *high)) return std::pair(*low, *high);
  mistakes.add(node, fmt::format("{}: found {}; allowed: two numbers {}", what,
                                 high ? fmt::format("[{}, {}]", number_text(*low), number_text(*high)) : describe(node),
                                 ascending ? "[low, high] with low <= high" : "[first, last]"));
  return std::nullopt;
}

std::optional<PerAgent> read_rule(Mistakes& mistakes, const YAML::Node& node, const std::string& what,
                                  const std::filesystem::path& directory, std::size_t agents) {
  const Section section(mistakes, node, what, "/definitions/spread");
  std::vector<std::string> found;
  for (const char* key : {"all", "linspace", "uniform", "file"})
    if (present(section.find(key))) found.emplace_back(key);
  if (found.size() != 1) {
    mistakes.add(node, fmt::format("{}: found {}; allowed: exactly one of all, linspace, uniform, file", what, listed(found)));
    return std::nullopt;
  }
  std::size_t dimension = 1;
  if (const auto dimension_node = section.find("dimension"); present(dimension_node)) {
    if (found[0] == "all" || found[0] == "file")
      mistakes.add(dimension_node, fmt::format("{}: found a dimension with {}; allowed: with linspace or uniform", what, found[0]));
    dimension = read_whole(mistakes, dimension_node, section.path("dimension"), 1, kMostComponents).value_or(1);
  }
  const YAML::Node value = section.find(found[0]);
  const std::string place = section.path(found[0]);
  if (found[0] == "file") return read_number_file(mistakes, value, place, directory, agents);
  if (found[0] == "all") {
    const auto matrix = read_matrix(mistakes, value, place);
    return matrix ? std::optional(PerAgent{PerAgent::Same{*matrix}}) : std::nullopt;
  }
  const auto pair = read_pair(mistakes, value, place, found[0] == "uniform");
  if (!pair) return std::nullopt;
  if (found[0] == "linspace") return PerAgent{PerAgent::Linspace{pair->first, pair->second, dimension}};
  return PerAgent{PerAgent::Uniform{pair->first, pair->second, dimension}};
}

std::optional<PerAgent> read_per_agent(Mistakes& mistakes, const YAML::Node& node, const std::string& what,
                                       const std::filesystem::path& directory, std::size_t agents) {
  if (node.IsMap()) return read_rule(mistakes, node, what, directory, agents);
  if (!node.IsSequence()) {
    const auto value = plain_number(node);
    if (value) return PerAgent{PerAgent::Same{Matrix::Constant(1, 1, *value)}};
    mistakes.add(
        node, fmt::format(
                  "{}: found {}; allowed: a number, a list with one entry per agent, or one of {{all: ...}}, {{linspace: [first, last]}}, "
                  "{{uniform: [low, high]}}, {{file: ...}}",
                  what, describe(node)));
    return std::nullopt;
  }
  if (node.size() != agents) {
    mistakes.add(node, fmt::format("{}: found {}; allowed: {} entries, one per agent (the same vector for all is written {{all: [...]}})",
                                   what, describe(node), agents));
    return std::nullopt;
  }
  const std::size_t before = mistakes.count();
  PerAgent::List list;
  for (std::size_t i = 0; i < node.size(); ++i)
    if (const auto value = read_matrix(mistakes, node[i], fmt::format("{}[{}]", what, i))) list.values.push_back(*value);
  return mistakes.count() == before ? std::optional(PerAgent{list}) : std::nullopt;
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
      if (const auto value = read_matrix(mistakes, entry.second, section.path(key) + "." + name, key == "parameters"))
        values.set(name, *value);
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

// The place of the value a protocol's objection is about: a name of its that the text quotes, else one it mentions.
YAML::Mark place_of(const std::string& text, AgentId agent, const ProtocolChoice& choice, const Places& places,
                    const YAML::Mark& fallback) {
  std::set<std::string> words;
  std::string word;
  for (const char c : text + " ") {
    if (std::isalnum(static_cast<unsigned char>(c)) || c == '_') {
      word += c;
    } else {
      words.insert(std::exchange(word, {}));
    }
  }
  const ProtocolEntry& entry = *entry_of(choice.name);
  for (const bool quoted : {true, false}) {
    for (const auto docs : {entry.initial, entry.parameters}) {
      for (const auto& doc : docs) {
        const std::string name(doc.name);
        // The x of "2 x 1" is a word too, so a single letter must be quoted to count.
        const bool meant = quoted ? text.find("'" + name + "'") != std::string::npos : name.size() > 1 && words.contains(name);
        if (!meant) continue;
        for (const auto& key : {fmt::format("override {} {}", agent.value, name), "initial " + name, choice.name + " " + name})
          if (const auto it = places.find(key); it != places.end()) return it->second;
      }
    }
  }
  const auto it = places.find(choice.name);
  return it == places.end() ? fallback : it->second;
}

void try_links(Mistakes& mistakes, const YAML::Mark& mark, const Experiment& experiment, std::size_t noise_size) {
  const auto attempt = [&](Edge edge, const LinkSpec& spec, const std::string& what) {
    try {
      Link(edge, spec, static_cast<Eigen::Index>(noise_size), experiment.seed);
    } catch (const ConfigError& error) {
      mistakes.add(mark, what + ": " + error.what());
    }
  };
  attempt(Edge{AgentId{1}, AgentId{2}}, experiment.links.standard, "links");
  for (const auto& [edge, spec] : experiment.links.overrides) attempt(edge, spec, "links.overrides");
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

void try_agents(Mistakes& mistakes, const YAML::Mark& agents_mark, const YAML::Mark& links_mark, const Experiment& experiment,
                const Places& places) {
  for (const auto& choice : experiment.protocols) {
    std::optional<std::size_t> dimension;
    for (std::size_t i = 0; i < experiment.agents; ++i) {
      const AgentId agent = agent_at(i);
      try {
        const Values initial = experiment.initial_of(agent, experiment.seed);
        const auto protocol =
            entry_of(choice.name)->make(experiment.parameters_of(choice, agent), Setup{agent, experiment.agents, experiment.dt, initial});
        const std::size_t found = protocol->estimate_layout().size();
        if (!dimension) try_links(mistakes, links_mark, experiment, protocol->message_layout().noise_size);
        if (found == dimension.value_or(found)) {
          dimension = found;
          continue;
        }
        mistakes.add(place_of("'x'", agent, choice, places, agents_mark),
                     fmt::format("agents: found {} components at agent {} and {} at agent 1; allowed: the same for all agents", found,
                                 agent.value, *dimension));
      } catch (const ConfigError& error) {
        mistakes.add(place_of(error.what(), agent, choice, places, agents_mark),
                     fmt::format("agents: agent {} with {}: {}", agent.value, choice.name, error.what()));
      }
      break;  // the others would say the same
    }
    if (!mistakes.none()) return;
  }
}

std::vector<std::string> metric_names(const Experiment& experiment) {
  std::vector<std::string> out;
  for (const auto& choice : experiment.protocols) {
    Trace start;
    start.agents = experiment.agents;
    start.rounds = {0};
    for (std::size_t i = 0; i < experiment.agents; ++i) {
      const Values initial = experiment.initial_of(agent_at(i), experiment.seed);
      const auto protocol =
          entry_of(choice.name)
              ->make(experiment.parameters_of(choice, agent_at(i)), Setup{agent_at(i), experiment.agents, experiment.dt, initial});
      start.estimate_layout = protocol->estimate_layout();
      start.dimension = start.estimate_layout.size();
      start.estimates.resize((i + 1) * start.dimension);
      protocol->estimate(std::span(start.estimates).subspan(i * start.dimension));
    }
    const std::string prefix = experiment.protocols.size() > 1 ? choice.name + "." : "";
    for (const auto& [name, value] : compute_metrics(experiment, experiment.seed, choice, start)) {
      out.push_back(prefix + name);
      if (experiment.runs > 1) out.push_back(prefix + name + ".std");
    }
  }
  return out;
}

}  // namespace consort::script
