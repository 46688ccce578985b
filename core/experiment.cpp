#include "core/experiment.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <array>

namespace consort {

namespace {

Matrix value_of(const PerAgent::Same& source, AgentId, std::size_t, std::string_view, Seed) { return source.value; }

Matrix value_of(const PerAgent::List& source, AgentId agent, std::size_t agents, std::string_view name, Seed) {
  if (source.values.size() != agents) {
    throw ConfigError("initial '" + std::string(name) + "': the list has " + std::to_string(source.values.size()) +
                      " entries; allowed: one per agent, " + std::to_string(agents));
  }
  return source.values[index_of(agent)];
}

Matrix value_of(const PerAgent::Linspace& source, AgentId agent, std::size_t agents, std::string_view, Seed) {
  const double value =
      agents == 1 ? source.first
                  : source.first + (source.last - source.first) * static_cast<double>(index_of(agent)) / static_cast<double>(agents - 1);
  return Matrix::Constant(static_cast<Eigen::Index>(source.dimension), 1, value);
}

Matrix value_of(const PerAgent::Uniform& source, AgentId agent, std::size_t, std::string_view name, Seed seed) {
  const Purpose purpose("initial " + std::string(name));
  Matrix value(static_cast<Eigen::Index>(source.dimension), 1);
  for (Eigen::Index c = 0; c < value.rows(); ++c) {
    value(c, 0) = seed.stream(purpose, agent.value, static_cast<std::uint64_t>(c)).uniform(source.low, source.high);
  }
  return value;
}

Values initial_values(const std::vector<NamedPerAgent>& initial, const std::map<AgentId, AgentOverride>& overrides, AgentId agent,
                      std::size_t agents, Seed seed) {
  Values values;
  for (const auto& [value_name, per_agent] : initial) values.set(value_name, per_agent.of(agent, agents, value_name, seed));
  const auto it = overrides.find(agent);
  return it == overrides.end() ? values : values.overridden_by(it->second.initial);
}

Values parameter_values(const Values& common, const std::map<AgentId, AgentOverride>& overrides, AgentId agent) {
  const auto it = overrides.find(agent);
  return it == overrides.end() ? common : common.overridden_by(it->second.parameters);
}

// Reports of all agents, summed over the run, that a trace may hold unless the user asks for more.
constexpr std::uint64_t kReportBudget = 100'000;

}  // namespace

Matrix PerAgent::of(AgentId agent, std::size_t agents, std::string_view name, Seed seed) const {
  check(agent.value >= 1 && index_of(agent) < agents, "PerAgent::of: agents are numbered 1..n");
  return std::visit([&](const auto& kind) { return value_of(kind, agent, agents, name, seed); }, source);
}

Values Experiment::initial_of(AgentId agent, Seed run_seed) const { return initial_values(initial, overrides, agent, agents, run_seed); }

Values Experiment::parameters_of(const ProtocolChoice& protocol, AgentId agent) const {
  return parameter_values(protocol.parameters, overrides, agent);
}

Values PlantSpec::initial_of(AgentId agent, std::size_t agents, Seed run_seed) const {
  return initial_values(initial, overrides, agent, agents, run_seed);
}

Values PlantSpec::parameters_of(AgentId agent) const {
  Values values = parameter_values(parameters, overrides, agent);
  for (const Coupling& coupling : couplings) {
    if (coupling.edge.to != agent) continue;
    for (const Values::Entry& entry : coupling.values.entries())
      values.set(entry.name + "_" + std::to_string(coupling.edge.from.value), entry.value);
  }
  return values;
}

Attendance Experiment::presence_of(AgentId agent) const {
  const auto it = presence.find(agent);
  return it == presence.end() ? Attendance{} : it->second;
}

std::vector<ProcessEvent> process_events(const Experiment& experiment) {
  constexpr std::array kKinds{"kill", "restart", "stop", "continue"};
  std::vector<ProcessEvent> events;
  const auto is_fault = [&](Fault::Kind kind, AgentId agent, Round round) {
    return std::any_of(experiment.faults.begin(), experiment.faults.end(),
                       [&](const Fault& fault) { return fault.kind == kind && fault.agent == agent && fault.round == round; });
  };
  for (const Fault& fault : experiment.faults) events.push_back({fault.round, kKinds[static_cast<std::size_t>(fault.kind)], fault.agent});
  for (const auto& [agent, presence] : experiment.presence)
    for (const Attendance& stay : presence.stays()) {
      if (stay.from > 0 && !is_fault(Fault::Kind::restart, agent, stay.from)) events.push_back({stay.from, "join", agent});
      const bool ends = stay.until < Attendance{}.until;
      if (ends && !is_fault(Fault::Kind::kill, agent, stay.until)) events.push_back({stay.until, "leave", agent});
    }
  std::stable_sort(events.begin(), events.end(), [](const ProcessEvent& a, const ProcessEvent& b) { return a.round < b.round; });
  return events;
}

std::vector<AgentId> Experiment::sensed_by(AgentId agent, const Graph& support) const {
  if (plant && plant->sensing == PlantSpec::Sensing::relative) {
    const auto at = plant->relative.find(agent);
    return at == plant->relative.end() ? std::vector<AgentId>{} : at->second;
  }
  std::vector<AgentId> sensed{agent};
  if (plant && plant->sensing == PlantSpec::Sensing::neighbours)
    for (const Neighbour& neighbour : support.in_neighbours(agent)) sensed.push_back(neighbour.id);
  return sensed;
}

Round Experiment::report_interval() const {
  if (report_every) {
    check(*report_every >= 1, "report_every is at least one round");
    return *report_every;
  }
  const std::uint64_t smallest = (std::uint64_t{rounds} * agents + kReportBudget - 1) / kReportBudget;
  return static_cast<Round>(std::clamp<std::uint64_t>(smallest, 1, std::max<Round>(rounds, 1)));
}

}  // namespace consort
