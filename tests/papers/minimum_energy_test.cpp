// Zamani, Shames, Ugrinovskii, "Minimum-energy distributed consensus of uncertain agents", 2014.

#include "protocols/control/minimum_energy.hpp"
#include "core/math/lyapunov.hpp"
#include "protocols/metrics.hpp"
#include "rounds/simulate.hpp"
#include "tests/support/experiments.hpp"
#include "tests/support/seeds_data.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

namespace consort {
namespace {

using seeds::graph_of;

Graph four_agents() { return *graph_of(4, {{1, 2}, {2, 3}, {3, 4}, {4, 1}, {1, 3}}); }
const std::vector<double> kX{4, -2, 1, 7};
const std::vector<double> kEstimates{4.5, -2.5, 2, 7};  // e(0) = .5, -.5, 1, 0

Experiment minimum_energy(const Graph& graph, const std::vector<double>& x, const std::vector<double>& estimates, Seconds dt,
                          double seconds) {
  Experiment e;
  e.name = "minimum_energy";
  e.agents = graph.agents();
  e.dt = dt;
  e.rounds = static_cast<Round>(std::lround(seconds / dt));
  e.report_every = std::max<Round>(1, e.rounds / 1000);
  e.protocols = {{"minimum_energy_consensus", {}}};
  e.initial = {{"x", each(estimates)}};
  e.topology = for_ever(graph);
  e.plant = integrators(1, x);
  e.plant->sensing = PlantSpec::Sensing::neighbours;
  return e;
}
Trace run(const Experiment& e) { return simulate(e, e.protocols[0], e.seed); }
Metrics metrics_of(const Experiment& e) { return compute_metrics(e, e.seed, e.protocols[0], run(e)); }

MinimumEnergyNetwork network_of(const Graph& graph, MinimumEnergyWeights weights = {}) {
  return minimum_energy_network(graph, std::vector<MinimumEnergyWeights>(graph.agents(), weights));
}

TEST(MinimumEnergy, StationaryGainsAreTheOnesStatedAndSolve17) {
  const MinimumEnergyNetwork network = network_of(four_agents());
  const Vector expected = (Vector(4) << .816497, .816497, .707107, .816497).finished();
  EXPECT_LT((network.gains - expected).cwiseAbs().maxCoeff(), 1e-6);
  const MinimumEnergyWeights weights{0.3, 0.7, 1.0, 2.5, true};
  const double Q = weights.stationary_gain(3.0);
  EXPECT_NEAR(weights.B * weights.B - Q * Q * (1 / weights.R + 3.0 / weights.S), 0.0, 1e-12);
}

TEST(MinimumEnergy, TheGainFollows17) {
  const MinimumEnergyWeights weights{0.3, 0.7, 1.0, 2.5, false};
  const double rate = 1 / weights.R + 3.0 / weights.S;
  double Q = 0.2;
  constexpr int kSteps = 100'000;
  for (int k = 0; k < kSteps; ++k) Q += 0.1 / kSteps * (weights.B * weights.B - Q * Q * rate);
  EXPECT_NEAR(weights.gain_after(0.1, 0.2, 3.0), Q, 1e-5);
  EXPECT_NEAR(weights.gain_after(0.05, weights.gain_after(0.05, 0.2, 3.0), 3.0), weights.gain_after(0.1, 0.2, 3.0), 1e-14);
  EXPECT_NEAR(weights.gain_after(100.0, 0.2, 3.0), weights.stationary_gain(3.0), 1e-12);
}

TEST(MinimumEnergy, Theorem1AgreesOnTheValueOf24) {
  const Metrics m = metrics_of(minimum_energy(four_agents(), kX, kEstimates, 0.01, 60));
  EXPECT_NEAR(m.at("predicted_value"), 3.187326, 1e-6);
  EXPECT_NEAR(m.at("consensus_value"), 3.187326, 1e-4);
  EXPECT_NEAR(m.at("consensus_value"), m.at("predicted_value"), 1e-8) << "Euler's rule keeps (24) exactly";
  EXPECT_LT(m.at("disagreement"), 1e-8);
  EXPECT_LT(m.at("agreement_deviation"), 1e-3);
}

TEST(MinimumEnergy, StatesAfterTwoSecondsAreTheOnesStated) {
  const Vector expected = (Vector(4) << 4.331642, 1.485966, 1.759561, 3.996756).finished();
  const Trace trace = run(minimum_energy(four_agents(), kX, kEstimates, 1e-4, 2));
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(trace.state_at(trace.rounds.size() - 1, agent_at(i))[0], expected[static_cast<Eigen::Index>(i)], 2e-4);
}

TEST(MinimumEnergy, LeftNullVectorHoldsForAnyTuningAndWeights) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose("minimum energy"));
    const std::size_t n = 2 + stream.below(6);
    std::vector<WeightedEdge> edges;
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j)
        if (i != j && (j == (i + 1) % n || stream.uniform() < 0.4)) edges.push_back({{agent_at(i), agent_at(j)}, stream.uniform(0.2, 3.0)});
    std::vector<MinimumEnergyWeights> weights;
    for (std::size_t i = 0; i < n; ++i) {
      const double R = stream.uniform(0.1, 2.0), G = stream.uniform(0.1, 2.0);
      weights.push_back({R, G, R + G, stream.uniform(0.2, 2.0), true});
    }
    const MinimumEnergyNetwork network = minimum_energy_network(Graph(n, std::span<const WeightedEdge>(edges)), weights);
    EXPECT_LT((network.left.transpose() * network.F).cwiseAbs().maxCoeff(), 1e-12 * network.F.norm() * network.left.norm());
    EXPECT_NEAR(network.left.head(static_cast<Eigen::Index>(n)).sum(), 1.0, 1e-12);
  }
}

TEST(MinimumEnergy, DecayAndBoundAreTheOnesStated) {
  const Graph graph = four_agents();
  const MinimumEnergyNetwork network = network_of(graph);
  const auto [a, b] = decay_of(network);
  EXPECT_NEAR(a, .381468, 1e-6);
  EXPECT_NEAR(b, 1.747994, 2e-5);
  const std::vector<MinimumEnergyWeights> weights(4);
  const double corrected = disturbance_bound(network, weights, 0.1, 0.1);
  EXPECT_NEAR(corrected, 1.580723, 1e-6);
  const double printed = corrected - 4 * 0.1;  // (29) without the disturbance of e
  EXPECT_NEAR(printed, 1.180723, 1e-6);
  EXPECT_NEAR(b * printed / a, 5.410, 1e-3);
}

/// delta_i = .1 sin(t + i), eps_ij = .1 cos(2 t + i + 3 j).
Experiment disturbed(Seconds dt) {
  const Graph graph = four_agents();
  Experiment e = minimum_energy(graph, kX, kEstimates, dt, 60);
  e.plant->disturbances.push_back({Disturbance::On::state, Disturbance::Sinusoid{same(0.1), 1.0, each({1, 2, 3, 4})}, 1, {}});
  for (std::uint32_t i = 1; i <= 4; ++i) {
    Vector phase(1 + static_cast<Eigen::Index>(graph.in_degree(AgentId{i})));
    phase[0] = 4.0 * i;
    Eigen::Index s = 1;
    for (const Neighbour& j : graph.in_neighbours(AgentId{i})) phase[s++] = i + 3.0 * j.id.value;
    phase.array() += std::numbers::pi / 2;
    e.plant->disturbances.push_back(
        {Disturbance::On::measurement, Disturbance::Sinusoid{same(0.1), 2.0, same(Matrix(phase))}, 1, {AgentId{i}}});
  }
  return e;
}

/// |[x - mean x; e]|, e the errors of the estimates.
double distance_from_mean(const Vector& x, const Vector& e) { return std::sqrt((x.array() - x.mean()).square().sum() + e.squaredNorm()); }

/// Largest deviations over 30..60 s.
struct Deviations {
  double from_limit = 0.0;  ///< of [x; e] from what theory projects it on
  double from_mean = 0.0;
};

/// The same by Runge-Kutta, nothing held: [x; e]' = F [x; e] + disturbances (26), with -delta in e.
Deviations dumb_deviation() {
  const Graph graph = four_agents();
  const MinimumEnergyNetwork network = network_of(graph);
  const Matrix g = adjacency(graph);
  const auto slope = [&](double t, const Vector& z) -> Vector {
    Vector out = network.F * z;
    for (Eigen::Index i = 0; i < 4; ++i) {
      const auto eps = [&](Eigen::Index j) { return 0.1 * std::cos(2 * t + static_cast<double>(i + 1 + 3 * (j + 1))); };
      double heard = 0.0;
      for (Eigen::Index j = 0; j < 4; ++j) heard += g(i, j) * eps(j);
      const double delta = 0.1 * std::sin(t + static_cast<double>(i + 1));
      out[i] += heard / 2 + delta;
      out[4 + i] += network.gains[i] * (eps(i) + heard / 2) - delta;
    }
    return out;
  };
  Vector z(8);
  z << kX[0], kX[1], kX[2], kX[3], .5, -.5, 1, 0;
  Deviations largest;
  constexpr double h = 0.01;
  for (int k = 0; k < 6000; ++k) {
    const double t = k * h;
    const Vector k1 = slope(t, z), k2 = slope(t + h / 2, z + h / 2 * k1), k3 = slope(t + h / 2, z + h / 2 * k2),
                 k4 = slope(t + h, z + h * k3);
    z += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    if (k + 1 < 3000) continue;
    largest.from_limit = std::max(largest.from_limit, network.deviation(z).norm());
    largest.from_mean = std::max(largest.from_mean, distance_from_mean(z.head(4), z.tail(4)));
  }
  return largest;
}

TEST(MinimumEnergy, Theorem2BoundsTheDeviationUnderBoundedDisturbances) {
  const Metrics m = metrics_of(disturbed(0.002));
  const double exact = dumb_deviation().from_limit;
  EXPECT_NEAR(m.at("agreement_deviation"), exact, 0.01 * exact);
  EXPECT_LT(m.at("agreement_deviation"), m.at("agreement_deviation_bound"));
  EXPECT_NEAR(m.at("agreement_deviation_bound"), 1.747994 * 1.580723 / .381468, 0.01);
  EXPECT_GT(m.at("agreement_deviation_bound"), 20 * m.at("agreement_deviation")) << "the bound is loose";
}

TEST(MinimumEnergy, UltimateDeviationFromTheMeanIsTheOneStated) {
  EXPECT_NEAR(dumb_deviation().from_mean, .214893, 2e-6);
  const Experiment e = disturbed(0.002);
  double largest = 0.0;
  simulate(e, e.protocols[0], e.seed, [&](const RoundReport& report) {
    if (report.k < 15'000) return true;  // 30 s
    Vector x(4), error(4);
    for (Eigen::Index i = 0; i < 4; ++i) {
      x[i] = report.states[static_cast<std::size_t>(i)];
      error[i] = report.estimates[static_cast<std::size_t>(i) * report.estimates.size() / 4] - x[i];
    }
    largest = std::max(largest, distance_from_mean(x, error));
    return true;
  });
  EXPECT_NEAR(largest, .214893, 0.01 * .214893);
}

TEST(MinimumEnergy, ABalancedGraphWithoutInitialErrorAgreesOnTheMean) {
  const Metrics m = metrics_of(minimum_energy(ring(6), {1, 2, 3, 4, 5, 9}, {1, 2, 3, 4, 5, 9}, 0.01, 100));
  EXPECT_NEAR(m.at("consensus_value"), 4.0, 1e-8);
  EXPECT_LT(m.at("disagreement"), 1e-6);
}

TEST(MinimumEnergy, TheRiccatiGainReachesTheStationaryOne) {
  Experiment e = minimum_energy(four_agents(), kX, kEstimates, 0.01, 30);
  e.protocols[0].parameters.set("gain", 1.0);
  e.initial.push_back({"Q", same(0.1)});
  const Trace trace = run(e);
  const Vector expected = network_of(four_agents()).gains;
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(trace.at(0, agent_at(i))[1], 0.1);
    EXPECT_NEAR(trace.final_estimate(agent_at(i))[1], expected[static_cast<Eigen::Index>(i)], 1e-9);
  }
  const Metrics m = compute_metrics(e, e.seed, e.protocols[0], trace);
  EXPECT_LT(m.at("disagreement"), 1e-3);
  EXPECT_FALSE(m.contains("predicted_value")) << "(24) is about stationary gains";
}

// --- section VII: coherence (31) ---------------------------------------------------------------------------------------------

constexpr double kAgents = 100.0;

/// A disagreement mode of the complete graph (n - 1 alike): z' = M z + N w, unit white noises; variance of its first state.
double mode_variance(const Matrix& M, const Matrix& N) { return continuous_lyapunov(M, N * N.transpose())(0, 0); }

struct Level {
  double delta, epsilon, both;
};
/// (19) on the complete graph: x' = -(n e / S) .. per mode, with the n - 2 + 1 measurement noises of an agent that do not cancel.
Level coherence_of_19(double S, bool as_printed) {
  const double n = kAgents, d = n - 1, Q = 1.0 / std::sqrt(1.0 + d / S);
  Matrix F(2, 2);
  F << -n / S, -d / S, -Q * n / S, -Q * (1.0 + d / S);
  Matrix delta(2, 1), epsilon(2, 2);
  delta << 1, as_printed ? 0 : -1;
  // Of its own measurement, and of the sum over d others (variance d, independent from agent to agent).
  epsilon << 0, std::sqrt(d) / S, Q, Q * std::sqrt(d) / S;
  const double of_delta = (n - 1) * mode_variance(F, delta), of_epsilon = (n - 1) * mode_variance(F, epsilon);
  return {of_delta, of_epsilon, of_delta + of_epsilon};
}

TEST(MinimumEnergy, CoherenceOnTheCompleteGraphOf100IsTheOneStated) {
  const double n = kAgents, d = n - 1;
  const auto classical = [&](double noise) { return (n - 1) * noise / (2.0 * n); };
  EXPECT_NEAR(classical(1.0), 0.495, 1e-12);                // (30) with exact states: (31)
  EXPECT_NEAR(classical(d * d + d), 4900.5, 1e-9);          // noisy own and neighbours, epsilon only
  EXPECT_NEAR(classical(1.0 + d * d + d), 4900.995, 1e-9);  // and both
  EXPECT_NEAR(classical(d), 49.005, 1e-9);                  // noisy neighbours, exact own state
  const Level sum = coherence_of_19(2.0, false), letter = coherence_of_19(1.0, false);
  EXPECT_NEAR(sum.delta, 395.62, 0.01);
  EXPECT_NEAR(sum.epsilon, 27.49, 0.01);
  EXPECT_NEAR(sum.both, 423.11, 0.01);
  EXPECT_NEAR(letter.delta, 535.10, 0.01);
  EXPECT_NEAR(letter.epsilon, 49.01, 0.01);
  EXPECT_NEAR(letter.both, 584.10, 0.01);
  EXPECT_NEAR(coherence_of_19(2.0, true).delta, 7.09, 0.01);  // (27) as printed forgets delta in e
  EXPECT_NEAR(coherence_of_19(1.0, true).delta, 4.95, 0.01);
}

Experiment noisy_complete(std::size_t n, bool noisy_measurements) {
  Experiment e = minimum_energy(complete(n), std::vector<double>(n, 0.0), std::vector<double>(n, 0.0), 2e-3, 80);
  e.report_every = 10;
  e.plant->disturbances.push_back({Disturbance::On::state, Disturbance::Gaussian{Matrix::Ones(1, 1), true}, 1, {}});
  if (noisy_measurements)
    e.plant->disturbances.push_back({Disturbance::On::measurement, Disturbance::Gaussian{Matrix::Ones(1, 1), true}, 1, {}});
  return e;
}
double coherence_of(const Experiment& e, const std::string& protocol) {
  const ProtocolChoice choice{protocol, {}};
  double sum = 0.0;
  constexpr int kRuns = 4;
  for (int run = 1; run <= kRuns; ++run) {
    const Seed seed{static_cast<std::uint64_t>(run)};
    sum += compute_metrics(e, seed, choice, simulate(e, choice, seed)).at("coherence");
  }
  return sum / kRuns;
}

TEST(MinimumEnergy, SimulatedCoherenceMeetsTheLyapunovSolution) {
  // Twelve agents; the sampled loops differ from the continuous ones by about n dt / 2 = 1 %.
  constexpr std::size_t kFew = 12;
  const double n = kFew, d = n - 1, S = 2, Q = 1.0 / std::sqrt(1.0 + d / S);
  Matrix F(2, 2), N(2, 3);
  F << -n / S, -d / S, -Q * n / S, -Q * (1.0 + d / S);
  N << 1, 0, std::sqrt(d) / S, -1, Q, Q * std::sqrt(d) / S;
  const double filtered = (n - 1) * mode_variance(F, N), direct = (n - 1) / (2 * n) * (1 + d + d * d), exact = (n - 1) / (2 * n);
  Experiment e = noisy_complete(kFew, true);
  const double measured_filtered = coherence_of(e, "minimum_energy_consensus"), measured_direct = coherence_of(e, "measured_consensus");
  EXPECT_NEAR(measured_filtered, filtered, 0.1 * filtered);
  EXPECT_NEAR(measured_direct, direct, 0.1 * direct);
  EXPECT_LT(measured_filtered, measured_direct) << "better than classical consensus on the same measurements";
  const double perfect = coherence_of(noisy_complete(kFew, false), "measured_consensus");
  EXPECT_NEAR(perfect, exact, 0.1 * exact);
  EXPECT_GT(measured_filtered, 3 * perfect) << "but not than (30) on exact states, as the paper has it";
}

// --- what a missing message does ----------------------------------------------------------------------------------------------

struct Agent1 {
  Values initial, model;
  std::unique_ptr<Protocol> protocol;
  std::array<Neighbour, 2> neighbours{Neighbour{AgentId{2}, 1.0}, Neighbour{AgentId{3}, 1.0}};
  std::array<double, 3> y{1.0, 4.0, 9.0};

  Agent1(const char* name, const Values& parameters = {}) {
    initial.set("x", 2.0);
    if (std::string(name) == "minimum_energy_consensus") initial.set("Q", 0.5);
    model.set("sensed", Matrix((Vector(3) << 1, 2, 3).finished()));
    protocol = find_protocol(name).make(parameters, consort::Setup{AgentId{1}, 3, 0.1, initial, model, y.size()});
  }
  double control_after(std::span<const Received> inbox) {
    protocol->absorb({.k = 0, .dt = 0.1, .in_neighbours = neighbours, .out_degree = 0, .y = y, .self = AgentId{1}}, inbox);
    double u = 0.0;
    protocol->control({&u, 1});
    return u;
  }
};

TEST(MeasuredConsensus, UsesOnlyMeasurementsOfThoseWhoseMessageCame) {
  const std::array payload{0.0};
  const std::array both{Received{AgentId{2}, 0, 1.0, payload}, Received{AgentId{3}, 0, 2.0, payload}};
  EXPECT_EQ(Agent1("measured_consensus").control_after(both), 3.0 + 2.0 * 8.0);
  EXPECT_EQ(Agent1("measured_consensus").control_after(std::span(both).first(1)), 3.0);
  EXPECT_EQ(Agent1("measured_consensus").control_after({}), 0.0);
}

TEST(MinimumEnergy, UsesOnlyMeasurementsOfThoseWhoseMessageCame) {
  const std::array payload{0.0};
  const std::array both{Received{AgentId{2}, 0, 1.0, payload}, Received{AgentId{3}, 0, 1.0, payload}};
  // u = (G / S) sum (y_ij - xhat) with G / S = 1/2, xhat = 2
  EXPECT_NEAR(Agent1("minimum_energy_consensus").control_after(both), 0.5 * (2 + 7), 1e-15);
  EXPECT_NEAR(Agent1("minimum_energy_consensus").control_after(std::span(both).first(1)), 0.5 * 2, 1e-15);
  for (const bool riccati : {false, true}) {
    SCOPED_TRACE(riccati);
    Values parameters;
    parameters.set("gain", riccati ? 1.0 : 0.0);
    Agent1 alone("minimum_energy_consensus", parameters);
    EXPECT_EQ(alone.control_after({}), 0.0);
    std::array<double, 2> estimate{};
    alone.protocol->estimate(estimate);
    const MinimumEnergyWeights weights;
    const double Q = riccati ? 0.5 : weights.stationary_gain(2.0);
    EXPECT_NEAR(estimate[0], 2.0 + 0.1 * Q * (1.0 - 2.0), 1e-15) << "only the own measurement corrects";
    EXPECT_NEAR(estimate[1], riccati ? weights.gain_after(0.1, 0.5, 0.0) : Q, 1e-15);
  }
}

TEST(MinimumEnergy, SaysThatNeighboursMustBeMeasured) {
  for (const char* name : {"minimum_energy_consensus", "measured_consensus"}) {
    Experiment e = minimum_energy(ring(4), {1, 2, 3, 4}, {1, 2, 3, 4}, 0.01, 1);
    e.plant->sensing = PlantSpec::Sensing::own;
    e.protocols[0].name = name;
    try {
      static_cast<void>(run(e));
      FAIL() << "measurements that are not there were used";
    } catch (const RunError& error) {
      EXPECT_NE(std::string(error.what()).find("sensing: neighbours"), std::string::npos) << error.what();
    }
  }
}

TEST(MinimumEnergy, RefusesTuningThatMakesNoSense) {
  for (const auto& [name, value] :
       std::vector<std::pair<const char*, double>>{{"R", 0.0}, {"G", -1.0}, {"S", 0.5}, {"B", 0.0}, {"gain", 2.0}}) {
    Experiment e = minimum_energy(four_agents(), kX, kEstimates, 0.01, 1);
    e.protocols[0].parameters.set(name, value);
    EXPECT_THROW(static_cast<void>(run(e)), ConfigError) << name;
  }
}

TEST(MinimumEnergy, OneAgentAloneOnlyFilters) {
  const Trace trace = run(minimum_energy(Graph(1, std::span<const Edge>()), {3}, {5}, 0.01, 20));
  EXPECT_EQ(trace.state_at(trace.rounds.size() - 1, AgentId{1})[0], 3.0);
  EXPECT_NEAR(trace.final_estimate(AgentId{1})[0], 3.0, 1e-6);
}

}  // namespace
}  // namespace consort
