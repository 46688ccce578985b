#include "orchestrator/script/script.hpp"

#include "orchestrator/script/agents.hpp"
#include "orchestrator/script/document.hpp"
#include "orchestrator/script/events.hpp"
#include "orchestrator/script/input_file.hpp"
#include "orchestrator/script/links.hpp"
#include "orchestrator/script/measures.hpp"
#include "orchestrator/script/memory.hpp"
#include "orchestrator/script/plant.hpp"
#include "orchestrator/script/resolved.hpp"
#include "orchestrator/script/settings.hpp"
#include "orchestrator/script/sweep.hpp"
#include "orchestrator/script/topology.hpp"
#include "orchestrator/script/trial.hpp"
#include "orchestrator/script/yaml.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <new>
#include <sstream>
#include <utility>

namespace consort {

namespace {

using namespace script;

constexpr std::size_t kLongestName = 64;                           // names the folder of the results, and the run on the network
constexpr std::size_t kLargestExperiment = std::size_t{16} << 20;  // bytes
constexpr std::uint64_t kAnyWhole = std::numeric_limits<std::uint64_t>::max();

// The comment at the head of the file, without its hash signs.
std::string header_comment(const std::string& text) {
  std::istringstream in(text);
  std::string out;
  for (std::string line; std::getline(in, line) && line.starts_with('#');) {
    line.erase(0, line.starts_with("# ") ? 2 : 1);
    out += (out.empty() ? "" : "\n") + line;
  }
  return out;
}

// Reads what is to be run: its name, mode, seed, runs, dt and rounds.
class RunReader {
 public:
  RunReader(Mistakes& mistakes, const Section& top, const ScriptOverrides& overrides, Experiment& out)
      : mistakes_(mistakes), top_(top), overrides_(overrides), out_(out) {}

  void read() {
    if (const auto node = top_.required("experiment"); present(node)) read_name(node);
    static const std::array<std::string, 3> kModes{"simulate", "lockstep", "realtime"};
    if (const auto node = top_.find("mode"); present(node))
      if (const auto mode = read_choice(mistakes_, node, "mode", kModes)) out_.mode = static_cast<Mode>(*mode);
    whole("seed", 0, kAnyWhole, [this](std::uint64_t value) { out_.seed = Seed{value}; });
    whole("runs", 1, kMostRuns, [this](std::uint64_t value) { out_.runs = value; });
    if (const auto node = top_.find("dt"); present(node)) out_.dt = read_number(mistakes_, node, "dt", kPositive).value_or(out_.dt);
    whole("rounds", 1, kMostRounds, [this](std::uint64_t value) { out_.rounds = static_cast<Round>(value); });
    if (const auto node = top_.find("duration"); present(node)) {
      if (present(top_.find("rounds"))) mistakes_.add(node, "duration: found both 'rounds' and 'duration'; allowed: one of them");
      if (const auto seconds = read_duration(mistakes_, node, "duration"))
        out_.rounds = whole_rounds(mistakes_, node, "duration", std::round(*seconds / out_.dt), 1, out_.dt).value_or(out_.rounds);
    }
    out_.mode = overrides_.mode.value_or(out_.mode);
    if (overrides_.seed) out_.seed = Seed{*overrides_.seed};
    out_.runs = overrides_.runs.value_or(out_.runs);
    out_.rounds = overrides_.rounds.value_or(out_.rounds);
    if (out_.rounds < 1 || out_.rounds > kMostRounds)
      throw ConfigError(fmt::format("--rounds: found {}; allowed: a whole number from 1 to {}", out_.rounds, kMostRounds));
    if (out_.runs < 1 || out_.runs > kMostRuns)
      throw ConfigError(fmt::format("--runs: found {}; allowed: a whole number from 1 to {}", out_.runs, kMostRuns));
  }

 private:
  template <class Take>
  void whole(const std::string& key, std::uint64_t low, std::uint64_t high, Take take) {
    if (const auto node = top_.find(key); present(node))
      if (const auto value = read_whole(mistakes_, node, key, low, high)) take(*value);
  }

  void read_name(const YAML::Node& node) {
    const auto fits = [](const std::string& name) {
      const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
      return !name.empty() && name.size() <= kLongestName && letter(name.front()) &&
             std::all_of(name.begin(), name.end(),
                         [&letter](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '_' || c == '-'; });
    };
    if (node.IsScalar() && fits(node.Scalar()) && !plain_switch(node)) {
      out_.name = node.Scalar();
    } else {
      mistakes_.add(node, fmt::format("experiment: found {}; allowed: a name of letters, digits, '_' and '-' that begins with a letter, "
                                      "of at most {} characters",
                                      describe(node), kLongestName));
    }
  }

  Mistakes& mistakes_;
  const Section& top_;
  const ScriptOverrides& overrides_;
  Experiment& out_;
};

// What stands at the top level besides what is run, agents, topology and plant.
void read_rest(Mistakes& mistakes, const Section& top, const ScriptOverrides& overrides, Events& events, Experiment& out) {
  if (const auto node = top.find("links"); present(node)) read_links(mistakes, node, out);
  if (const auto node = top.find("events"); present(node)) events.read(node);
  if (const auto node = top.find("sweep"); present(node)) read_sweep(mistakes, node, top.find("links"), events.link_changes(), out);
  read_settings(mistakes, top, overrides, out);
  read_measures(mistakes, top, out);
}

// A newer file would be misread, and every other mistake in it beside the point.
void check_format(Mistakes& mistakes, const YAML::Node& document) {
  const YAML::Node node = document.IsMap() ? document["format"] : YAML::Node(YAML::NodeType::Undefined);
  if (!present(node)) return;
  const auto format = whole_number(node);
  if (!format || *format < 1)
    mistakes.add(node, fmt::format("format: found {}; allowed: {}, or no such line", describe(node), kFileFormat));
  else if (*format > kFileFormat)
    mistakes.add(node, fmt::format("format: found {}, a file for a newer consort; allowed: {}, the newest that this one reads", *format,
                                   kFileFormat));
}

// Where it runs: the command line's hosts, or the file's; `placement: {hosts: ...}` says which agents are on which of them.
std::vector<Host> read_where(Mistakes& mistakes, const Section& top, const std::filesystem::path& directory,
                             const ScriptOverrides& overrides) {
  std::vector<Host> hosts;
  if (const auto node = top.find("hosts"); present(node)) hosts = read_hosts(mistakes, node, directory);
  if (overrides.hosts) hosts = *overrides.hosts;
  const auto placement = top.find("placement");
  if (present(placement) && placement.IsMap() && !hosts.empty()) place_on_hosts(mistakes, std::as_const(placement)["hosts"], hosts);
  return hosts;
}

// The document with what the command line sets, or of one cell of its study.
YAML::Node as_asked(Mistakes& mistakes, YAML::Node document, const std::vector<Setting>& settings, std::optional<Cell>& cell) {
  if (!document.IsMap()) return document;
  const YAML::Node sweep = document["sweep"];
  if (!cell && present(sweep)) cell = first_cell(mistakes, sweep);
  mistakes.raise();
  bool swept = present(sweep) && !cell;
  for (const Setting& setting : settings) {
    document.reset(with_setting(document, setting));
    swept = swept && !(sweep.IsMap() && sweep.size() == 1 && sweep.begin()->first.Scalar() == setting.key);
  }
  if (cell)
    for (const Setting& setting : cell->settings) document.reset(with_setting(document, setting));
  if (!swept) document.remove("sweep");
  return document;
}

// A cell's protocols are called by its values, too.
void name_cell(const Cell& cell, Experiment& out) {
  for (ProtocolChoice& choice : out.protocols) choice.variant = ProtocolChoice::Variant{0, cell.label(), out.links, cell.number()};
}

Experiment read(Mistakes& mistakes, const std::string& bytes, const std::filesystem::path& directory, const ScriptOverrides& overrides,
                std::vector<Host>& hosts) {
  const std::string text = plain_text(bytes);
  const YAML::Node written = read_document(text, mistakes);
  mistakes.raise();
  check_format(mistakes, written);
  mistakes.raise();
  check_duplicate_keys(mistakes, written);
  std::optional<Cell> cell = overrides.cell;
  const YAML::Node document = as_asked(mistakes, written, overrides.settings, cell);

  Experiment out;
  out.description = header_comment(text);
  Places places;
  const Section top(mistakes, document, "", "");
  if (!top.is_map()) mistakes.raise();
  RunReader(mistakes, top, overrides, out).read();
  const YAML::Node agents = top.required("agents"), topology_node = top.required("topology");
  if (present(agents)) read_agents(mistakes, agents, directory, out, places);
  std::optional<TopologyRead> topology;
  if (present(topology_node) && out.agents > 0)
    topology = read_topology(mistakes, topology_node, "topology", directory, out.agents, out.seed);
  // A run shortened on the command line may end before the file's last event.
  Events events(mistakes, overrides.rounds ? kMostRounds : out.rounds - 1, out);
  if (out.agents > 0) read_rest(mistakes, top, overrides, events, out);
  hosts = read_where(mistakes, top, directory, overrides);
  const YAML::Node plant = top.find("plant");
  if (present(plant) && out.agents > 0) read_plant(mistakes, plant, directory, out, places);
  events.read_degradations(directory, places);
  const bool by_distance = out.links.asks_distances() || std::any_of(out.protocols.begin(), out.protocols.end(), [&](const auto& choice) {
                             return out.links_of(choice).asks_distances();
                           });
  if (by_distance && !present(plant))
    mistakes.add(present(top.find("links")) ? top.find("links") : document,
                 "links: found loss by distance without a plant; allowed: with a plant whose agents have a position");
  if (mistakes.none()) check_against_schema(document, mistakes);
  mistakes.raise();

  out.topology = std::move(topology->spec);
  out.topology_text = std::move(topology->text);
  const YAML::Node links = top.find("links");
  mistakes.at(present(plant) ? plant.Mark() : agents.Mark());
  if (present(plant)) try_plant(mistakes, plant.Mark(), out, places);
  mistakes.raise();
  mistakes.at(agents.Mark());
  try_agents(mistakes, agents.Mark(), present(links) ? links.Mark() : agents.Mark(), out, places);
  mistakes.raise();
  if (cell) name_cell(*cell, out);
  if (cell)
    take_metrics_of_criteria(out);
  else
    check_criteria(mistakes, top, out);
  if (out.protocols.size() * out.runs > kMostRuns)
    mistakes.add(present(top.find("runs")) ? top.find("runs") : agents,
                 fmt::format("runs: found {} of each of {} protocols and swept values; allowed: {} runs in all", out.runs,
                             out.protocols.size(), kMostRuns));
  mistakes.raise();
  out.resolved_text = resolved(out, topology->canonical, hosts);
  return out;
}

// What stands nowhere in the file, the command line has set.
std::string told_of_settings(const std::string& told, const std::string& name) {
  const std::string nowhere = name + ":1:1: ";
  std::string out = told;
  for (std::size_t at = 0; (at = out.find(nowhere, at)) != std::string::npos;) {
    const bool begins = at == 0 || out[at - 1] == '\n';
    if (begins) out.replace(at, nowhere.size(), "--set: ");
    at += 1;
  }
  return out;
}

bool sets_any(const ScriptOverrides& overrides) {
  const auto is_set = [](const Setting& setting) { return setting.line < 0; };
  return std::any_of(overrides.settings.begin(), overrides.settings.end(), is_set) ||
         (overrides.cell && std::any_of(overrides.cell->settings.begin(), overrides.cell->settings.end(), is_set));
}

}  // namespace

Experiment parse_experiment(const std::string& text, const std::string& name, const std::filesystem::path& directory,
                            const ScriptOverrides& overrides, std::vector<Host>* hosts) {
  Mistakes mistakes(name);
  std::vector<Host> found;
  if (hosts == nullptr) hosts = &found;
  // Whoever objects while the file is read is given the place that is being read.
  try {
    return read(mistakes, text, directory, overrides, *hosts);
  } catch (const PlacedError& error) {
    if (!sets_any(overrides)) throw;
    throw PlacedError(told_of_settings(error.what(), name));
  } catch (const ConfigError& error) {
    if (std::string_view(error.what()).starts_with("--")) throw;  // of the command line
    mistakes.add_here(error.what());
  } catch (const RunError& error) {
    mistakes.add_here(error.what());
  } catch (const YAML::Exception& error) {
    mistakes.add_here("found what the experiment cannot have here: " + error.msg);
  } catch (const std::bad_alloc&) {
    mistakes.add_here(out_of_memory());
  }
  mistakes.raise();
  throw ContractViolation("a mistake that was raised");
}

std::string experiment_text(const std::filesystem::path& file) {
  try {
    return read_input(file, kLargestExperiment);
  } catch (const ConfigError& error) {
    throw ConfigError(fmt::format("{}: {}", file.string(), error.what()));
  }
}

Experiment load_experiment(const std::filesystem::path& file, const ScriptOverrides& overrides, std::vector<Host>* hosts) {
  return parse_experiment(experiment_text(file), file.string(), file.parent_path(), overrides, hosts);
}

}  // namespace consort
