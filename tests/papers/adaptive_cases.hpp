#pragma once
/// The fixtures of the adaptive protocols: positions 10 sin(i^2) m for the publication's random draw from [-10, 10], at rest, rings, double
/// integrators, and how a run of them went.

#include "protocols/metrics.hpp"
#include "rounds/simulate.hpp"
#include "tests/support/experiments.hpp"
#include "tests/support/seeds_data.hpp"

#include <cmath>
#include <map>
#include <string>

namespace consort::adaptive {

inline std::vector<double> positions(std::size_t n) {
  std::vector<double> values;
  for (std::size_t i = 1; i <= n; ++i) values.push_back(10.0 * std::sin(static_cast<double>(i * i)));
  return values;
}

using Parameters = std::map<std::string, double>;

inline Experiment experiment(const std::string& protocol, Graph graph, std::vector<double> position, const Parameters& parameters,
                             Seconds duration, Seconds dt = 1e-3) {
  Experiment e;
  e.name = "adaptive";
  e.mode = Mode::simulate;
  e.agents = position.size();
  e.dt = dt;
  e.rounds = static_cast<Round>(std::lround(duration / dt));
  e.report_every = static_cast<Round>(std::lround(0.1 / dt));
  e.topology = for_ever(std::move(graph));
  e.plant = integrators(2, position);
  e.protocols = {{protocol, {}}};
  for (const auto& [name, value] : parameters) e.protocols[0].parameters.set(name, value);
  return e;
}

/// Adaptive consensus on an undirected ring.
inline Experiment on_ring(std::size_t n, const Parameters& parameters, Seconds duration, Seconds dt = 1e-3) {
  return experiment("adaptive_consensus", ring(n), positions(n), parameters, duration, dt);
}

inline constexpr double kHalving = 1, kEigenvalue = 2, kSliding = 1;
inline Parameters block() { return {{"reference", kHalving}}; }
inline Parameters sliding() { return {{"reference", kHalving}, {"halving", kSliding}}; }
inline Experiment with_reference(Experiment e, double kappa) {
  e.initial.push_back({"kappa", same(kappa)});
  return e;
}
inline Parameters eigenvalue(Seconds window, double xi) { return {{"reference", kEigenvalue}, {"window", window}, {"xi", xi}}; }
/// r_i(0) and q_i(0) = +1 or -1 by the seed.
inline Experiment with_artificial_states(Experiment e) {
  for (const char* name : {"r", "q"}) e.initial.push_back({name, {PerAgent::Uniform{-1.0, 1.0, 1}}});
  return e;
}
/// Noise on every measurement, held 0.1 s.
inline Experiment with_noise(Experiment e, double deviation) {
  e.plant->disturbances = {{Disturbance::On::measurement,
                            Disturbance::Gaussian{Matrix::Constant(1, 1, deviation * deviation)},
                            static_cast<Round>(std::lround(0.1 / e.dt)),
                            {}}};
  return e;
}
/// Four agents on a ring; at 15 s a fifth takes its place between 4 and 1, at 8 m and at rest.
inline Experiment with_fifth_joining(Experiment e) {
  const auto at = static_cast<Round>(std::lround(15.0 / e.dt));
  const auto four = seeds::graph_of(5, {{1, 2}, {2, 1}, {2, 3}, {3, 2}, {3, 4}, {4, 3}, {4, 1}, {1, 4}});
  e.topology = FixedSchedule{{{four, at}, {std::make_shared<const Graph>(ring(5)), 1}}, false};
  std::vector<double> position = positions(4);
  position.push_back(8.0);
  e.plant->initial = {{"position", each(position)}};
  e.presence[AgentId{5}] = {at, std::numeric_limits<Round>::max()};
  return e;
}

inline Metrics run(const Experiment& e, std::uint64_t seed = 1) {
  return compute_metrics(e, Seed{seed}, e.protocols[0], simulate(e, e.protocols[0], Seed{seed}));
}
inline Trace trace_of(const Experiment& e, std::uint64_t seed = 1) { return simulate(e, e.protocols[0], Seed{seed}); }

}  // namespace consort::adaptive
