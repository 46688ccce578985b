// Knotek, "Distributed estimation and control of multi-agent systems" (thesis), chapter 2: local voting, leaders, static consensus.

#include "core/math/decompositions.hpp"
#include "core/math/riccati.hpp"
#include "protocols/metrics.hpp"
#include "rounds/simulate.hpp"
#include "tests/support/experiments.hpp"
#include "tests/support/seeds_data.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace consort {
namespace {

using seeds::graph_of;

/// Figure 2.1.
Graph figure_2_1() { return *graph_of(6, {{1, 2}, {1, 3}, {2, 3}, {2, 4}, {3, 1}, {3, 5}, {4, 6}, {5, 6}, {6, 2}}); }

Experiment steered(std::string protocol, PlantSpec plant, Graph graph, Seconds dt, double seconds) {
  Experiment e;
  e.name = "steered";
  e.agents = graph.agents();
  e.dt = dt;
  e.rounds = static_cast<Round>(std::lround(seconds / dt));
  e.report_every = 1;
  e.protocols = {{std::move(protocol), {}}};
  e.topology = for_ever(std::move(graph));
  e.plant = std::move(plant);
  return e;
}
Metrics metrics_of(const Experiment& e) { return compute_metrics(e, e.seed, e.protocols[0], simulate(e, e.protocols[0], e.seed)); }

TEST(LocalVoting, Figure21AgreesOnTheValueOf213) {
  const Vector w = left_null_vector(figure_2_1());
  const Vector expected = (Vector(6) << .384615, .153846, .230769, .076923, .076923, .076923).finished();
  EXPECT_LT((w - expected).cwiseAbs().maxCoeff(), 1e-6);
  const Metrics m = metrics_of(steered("local_voting", integrators(1, {1, 2, 3, 4, 5, 6}), figure_2_1(), 0.01, 60));
  EXPECT_NEAR(m.at("consensus_value"), 2.538462, 1e-6);
  EXPECT_NEAR(m.at("predicted_value"), 2.538462, 5e-7);
  EXPECT_LT(m.at("disagreement"), 1e-6);
  EXPECT_FALSE(m.contains("leader_error"));
}

TEST(LocalVoting, SteeringAnIntegratorIsTheSameStepAsKeepingTheValue) {
  Experiment plant = steered("local_voting", integrators(1, {1, 2, 3, 4, 5, 6}), figure_2_1(), 0.05, 5), alone = plant;
  alone.plant.reset();
  alone.initial = {{"x", each({1, 2, 3, 4, 5, 6})}};
  const Trace a = simulate(plant, plant.protocols[0], plant.seed), b = simulate(alone, alone.protocols[0], alone.seed);
  for (std::size_t report = 0; report < a.rounds.size(); ++report)
    for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(a.state_at(report, agent_at(i))[0], b.at(report, agent_at(i))[0], 1e-12);
}

TEST(LocalVoting, ALeaderIsFollowedToItsValueAtTheRateOf216) {
  // Five followers on figure 2.1 without agent 6, the leader (agent 6) pins agents 1 and 4 with weight 2.
  std::vector<WeightedEdge> edges;
  for (const auto& [from, to] : std::vector<std::pair<unsigned, unsigned>>{{1, 2}, {2, 3}, {3, 1}, {3, 5}, {2, 4}})
    edges.push_back({{AgentId{from}, AgentId{to}}, 1.0});
  for (const unsigned pinned : {1U, 4U}) edges.push_back({{AgentId{6}, AgentId{pinned}}, 2.0});
  const Graph graph(6, std::span<const WeightedEdge>(edges));
  const Matrix pinned = laplacian(graph).topLeftCorner(5, 5);  // L + G
  const Experiment e = steered("local_voting", integrators(1, {1, -2, 3, 4, 5, 10}), graph, 0.001, 10);
  const Trace trace = simulate(e, e.protocols[0], e.seed);
  // delta' = -(L + G) delta, sampled with a held control: delta(k) = (I - dt (L + G))^k delta(0)
  Vector delta = (Vector(5) << 9, 12, 7, 6, 5).finished();
  for (Round k = 0; k < e.rounds; ++k) delta -= e.dt * (pinned * delta);
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_NEAR(10.0 - trace.state_at(e.rounds, agent_at(i))[0], delta[static_cast<Eigen::Index>(i)], 1e-9);
  EXPECT_EQ(trace.state_at(e.rounds, AgentId{6})[0], 10.0) << "nobody steers the leader";
  const Metrics m = compute_metrics(e, e.seed, e.protocols[0], trace);
  EXPECT_NEAR(m.at("leader_error"), delta.cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(m.at("predicted_value"), 10.0, 1e-12);
  EXPECT_GT(eigenvalues(pinned, "L + G").real().minCoeff(), 0.0) << "L + G is a nonsingular M-matrix";
}

TEST(LocalVoting, AgreesInEveryComponentOfAPlane) {
  PlantSpec plant;
  plant.model = "integrator";
  plant.parameters.set("dimension", 2.0);
  PerAgent::List start;
  for (int i = 0; i < 4; ++i) start.values.push_back((Matrix(2, 1) << i, 10 - i * i).finished());
  plant.initial = {{"position", {start}}};
  const Metrics m = metrics_of(steered("local_voting", plant, ring(4), 0.05, 20));
  EXPECT_NEAR(m.at("consensus_value[0]"), 1.5, 1e-9);
  EXPECT_NEAR(m.at("predicted_value[1]"), 6.5, 1e-9);
  EXPECT_LT(m.at("disagreement"), 1e-8);
}

// --- static consensus -----------------------------------------------------------------------------------------------------

struct DoubleIntegrator {
  Matrix A = (Matrix(2, 2) << 0, 1, 0, 0).finished(), B = (Matrix(2, 1) << 0, 1).finished();
  Matrix K = lqr_gain(A, B, Matrix::Identity(2, 2), Matrix::Identity(1, 1));
};

double bound_2_27(const Graph& graph) { return 1.0 / (2.0 * algebraic_connectivity(graph)); }

/// Largest real part among the eigenvalues of A - c lambda B K, lambda those of L without one zero.
double abscissa(const Graph& graph, double c) {
  const DoubleIntegrator plant;
  auto spectrum = laplacian_spectrum(graph);
  spectrum.erase(std::min_element(spectrum.begin(), spectrum.end(), [](auto a, auto b) { return std::abs(a) < std::abs(b); }));
  double largest = -1e300;
  for (const auto& lambda : spectrum) {
    const Eigen::MatrixXcd loop = plant.A.cast<std::complex<double>>() - c * lambda * (plant.B * plant.K).cast<std::complex<double>>();
    Matrix real(4, 4);  // its eigenvalues are those of the loop and their conjugates
    real << loop.real(), -loop.imag(), loop.imag(), loop.real();
    largest = std::max(largest, eigenvalues(real, "the loop").real().maxCoeff());
  }
  return largest;
}

TEST(StaticConsensus, DoubleIntegratorHasTheGainAndThePolesStated) {
  const DoubleIntegrator plant;
  EXPECT_NEAR(plant.K(0, 0), 1.0, 1e-12);
  EXPECT_NEAR(plant.K(0, 1), std::numbers::sqrt3, 1e-12);
  const Eigen::VectorXcd poles = eigenvalues(Matrix(plant.A - plant.B * plant.K), "the loop");
  EXPECT_NEAR(poles[0].real(), -0.866025, 1e-6);
  EXPECT_NEAR(std::abs(poles[0].imag()), 0.5, 1e-9);
}

TEST(StaticConsensus, BoundsOf227AreTheOnesStated) {
  EXPECT_NEAR(bound_2_27(ring(10)), 1.309017, 1e-6);
  EXPECT_NEAR(bound_2_27(ring(50)), 31.704569, 1e-5);
  EXPECT_NEAR(bound_2_27(directed_ring(6)), 1.0, 1e-9);
  EXPECT_NEAR(abscissa(ring(10), bound_2_27(ring(10))), -0.433013, 1e-6);
  EXPECT_NEAR(abscissa(ring(50), bound_2_27(ring(50))), -0.433013, 1e-6);
  EXPECT_NEAR(abscissa(directed_ring(6), bound_2_27(directed_ring(6))), -0.318148, 1e-6);
}

TEST(StaticConsensus, TheBoundIsSufficientOnlyTheThresholdOfADirectedRingIsHalfOfIt) {
  EXPECT_GT(abscissa(directed_ring(6), 0.4999), 0.0);
  EXPECT_LT(abscissa(directed_ring(6), 0.5001), 0.0);
  for (const double c : {1e-3, 0.1, 10.0}) EXPECT_LT(abscissa(ring(10), c), 0.0) << "an undirected ring agrees with any c > 0";
  const auto disagreement_with = [](double c, double seconds) {
    Experiment e = steered("static_consensus", integrators(2, {0, 1, 2, 3, 4, 5}), directed_ring(6), 0.002, seconds);
    e.protocols[0].parameters.set("c", c);
    return metrics_of(e).at("disagreement");
  };
  EXPECT_GT(disagreement_with(0.45, 200), disagreement_with(0.45, 20)) << "below the threshold it grows";
  EXPECT_LT(disagreement_with(0.55, 200), 0.1 * disagreement_with(0.55, 20));
  EXPECT_LT(disagreement_with(1.0, 60), 1e-4);
}

TEST(StaticConsensus, AgreesOnTheFreeMotionOfTheMean) {
  // (w' (x) I) x moves by A alone: mean position + t * mean velocity.
  PlantSpec plant = integrators(2, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
  plant.initial.push_back({"velocity", each({1, 0, 0, 0, 0, 0, 0, 0, 0, -2})});
  Experiment e = steered("static_consensus", plant, ring(10), 0.01, 60);
  e.protocols[0].parameters.set("c", 1.309017);
  const Metrics m = metrics_of(e);
  EXPECT_LT(m.at("disagreement"), 1e-5);
  EXPECT_NEAR(m.at("consensus_value[0]"), 4.5 - 0.1 * 60, 1e-8);
  EXPECT_NEAR(m.at("consensus_value[1]"), -0.1, 1e-10);
}

TEST(StaticConsensus, FollowersOfAnUnstableLeaderStayWithIt) {
  PlantSpec plant;
  plant.model = "linear";
  plant.parameters.set("A", (Matrix(2, 2) << 0.05, 1, -1, 0.05).finished());
  plant.parameters.set("B", (Matrix(2, 1) << 0, 1).finished());
  PerAgent::List start;
  for (int i = 0; i < 5; ++i) start.values.push_back((Matrix(2, 1) << i, -i).finished());
  plant.initial = {{"x", {start}}};
  // A directed ring of four, agent 1 pinned by the leader, agent 5.
  Experiment e = steered("static_consensus", plant, *graph_of(5, {{1, 2}, {2, 3}, {3, 4}, {4, 1}, {5, 1}}), 0.01, 80);
  const double bound = bound_2_27(*graph_of(5, {{1, 2}, {2, 3}, {3, 4}, {4, 1}, {5, 1}}));
  e.protocols[0].parameters.set("c", bound);
  const Trace trace = simulate(e, e.protocols[0], e.seed);
  const Metrics m = compute_metrics(e, e.seed, e.protocols[0], trace);
  EXPECT_LT(m.at("leader_error"), 1e-3);
  // The leader turns freely: |x(t)| = e^{0.05 t} |x(0)|.
  const auto x = trace.state_at(e.rounds, AgentId{5});
  EXPECT_NEAR(std::hypot(x[0], x[1]), std::exp(4.0) * std::hypot(4.0, 4.0), 1e-6);
}

}  // namespace
}  // namespace consort
