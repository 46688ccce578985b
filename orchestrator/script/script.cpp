#include "orchestrator/script/script.hpp"

#include "core/counted.hpp"
#include "orchestrator/script/agents.hpp"
#include "orchestrator/script/criteria.hpp"
#include "orchestrator/script/document.hpp"
#include "orchestrator/script/input_file.hpp"
#include "orchestrator/script/links.hpp"
#include "orchestrator/script/plant.hpp"
#include "orchestrator/script/resolved.hpp"
#include "orchestrator/script/topology.hpp"
#include "orchestrator/script/wording.hpp"
#include "orchestrator/script/yaml.hpp"
#include "protocols/registry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <new>
#include <set>
#include <sstream>
#include <utility>

namespace consort {

namespace {

using namespace script;

constexpr std::size_t kLongestName = 64;                           // names the folder of the results, and the run on the network
constexpr std::size_t kLargestExperiment = std::size_t{16} << 20;  // bytes
const std::set<std::string> kProcessEvents{"join", "leave", "kill", "restart", "stop", "continue"};
const std::vector<std::string> kEvents{"cut", "heal", "set_link", "degrade", "join", "leave", "kill", "restart", "stop", "continue"};
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

// Reads what stands at the top level besides agents and topology.
class TopLevel {
 public:
  TopLevel(Mistakes& mistakes, const Section& top, const ScriptOverrides& overrides, Experiment& out)
      : mistakes_(mistakes), top_(top), overrides_(overrides), out_(out) {}

  void read_run() {
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
        out_.rounds = rounds_of(node, "duration", std::round(*seconds / out_.dt), 1).value_or(out_.rounds);
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

  void read_rest() {
    if (const auto node = top_.find("links"); present(node)) read_links(mistakes_, node, out_);
    if (const auto node = top_.find("events"); present(node)) read_events(node);
    if (const auto node = top_.find("sweep"); present(node)) read_sweep(mistakes_, node, top_.find("links"), link_changes_, out_);
    read_placement();
    read_transport();
    if (const auto node = top_.find("stop"); present(node)) read_stop(node);
    if (const auto node = top_.find("telemetry"); present(node)) {
      const Section section(mistakes_, node, "telemetry", "/definitions/telemetry");
      if (const auto every = section.find("every"); present(every))
        if (const auto value = read_whole(mistakes_, every, "telemetry.every", 1, kMostRounds))
          out_.report_every = static_cast<Round>(*value);
    }
    if (const auto node = top_.find("record"); present(node)) read_recording(node);
    static const std::array<std::string, 3> kDiscoveries{"auto", "multicast", "neighbours"};
    static const std::array<std::string, 2> kLosses{"abort", "continue"};
    if (const auto node = top_.find("on_agent_loss"); present(node))
      if (const auto choice = read_choice(mistakes_, node, "on_agent_loss", kLosses))
        out_.on_agent_loss = *choice == 0 ? AgentLoss::abort : AgentLoss::go_on;
    if (const auto node = top_.find("discovery"); present(node))
      if (const auto choice = read_choice(mistakes_, node, "discovery", kDiscoveries))
        out_.discovery = std::array{Discovery::automatic, Discovery::multicast, Discovery::neighbours}[*choice];
    out_.metrics = texts("metrics");
    out_.criteria = texts("criteria");
    check_metrics();
  }

  /// Once the plant is known: what its sensors are to suffer.
  void read_degradations(const std::filesystem::path& directory, Places& places) {
    for (const auto& [node, what, round] : degradations_) read_degradation(mistakes_, node, what, round, directory, out_, places);
  }

  // Once the rest of the experiment is known to hold: measures named by criteria exist.
  void check_criteria() {
    if (out_.criteria.empty()) return;
    const auto names = every_metric_name();
    std::vector<std::string> with_runs;  // what a single run does not have
    const YAML::Node list = top_.find("criteria");
    for (std::size_t i = 0; i < out_.criteria.size(); ++i) {
      try {
        const auto is_known = [&](const std::string& name) { return std::find(names.begin(), names.end(), name) != names.end(); };
        const auto used = metrics_of(out_.criteria[i]);
        if (out_.runs == 1 && with_runs.empty() && !std::all_of(used.begin(), used.end(), is_known)) {
          out_.runs = 2;
          with_runs = every_metric_name();
          out_.runs = 1;
        }
        check_criterion(out_.criteria[i], names, with_runs);
        add_metrics_of(out_.criteria[i]);
      } catch (const ConfigError& error) {
        mistakes_.add(list[i], fmt::format("criteria[{}]: {}", i, error.what()));
      }
    }
  }

 private:
  template <class Take>
  void whole(const std::string& key, std::uint64_t low, std::uint64_t high, Take take) {
    if (const auto node = top_.find(key); present(node))
      if (const auto value = read_whole(mistakes_, node, key, low, high)) take(*value);
  }

  /// What `node` comes to, if it is from `least` rounds up.
  std::optional<Round> rounds_of(const YAML::Node& node, const std::string& what, double rounds, Round least) {
    if (rounds >= static_cast<double>(least) && rounds <= static_cast<double>(kMostRounds)) return static_cast<Round>(rounds);
    mistakes_.add(node, fmt::format("{}: found {}, {} {} of dt = {} s; allowed: {} to {} rounds", what, describe(node), number_text(rounds),
                                    noun(rounds, "round"), number_text(out_.dt), least, kMostRounds));
    return std::nullopt;
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

  void read_events(const YAML::Node& node) {
    if (!node.IsSequence()) {
      mistakes_.add(node, fmt::format("events: found {}; allowed: a list such as [{{round: 150, cut: [1 -> 2]}}]", describe(node)));
      return;
    }
    for (std::size_t i = 0; i < node.size(); ++i) {
      const std::string what = fmt::format("events[{}]", i);
      const Section section(mistakes_, node[i], what, "/definitions/event");
      if (!section.is_map()) continue;
      const auto round = read_event_round(section, node[i], what);
      std::vector<std::string> found;
      for (const std::string& key : kEvents)
        if (present(section.find(key))) found.emplace_back(key);
      if (found.size() != 1) {
        mistakes_.add(node[i], fmt::format("{}: found {}; allowed: exactly one of {}", what, listed(found), listed(kEvents)));
        continue;
      }
      const YAML::Node value = section.find(found[0]);
      if (kProcessEvents.contains(found[0]))
        read_process_event(value, section.path(found[0]), round, found[0]);
      else if (!round)
        continue;
      else if (found[0] == "set_link")
        link_changes_.read(mistakes_, value, section.path(found[0]), *round, out_);
      else if (found[0] == "degrade")
        degradations_.push_back({value, section.path(found[0]), *round});
      else
        out_.link_events.push_back(read_link_event(mistakes_, value, section.path(found[0]), *round, found[0] == "heal", out_.agents));
    }
    order_process_events(node);
    link_changes_.apply(out_.links);
    check_presence(node);
  }

  /// In which round an event is; nothing where that is a mistake, which is told.
  std::optional<Round> read_event_round(const Section& section, const YAML::Node& node, const std::string& what) {
    // A run shortened on the command line may end before the file's last event.
    const std::uint64_t last = overrides_.rounds ? kMostRounds : out_.rounds - 1;
    const auto round = section.find("round"), time = section.find("time");
    if (present(round) == present(time)) {
      mistakes_.add(node, fmt::format("{}: found {}; allowed: exactly one of 'round' and 'time'", what,
                                      present(round) ? "both 'round' and 'time'" : "neither 'round' nor 'time'"));
      return std::nullopt;
    }
    if (present(round)) {
      const auto value = read_whole(mistakes_, round, what + ".round", 0, last);
      return value ? std::optional(static_cast<Round>(*value)) : std::nullopt;
    }
    const auto seconds = read_duration(mistakes_, time, what + ".time", true);
    const auto at = seconds ? rounds_of(time, what + ".time", first_round_from(*seconds / out_.dt), 0) : std::nullopt;
    if (!at || *at <= last) return at;
    mistakes_.add(time, fmt::format("{}: found {}, which is round {}; allowed: within the run's {}", what + ".time", describe(time), *at,
                                    counted(out_.rounds, "round")));
    return std::nullopt;
  }

  /// `join: 5` or `leave: [2, 3]`.
  void read_process_event(const YAML::Node& node, const std::string& what, std::optional<Round> round, const std::string& kind) {
    const YAML::Node list = node.IsSequence() ? node : YAML::Node(std::vector<YAML::Node>{node});
    for (const auto& entry : list) {
      const auto id = whole_number(entry);
      if (!id || *id < 1 || *id > out_.agents) {
        mistakes_.add(node,
                      fmt::format("{}: found {}; allowed: an agent from 1 to {}, or a list of agents", what, describe(entry), out_.agents));
        continue;
      }
      const AgentId agent{static_cast<std::uint32_t>(*id)};
      if (round == Round{0})
        mistakes_.add(node, fmt::format("{}: found agent {} in round 0; allowed: after round 0", what, *id));
      else if (round)
        process_events_[agent].push_back({*round, kind, node});
      if (!round || *round == 0) unordered_.insert(agent);
    }
  }

  /// What may happen next to an agent that is in some condition, and what that makes of it.
  enum class Condition { before, there, left, killed, stopped };
  static std::optional<Condition> after(Condition now, const std::string& kind) {
    if (kind == "join") return now == Condition::before || now == Condition::left ? std::optional(Condition::there) : std::nullopt;
    if (kind == "restart") return now == Condition::killed ? std::optional(Condition::there) : std::nullopt;
    if (kind == "continue") return now == Condition::stopped ? std::optional(Condition::there) : std::nullopt;
    if (now != Condition::there) return std::nullopt;
    return kind == "leave" ? Condition::left : kind == "kill" ? Condition::killed : Condition::stopped;
  }

  /// Each agent's events in order become its stays and what happens to its process.
  void order_process_events(const YAML::Node& node) {
    constexpr Round kEver = Attendance{}.until;
    static const std::map<std::string, Fault::Kind> kFaults{
        {"kill", Fault::Kind::kill}, {"restart", Fault::Kind::restart}, {"stop", Fault::Kind::stop}, {"continue", Fault::Kind::proceed}};
    static const std::map<Condition, std::string> kAllowed{{Condition::before, "join"},
                                                           {Condition::there, "leave, kill or stop"},
                                                           {Condition::left, "join"},
                                                           {Condition::killed, "restart"},
                                                           {Condition::stopped, "continue"}};
    for (auto& [agent, events] : process_events_) {
      if (unordered_.contains(agent)) continue;  // an event of its own has a mistake: whether the others follow from it nobody knows
      std::stable_sort(events.begin(), events.end(), [](const auto& a, const auto& b) { return a.round < b.round; });
      Condition now = events.front().kind == "join" ? Condition::before : Condition::there;
      std::vector<Attendance> stays;
      if (now == Condition::there) stays.push_back({});
      Round last = 0;
      for (const auto& event : events) {
        const auto next = after(now, event.kind);
        if (!next || event.round == last) {
          mistakes_.add(
              event.node,
              fmt::format("events: found '{}' of agent {} in round {}{}; allowed: {}, in a later round than what happened to it before",
                          event.kind, agent.value, event.round, next ? ", where something else happens to it" : "", kAllowed.at(now)));
          break;
        }
        if (*next == Condition::there && now != Condition::stopped) {
          // Whoever would come as the run ends (it was shortened on the command line) has no round to take part in, and does not come.
          const bool too_late = event.round == out_.rounds;
          stays.push_back({event.round + (too_late ? 1u : 0u), kEver});
        }
        if (*next == Condition::left || *next == Condition::killed) stays.back().until = event.round;
        if (const auto fault = kFaults.find(event.kind); fault != kFaults.end()) out_.faults.push_back({event.round, agent, fault->second});
        now = *next;
        last = event.round;
      }
      if (now == Condition::stopped)
        mistakes_.add(node, fmt::format("events: found that agent {} is stopped and never goes on; allowed: a later `continue: {}`",
                                        agent.value, agent.value));
      if (stays.size() == 1 && stays.front() == Attendance{}) continue;
      Attendance& presence = out_.presence[agent] = stays.front();
      presence.again.assign(stays.begin() + 1, stays.end());
    }
    std::stable_sort(out_.faults.begin(), out_.faults.end(), [](const Fault& a, const Fault& b) { return a.round < b.round; });
  }

  void check_presence(const YAML::Node& node) {
    const bool someone = std::any_of(out_.presence.begin(), out_.presence.end(), [](const auto& item) { return item.second.from == 0; });
    if (!out_.presence.empty() && out_.presence.size() == out_.agents && !someone)
      mistakes_.add(node, "events: found that every agent joins later; allowed: at least one agent is there from the start");
  }

  void read_transport() {
    const auto node = top_.find("transport");
    if (!present(node)) return;
    const Section section(mistakes_, node, "transport", "/definitions/transport");
    Transport& out = out_.transport;
    constexpr double kMostLoss = 0.9;
    static const std::array<std::string, 2> kReliabilities{"best_effort", "reliable"};
    if (const auto loss = section.find("loss"); present(loss))
      out.loss = read_number(mistakes_, loss, "transport.loss", Range{0.0, kMostLoss}).value_or(0.0);
    if (const auto reliability = section.find("reliability"); present(reliability))
      out.reliable = read_choice(mistakes_, reliability, "transport.reliability", kReliabilities).value_or(0) == 1;
    if (const auto history = section.find("history"); present(history))
      out.history = static_cast<std::uint32_t>(read_whole(mistakes_, history, "transport.history", 1, 1000).value_or(1));
    const auto duration = [&](const char* key, auto& into) {
      if (const auto value = section.find(key); present(value))
        if (const auto seconds = read_duration(mistakes_, value, section.path(key))) into = *seconds;
    };
    duration("lifespan", out.lifespan);
    duration("deadline", out.dds_deadline);
    duration("liveliness", out.liveliness_lease);
  }

  void read_recording(const YAML::Node& node) {
    const Section section(mistakes_, node, "record", "/definitions/record");
    const auto choice = [&](const char* key, std::optional<bool>& into) {
      const auto value = section.find(key);
      if (!present(value)) return;
      into = plain_switch(value);
      if (!into) mistakes_.add(value, fmt::format("record.{}: found {}; allowed: true or false", key, describe(value)));
    };
    choice("state", out_.recording.state);
    choice("graphs", out_.recording.graphs);
  }

  void read_placement() {
    const std::uint64_t most = std::max<std::uint64_t>(out_.agents, 1);
    if (const auto node = top_.find("placement"); present(node)) {
      const Section section(mistakes_, node, "placement", "/definitions/placement");
      if (const auto per = section.find("agents_per_process"); present(per))
        out_.agents_per_process = read_whole(mistakes_, per, "placement.agents_per_process", 1, most).value_or(1);
    }
    out_.agents_per_process = overrides_.agents_per_process.value_or(out_.agents_per_process);
    if (out_.agents_per_process < 1 || out_.agents_per_process > most)
      throw ConfigError(fmt::format("--agents-per-process: found {}; allowed: a whole number from 1 to {}", out_.agents_per_process, most));
  }

  void read_stop(const YAML::Node& node) {
    const Section section(mistakes_, node, "stop", "/definitions/stop");
    if (const auto deadline = section.find("deadline"); present(deadline))
      out_.deadline = read_duration(mistakes_, deadline, "stop.deadline").value_or(out_.deadline);
    const auto converged = section.find("converged");
    if (!present(converged)) return;
    const Section rule(mistakes_, converged, "stop.converged", "/definitions/stop/properties/converged");
    if (!rule.is_map()) return;
    Convergence convergence;
    const bool estimates = std::any_of(out_.protocols.begin(), out_.protocols.end(),
                                       [](const ProtocolChoice& choice) { return find_protocol(choice.name).truth != Truth::none; });
    const std::string key = estimates ? "error" : "disagreement", other = estimates ? "disagreement" : "error";
    if (const auto o = rule.find(other); present(o))
      mistakes_.add(o, fmt::format("stop.converged.{}: these agents {}; allowed: {}", other,
                                   estimates ? "estimate a plant" : "agree with each other", key));
    if (const auto d = rule.required(key); present(d))
      convergence.within = read_number(mistakes_, d, rule.path(key), kPositive).value_or(1.0);
    if (const auto r = rule.find("for_rounds"); present(r))
      convergence.for_rounds = static_cast<Round>(read_whole(mistakes_, r, rule.path("for_rounds"), 1, kMostRounds).value_or(1));
    out_.convergence = convergence;
  }

  std::vector<std::string> texts(const std::string& key) {
    const auto node = top_.find(key);
    if (!present(node)) return {};
    std::vector<std::string> out;
    if (!node.IsSequence()) {
      mistakes_.add(node, fmt::format("{}: found {}; allowed: a list of texts, in brackets or each behind '- ' in a line of its own", key,
                                      describe(node)));
      return out;
    }
    for (std::size_t i = 0; i < node.size(); ++i)
      if (auto text = read_text(mistakes_, node[i], fmt::format("{}[{}]", key, i))) out.push_back(std::move(*text));
    return out;
  }

  void check_metrics() {
    std::vector<std::string> names;
    for (const auto& entry : metric_table()) names.emplace_back(entry.name);
    const auto node = top_.find("metrics");
    if (!present(node) || !node.IsSequence()) return;
    for (std::size_t i = 0; i < node.size(); ++i)
      if (node[i].IsScalar() && !node[i].Scalar().empty()) read_choice(mistakes_, node[i], fmt::format("metrics[{}]", i), names);
  }

  // The line of the table that gives `name`: error.2.mode1 comes with error, nees_low with nees.
  static std::string metric_behind(const std::string& name) {
    std::string_view longest;
    for (const auto& entry : metric_table()) {
      const bool whole = name.size() == entry.name.size() ||
                         std::string_view(".[_").find(name[std::min(entry.name.size(), name.size() - 1)]) != std::string_view::npos;
      if (name.starts_with(entry.name) && whole && entry.name.size() > longest.size()) longest = entry.name;
    }
    return std::string(longest);
  }

  // Every metric is known to a criterion, whatever is printed.
  std::vector<std::string> every_metric_name() {
    const auto wanted = std::exchange(out_.metrics, {});
    auto names = metric_names(out_);
    out_.metrics = wanted;
    return names;
  }

  // The protocol (and the sweep's value) that a metric is of.
  [[nodiscard]] std::string title_before(const std::string& metric) const {
    std::string longest;
    for (const ProtocolChoice& choice : out_.protocols)
      if (metric.starts_with(choice.title() + ".") && choice.title().size() > longest.size()) longest = choice.title();
    return longest;
  }

  void add_metrics_of(const std::string& criterion) {
    if (out_.metrics.empty()) return;  // all of them anyway
    for (std::string name : metrics_of(criterion)) {
      if (out_.protocols.size() > 1) name.erase(0, title_before(name).size() + 1);
      name = metric_behind(name);
      if (std::find(out_.metrics.begin(), out_.metrics.end(), name) == out_.metrics.end()) out_.metrics.push_back(name);
    }
  }

  struct Degradation {
    YAML::Node node;
    std::string what;
    Round round;
  };

  Mistakes& mistakes_;
  const Section& top_;
  const ScriptOverrides& overrides_;
  Experiment& out_;
  LinkChanges link_changes_;
  std::vector<Degradation> degradations_;
  struct EventOfProcess {
    Round round;
    std::string kind;
    YAML::Node node;
  };
  std::map<AgentId, std::vector<EventOfProcess>> process_events_;
  std::set<AgentId> unordered_;  // agents with an event that is in no round
};

/// A newer file would be misread, and every other mistake in it beside the point.
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

Experiment read(Mistakes& mistakes, const std::string& bytes, const std::filesystem::path& directory, const ScriptOverrides& overrides) {
  const std::string text = plain_text(bytes);
  const YAML::Node document = read_document(text, mistakes);
  mistakes.raise();
  check_format(mistakes, document);
  mistakes.raise();
  check_duplicate_keys(mistakes, document);

  Experiment out;
  out.description = header_comment(text);
  Places places;
  const Section top(mistakes, document, "", "");
  if (!top.is_map()) mistakes.raise();
  TopLevel reader(mistakes, top, overrides, out);
  reader.read_run();
  const YAML::Node agents = top.required("agents"), topology_node = top.required("topology");
  if (present(agents)) read_agents(mistakes, agents, directory, out, places);
  std::optional<TopologyRead> topology;
  if (present(topology_node) && out.agents > 0) topology = read_topology(mistakes, topology_node, "topology", out.agents, out.seed);
  if (out.agents > 0) reader.read_rest();
  const YAML::Node plant = top.find("plant");
  if (present(plant) && out.agents > 0) read_plant(mistakes, plant, directory, out, places);
  reader.read_degradations(directory, places);
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
  reader.check_criteria();
  if (out.protocols.size() * out.runs > kMostRuns)
    mistakes.add(present(top.find("runs")) ? top.find("runs") : agents,
                 fmt::format("runs: found {} of each of {} protocols and swept values; allowed: {} runs in all", out.runs,
                             out.protocols.size(), kMostRuns));
  mistakes.raise();
  out.resolved_text = resolved(out, topology->canonical);
  return out;
}

}  // namespace

Experiment parse_experiment(const std::string& text, const std::string& name, const std::filesystem::path& directory,
                            const ScriptOverrides& overrides) {
  Mistakes mistakes(name);
  // Whoever objects while the file is read is given the place that is being read.
  try {
    return read(mistakes, text, directory, overrides);
  } catch (const PlacedError&) {
    throw;
  } catch (const ConfigError& error) {
    if (std::string_view(error.what()).starts_with("--")) throw;  // of the command line
    mistakes.add_here(error.what());
  } catch (const RunError& error) {
    mistakes.add_here(error.what());
  } catch (const YAML::Exception& error) {
    mistakes.add_here("found what the experiment cannot have here: " + error.msg);
  } catch (const std::bad_alloc&) {
    mistakes.add_here("found more than the memory of this machine holds; allowed: fewer agents, or fewer components");
  }
  mistakes.raise();
  throw ContractViolation("a mistake that was raised");
}

Experiment load_experiment(const std::filesystem::path& file, const ScriptOverrides& overrides) {
  std::string text;
  try {
    text = read_input(file, kLargestExperiment);
  } catch (const ConfigError& error) {
    throw ConfigError(fmt::format("{}: {}", file.string(), error.what()));
  }
  return parse_experiment(text, file.string(), file.parent_path(), overrides);
}

}  // namespace consort
