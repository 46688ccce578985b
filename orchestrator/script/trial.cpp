#include "orchestrator/script/trial.hpp"

#include "core/counted.hpp"
#include "orchestrator/script/memory.hpp"
#include "orchestrator/script/script.hpp"
#include "orchestrator/script/wording.hpp"
#include "protocols/metrics.hpp"
#include "protocols/registry.hpp"
#include "rounds/simulate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>
#include <thread>
#include <tuple>
#include <type_traits>
#include <utility>

namespace consort::script {

namespace {

constexpr double kFastest = 1e7;  // rounds of agents per second: no machine does more

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
  const ProtocolEntry& entry = find_protocol(choice.name);
  for (const bool quoted : {true, false}) {
    for (const auto docs : {entry.initial, entry.parameters}) {
      for (const auto& doc : docs) {
        const std::string name(doc.name);
        // The x of "2 x 1" is a word too, so a single letter must be quoted to count, or be what something is said of.
        const bool told = text.starts_with(name + " is ") || text.find(": " + name + " is ") != std::string::npos ||
                          text.find(": " + name + " has ") != std::string::npos;
        const bool meant = quoted ? text.find("'" + name + "'") != std::string::npos : words.contains(name) && (name.size() > 1 || told);
        if (!meant) continue;
        for (const auto& key : {fmt::format("override {} {}", agent.value, name), "initial " + name, choice.name + " " + name})
          if (const auto it = places.find(key); it != places.end()) return it->second;
      }
    }
  }
  const auto it = places.find(choice.name);
  return it == places.end() ? fallback : it->second;
}

void try_links(Mistakes& mistakes, const YAML::Mark& mark, const Experiment& experiment, const LinkModel& links, std::size_t noise_size) {
  const auto attempt = [&](Edge edge, const LinkSpec& spec, const std::string& what) {
    try {
      Link(edge, spec, static_cast<Eigen::Index>(noise_size), experiment.seed);
    } catch (const ConfigError& error) {
      mistakes.add(mark, what + ": " + error.what());
    }
  };
  attempt(Edge{AgentId{1}, AgentId{2}}, links.standard, "links");
  for (const auto& [edge, spec] : links.overrides) attempt(edge, spec, "links.overrides");
  for (const LinkModel::Change& change : links.changes) attempt(change.edge.value_or(Edge{AgentId{1}, AgentId{2}}), change.spec, "events");
}

// What all agents, and the reports of their rounds, take: an agent has its estimate, and each message on its way.
void require_memory_of(const Experiment& experiment, const ProtocolChoice& choice, const Protocol& protocol) {
  const auto agents = static_cast<double>(experiment.agents);
  const auto numbers = static_cast<double>(protocol.estimate_layout().size()), sent = static_cast<double>(protocol.message_layout().size());
  const auto jobs = static_cast<double>(experiment.protocols.size() * experiment.runs);
  const double at_once =
      experiment.mode == Mode::simulate ? std::min<double>(jobs, std::max(1U, std::thread::hardware_concurrency())) : 1.0;
  require_memory(
      at_once * bytes_to_simulate(experiment, choice, protocol),
      fmt::format("{} with {}, of {} {} each and {} in a message, and {:.3g} links between them{}", counted(experiment.agents, "agent"),
                  choice.name, numbers, noun(numbers, "number"), sent, experiment.schedule(experiment.seed).most_edges(),
                  at_once > 1.0 ? fmt::format(", {} runs at once", at_once) : ""),
      "fewer agents, edges or components");
  if (experiment.convergence || !experiment.report_every) return;  // it may end after any round; reports of its own choosing are few
  const double rounds = std::min<double>(experiment.rounds, kFastest / agents * experiment.deadline);
  const double reports = std::ceil(rounds / static_cast<double>(*experiment.report_every));
  require_memory(2.0 * sizeof(double) * agents * numbers * reports,
                 fmt::format("{:.3g} {} of {} {}", reports, noun(reports, "report"), agents * numbers, noun(agents * numbers, "number")),
                 "fewer rounds, or `telemetry: {every: ...}`");
}

// How many numbers of an agent the record holds side by side: of several protocols, those of any.
class RecordWidth {
 public:
  // Throws ConfigError if there are too many.
  void require(const Experiment& experiment, const Protocol& protocol, const std::optional<Physics>& physics) {
    const std::size_t plant = physics ? physics->state_layout().size() : 0;
    const Layout beside = recorded_part(protocol.recorded_layout(), experiment.recording.state);
    for (const Layout& layout : {protocol.estimate_layout(), beside})
      for (const Field& field : layout.fields)
        if (fields_.emplace(field.name, field.rows, field.cols).second) numbers_ += field.size();
    if (numbers_ + plant <= kMostRecorded) return;
    throw ConfigError(fmt::format("found {} numbers of an agent to record ({} estimated{}{}); allowed: {}, so fewer components{}",
                                  numbers_ + plant, protocol.estimate_layout().size(),
                                  beside.size() > 0 ? fmt::format(", {} beside", beside.size()) : "",
                                  plant > 0 ? fmt::format(", {} of its plant", plant) : "", kMostRecorded,
                                  beside.size() > kRecordedNumbers ? ", or `record: {state: false}`" : ""));
  }

 private:
  std::set<std::tuple<std::string, std::size_t, std::size_t>> fields_;
  std::size_t numbers_ = 0;
};

// Of agent 1.
std::size_t components_of(const PerAgent& values) {
  const auto count = [](const auto& source) {
    using Source = std::decay_t<decltype(source)>;
    if constexpr (std::is_same_v<Source, PerAgent::Same>)
      return static_cast<std::size_t>(source.value.size());
    else if constexpr (std::is_same_v<Source, PerAgent::List>)
      return source.values.empty() ? std::size_t{0} : static_cast<std::size_t>(source.values.front().size());
    else
      return source.dimension;
  };
  return std::visit(count, values.source);
}

bool draws_initial_values(const Experiment& experiment) {
  return std::any_of(experiment.initial.begin(), experiment.initial.end(),
                     [](const NamedPerAgent& named) { return std::holds_alternative<PerAgent::Uniform>(named.values.source); });
}

// The agents of one protocol, made to hear what it objects to.
class Trial {
 public:
  Trial(Mistakes& mistakes, const Experiment& experiment, const ProtocolChoice& choice, const Places& places, const YAML::Mark& agents_mark)
      : mistakes_(mistakes), experiment_(experiment), choice_(choice), places_(places), agents_mark_(agents_mark) {
    mistakes.at(place_of("", AgentId{1}, choice, places, agents_mark));
  }

  // Makes the agent and calls `look(maker, protocol)`; what either refuses is a mistake at the value's place, and false is returned.
  template <class Look>
  bool make(AgentId agent, Seed seed, Look&& look) {
    try {
      if (!maker_ || maker_seed_.value != seed.value) maker_.emplace(experiment_, choice_, seed);
      maker_seed_ = seed;
      look(*maker_, *maker_->make(agent));
      return true;
    } catch (const ConfigError& error) {
      refuse(agent, seed, error.what());
    } catch (const RunError& error) {  // numbers that mathematics refuses
      refuse(agent, seed, error.what());
    }
    return false;
  }

  // Initial values that are drawn are others in every run; as many runs are looked at as make no delay.
  void later_seeds() {
    const std::size_t runs = std::min(experiment_.runs, 1 + kMostMade / experiment_.agents);
    for (std::size_t run = 1; run < runs; ++run)
      for (std::size_t i = 0; i < experiment_.agents; ++i)
        if (!make(agent_at(i), Seed{experiment_.seed.value + run}, [](const AgentMaker&, const Protocol&) {})) return;
  }

 private:
  static constexpr std::size_t kMostMade = 100'000;  // agents of later runs

  void refuse(AgentId agent, Seed seed, const std::string& why) const {
    const bool first = seed.value == experiment_.seed.value;
    mistakes_.add(place_of(why, agent, choice_, places_, agents_mark_),
                  fmt::format("agents: agent {} with {}{}: {}", agent.value, choice_.name,
                              first ? "" : fmt::format(" in the run with seed {}", seed.value), why));
  }

  Mistakes& mistakes_;
  const Experiment& experiment_;
  const ProtocolChoice& choice_;
  const Places& places_;
  YAML::Mark agents_mark_;
  std::optional<AgentMaker> maker_;  // of the seed asked for last
  Seed maker_seed_;
};

}  // namespace

void try_agents(Mistakes& mistakes, const YAML::Mark& agents_mark, const YAML::Mark& links_mark, const Experiment& experiment,
                const Places& places) {
  RecordWidth width;
  for (const NamedPerAgent& named : experiment.initial)
    if (const std::size_t found = components_of(named.values); named.name == "x" && found > kMostRecorded) {
      mistakes.add(
          place_of("'x'", agent_at(0), experiment.protocols.front(), places, agents_mark),
          fmt::format("agents: found an initial x of {} components; allowed: up to {}, as many as the record holds", found, kMostRecorded));
      return;  // nothing as large is made
    }
  for (const auto& choice : experiment.protocols) {
    Trial trial(mistakes, experiment, choice, places, agents_mark);
    std::optional<std::size_t> dimension;
    for (std::size_t i = 0; i < experiment.agents; ++i) {
      const AgentId agent = agent_at(i);
      const bool made = trial.make(agent, experiment.seed, [&](const AgentMaker& maker, const Protocol& protocol) {
        const std::size_t found = protocol.estimate_layout().size();
        if (!dimension) {
          require_memory_of(experiment, choice, protocol);
          width.require(experiment, protocol, maker.physics());
          try_links(mistakes, links_mark, experiment, experiment.links_of(choice), protocol.message_layout().noise_size);
        }
        if (found != dimension.value_or(found))
          mistakes.add(place_of("'x'", agent, choice, places, agents_mark),
                       fmt::format("agents: found {} at agent {} and {} at agent 1; allowed: the same for all agents",
                                   counted(found, "component"), agent.value, *dimension));
        dimension = found;
      });
      if (!made || !mistakes.none()) return;  // the others would say the same
    }
    if (draws_initial_values(experiment)) trial.later_seeds();
    if (!mistakes.none()) return;
  }
}

std::vector<std::string> metric_names(const Experiment& experiment) {
  std::vector<std::string> out;
  for (const auto& choice : experiment.protocols) {
    const std::string prefix = experiment.protocols.size() > 1 ? choice.title() + "." : "";
    for (const std::string& name : names_of_metrics(experiment, choice, AgentMaker(experiment, choice, experiment.seed).empty_trace())) {
      out.push_back(prefix + name);
      if (experiment.runs == 1) continue;
      for (const char* over_runs : {".std", ".share"}) out.push_back(prefix + name + over_runs);
    }
  }
  return out;
}

}  // namespace consort::script
