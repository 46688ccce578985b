#pragma once
/// The same systems as experiments, and what a run says of its errors.

#include "core/trace.hpp"
#include "tests/support/experiments.hpp"
#include "tests/support/huang_cases.hpp"

#include <cmath>
#include <numbers>
#include <string>

namespace consort::huang {

inline PerAgent each_vector(std::vector<Matrix> values) { return {PerAgent::List{std::move(values)}}; }

inline Experiment timed(std::size_t agents, TopologySpec topology, Seconds dt, Seconds until, Seconds every) {
  Experiment e;
  e.name = "huang";
  e.agents = agents;
  e.dt = dt;
  e.rounds = static_cast<Round>(std::lround(until / dt));
  e.report_every = static_cast<Round>(std::lround(every / dt));
  e.topology = std::move(topology);
  return e;
}

/// A system with linear agents as an experiment with distributed_observer; `x` all initial states.
inline Experiment experiment_of(const ObservedSystem& system, const Vector& x, Seconds dt, Seconds until, Seconds every) {
  Experiment e = timed(system.agents.size(), for_ever(system.communication), dt, until, every);
  Values parameters;
  parameters.set("mu", system.mu);
  parameters.set("weights", static_cast<double>(system.weights));
  parameters.set("scheme", static_cast<double>(system.scheme));
  e.protocols = {{"distributed_observer", parameters}};
  e.plant.emplace();
  e.plant->model = "linear";
  Eigen::Index at = 0;
  for (std::size_t i = 0; i < system.agents.size(); ++i) {
    const ObservedAgent& agent = system.agents[i];
    AgentOverride& own = e.plant->overrides[agent_at(i)];
    own.parameters.set("A", agent.A);
    own.parameters.set("B", agent.B);
    own.parameters.set("C", agent.C);
    own.initial.set("x", Matrix(x.segment(at, agent.A.rows())));
    at += agent.A.rows();
    e.overrides[agent_at(i)].parameters.set("F", agent.F);
    std::map<AgentId, Values> from;
    for (const auto& [l, A_il] : agent.A_from) from[l].set("A", A_il);
    for (const auto& [l, C_il] : agent.C_from) from[l].set("C", C_il);
    for (const auto& [l, values] : from) e.plant->couplings.push_back({{l, agent_at(i)}, values});
  }
  return e;
}

/// Six integrators in the plane that localise each other, agent 2 knowing where it is.
inline Experiment localisation_experiment(int order, const Matrix& F, Seconds dt, Seconds until, Seconds every) {
  Experiment e = timed(6, for_ever(ring_of_six()), dt, until, every);
  Values parameters;
  parameters.set("F", F);
  parameters.set("input_amplitude", Matrix(Vector{{-.1, .1}}));
  parameters.set("input_frequency", .01);
  parameters.set("input_phase", Matrix(Vector{{0, std::numbers::pi / 2}}));
  e.protocols = {{"cooperative_localization", parameters}};
  e.plant.emplace();
  e.plant->model = "integrator";
  e.plant->parameters.set("dimension", 2);
  e.plant->parameters.set("order", order);
  std::vector<Matrix> start;
  for (Eigen::Index i = 0; i < 6; ++i) start.push_back(positions().row(i).transpose());
  e.plant->initial = {{"position", each_vector(start)}};
  e.plant->sensing = PlantSpec::Sensing::relative;
  for (const auto& [measurer, measured] : {std::pair{1U, 2U}, {2U, 3U}, {4U, 3U}, {5U, 4U}, {6U, 5U}})
    e.plant->relative[AgentId{measurer}] = {AgentId{measured}};
  e.plant->absolute = {AgentId{2}};
  return e;
}

/// hat_j^(i) minus x_j in one report, without padding; kAbsent where nothing is estimated.
inline Vector error_of(const Trace& trace, std::size_t report, AgentId i, AgentId j, bool bar = false) {
  const std::size_t slot = trace.dimension / (trace.agents + 1), at = bar ? trace.agents * slot : index_of(j) * slot;
  std::vector<double> out;
  for (std::size_t c = 0; c < slot; ++c) {
    const double x = trace.state_at(report, j)[c], hat = trace.at(report, i)[at + c];
    if (is_absent(x)) continue;
    out.push_back(is_absent(hat) ? kAbsent : hat - x);
  }
  return Eigen::Map<const Vector>(out.data(), static_cast<Eigen::Index>(out.size()));
}
/// All of E in the order of ObservedSystem.
inline Vector whole_error(const Trace& trace, std::size_t report) {
  std::vector<double> out;
  const auto add = [&](const Vector& part) { out.insert(out.end(), part.begin(), part.end()); };
  for (std::size_t i = 0; i < trace.agents; ++i)
    for (std::size_t j = 0; j < trace.agents; ++j) add(error_of(trace, report, agent_at(i), agent_at(j)));
  for (std::size_t i = 0; i < trace.agents; ++i) add(error_of(trace, report, agent_at(i), agent_at(i), true));
  return Eigen::Map<const Vector>(out.data(), static_cast<Eigen::Index>(out.size()));
}

}  // namespace consort::huang
