// Knotek, thesis, chapter 4: adaptive consensus with decaying gains. Expected numbers: a continuous-time integration (RK4, 1 ms) of the
// same fixtures; ours hold u and the quadratic term over a round of 1 ms, which the tolerance of 5 % on the gains allows for.

#include "tests/papers/adaptive_cases.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

using namespace adaptive;

constexpr double kGainTolerance = 0.05, kTimeTolerance = 0.3;  // relative; s

struct Row {
  const char* name;
  Experiment experiment;
  double gain_min, gain_mean, gain_max;
  double consensus_time;  // 0: not within the run
  double gain_peak;       // 0: not given
  double exact = 0.0;     // > 0: tolerance on the gains, absolute
};

std::vector<Row> table() {
  const auto li = [](std::size_t n, Seconds duration) { return experiment("li_edge_consensus", ring(n), positions(n), {}, duration); };
  return {
      {"ring50_block", on_ring(50, block(), 100), 1.00, 2.71, 5.27, 0, 13.2},
      {"ring50_ideal", with_reference(on_ring(50, {}, 100), 31.70), 31.70, 31.70, 31.70, 15.8, 31.7, 1e-3},
      {"ring50_li", li(50, 60), 1.52, 4.85, 10.64, 0, 0},
      {"ring10_sliding", on_ring(10, sliding(), 40), 1.76, 4.09, 7.62, 14.0, 11.57},
      {"ring10_block", on_ring(10, block(), 40), 1.02, 2.37, 4.41, 13.7, 11.57},
      {"ring10_ideal", with_reference(on_ring(10, {}, 40), 1.309), 1.309, 1.309, 1.309, 13.2, 11.57, 1e-3},
      {"ring10_li", li(10, 40), 1.95, 4.64, 8.92, 13.8, 0},
      {"ring5_sliding", on_ring(5, sliding(), 40), 1.44, 3.31, 5.27, 13.4, 8.14},
      {"ring5_block", on_ring(5, block(), 40), .83, 1.92, 3.06, 13.2, 8.14},
      {"ring5_ideal", with_reference(on_ring(5, {}, 40), .3618), .3618, .3618, .3618, 12.4, 8.14, 1e-3},
      {"ring5_li", li(5, 40), .73, 3.60, 7.45, 13.4, 0},
  };
}

void expect_row(const Row& row, double time_tolerance = kTimeTolerance) {
  const Metrics metrics = run(row.experiment);
  const auto expect_gain = [&](const char* name, double value) {
    EXPECT_NEAR(metrics.at(name), value, row.exact > 0.0 ? row.exact : kGainTolerance * value) << name;
  };
  expect_gain("gain_min", row.gain_min);
  expect_gain("gain_mean", row.gain_mean);
  expect_gain("gain_max", row.gain_max);
  if (row.gain_peak > 0.0) {
    EXPECT_NEAR(metrics.at("gain_peak"), row.gain_peak, kGainTolerance * row.gain_peak);
  }
  if (row.consensus_time > 0.0)
    EXPECT_NEAR(metrics.at("consensus_time"), row.consensus_time, time_tolerance);
  else
    EXPECT_TRUE(std::isnan(metrics.at("consensus_time"))) << metrics.at("consensus_time");
}

class AdaptiveFixture : public testing::TestWithParam<Row> {};
TEST_P(AdaptiveFixture, EndsWithTheGainsAndAtTheTimeOfTheTable) { expect_row(GetParam()); }
INSTANTIATE_TEST_SUITE_P(Rings, AdaptiveFixture, testing::ValuesIn(table()), [](const auto& row) { return row.param.name; });

TEST(AdaptiveConsensus, OnAFiftyRingWithASlidingWindowAgreesAfter99Seconds) {
  // The time is given in whole seconds and 1 ms steps are 0.8 s early: half the step.
  expect_row({"", on_ring(50, sliding(), 100, 5e-4), 1.66, 4.61, 9.25, 99.0, 13.7}, 0.5);
}

TEST(AdaptiveConsensus, TheStepMovesTheGainsAsStated) {
  // ZOH at 1 ms: peak 11.90, block mean 2.412; at 5 ms: 13.36, 2.635, ring of five 2.145.
  EXPECT_NEAR(run(on_ring(10, block(), 40)).at("gain_mean"), 2.412, 0.01);
  EXPECT_NEAR(run(on_ring(5, block(), 40)).at("gain_mean"), 1.958, 0.01);
  const Metrics coarse = run(on_ring(10, block(), 40, 5e-3));
  EXPECT_NEAR(coarse.at("gain_mean"), 2.635, 0.01);
  EXPECT_NEAR(coarse.at("gain_peak"), 13.36, 0.15);
  EXPECT_NEAR(run(on_ring(5, block(), 40, 5e-3)).at("gain_mean"), 2.145, 0.01);
}

// --- (4.33)-(4.34) ------------------------------------------------------------------------------------------------------

/// x' = (1 - y) x, y' = x^2 + kappa - y is the protocol: x' = x + u behind a leader at 0 with Q = 0, R = 1/8, so K = 2 and Gamma = 1/2, and
/// y = 2 c, beta = 1, kappa_i = kappa / 2.
std::pair<double, double> motivating_example(double kappa) {
  Experiment e = experiment("adaptive_consensus", *seeds::graph_of(2, {{2, 1}}), {1.0, 0.0}, {{"Q", 0.0}, {"R", 0.125}, {"beta", 1.0}}, 60);
  e.plant = PlantSpec{};
  e.plant->model = "linear";
  e.plant->parameters.set("A", 1.0);
  e.plant->initial = {{"x", each({1.0, 0.0})}};
  e.initial = {{"c", same(0.25)}, {"kappa", same(0.5 * kappa)}};
  const Trace trace = trace_of(e);
  const std::size_t last = trace.rounds.size() - 1;
  return {trace.state_at(last, AgentId{1})[0], 2.0 * trace.at(last, AgentId{1})[0]};
}

TEST(MotivatingExample, EndsOffZeroWithASmallReferenceAndAtZeroWithALargeOne) {
  auto [x, y] = motivating_example(0.5);
  EXPECT_NEAR(x, 0.707107, 1e-6);
  EXPECT_NEAR(y, 1.0, 1e-6);
  std::tie(x, y) = motivating_example(1.5);
  EXPECT_NEAR(x, 0.0, 1e-6);
  EXPECT_NEAR(y, 1.5, 1e-6);
  std::tie(x, y) = motivating_example(3.0);
  EXPECT_NEAR(x, 0.0, 1e-6);
  EXPECT_NEAR(y, 3.0, 1e-6);
}

// --- section 4.7: comparisons -------------------------------------------------------------------------------------------

TEST(Claims, HalvingEndsBelowTheEigenvalueReferenceOnALargeRingAndAboveItOnSmallOnes) {
  const auto halving = [](std::size_t n) { return run(on_ring(n, block(), 40)).at("gain_mean"); };
  EXPECT_LT(halving(50), 31.70);
  EXPECT_LT(run(on_ring(50, sliding(), 40)).at("gain_mean"), 31.70);
  EXPECT_GT(halving(10), 1.309);
  EXPECT_GT(halving(5), 0.3618);
}

TEST(Claims, GainsEndBelowThoseOfEdgesThatOnlyGrow) {
  for (const std::size_t n : {5u, 10u, 50u}) {
    SCOPED_TRACE(n);
    const double li = run(experiment("li_edge_consensus", ring(n), positions(n), {}, 60)).at("gain_mean");
    EXPECT_LT(run(on_ring(n, block(), 60)).at("gain_mean"), li);
    EXPECT_LT(run(on_ring(n, sliding(), 60)).at("gain_mean"), li);
  }
}

TEST(Claims, SurvivesAFifthAgentJoiningWithGainsFarBelowThoseThatOnlyGrow) {
  const Metrics li = run(with_fifth_joining(experiment("li_edge_consensus", ring(5), positions(5), {}, 40)));
  for (const Parameters& parameters : {block(), sliding()}) {
    const Metrics metrics = run(with_fifth_joining(on_ring(5, parameters, 40)));
    EXPECT_LE(metrics.at("consensus_time"), 13.0);
    EXPECT_LT(metrics.at("gain_mean"), 0.37 * li.at("gain_mean"));  // sliding: 65 % lower
  }
  const Metrics eigenvalues = run(with_artificial_states(with_fifth_joining(on_ring(5, eigenvalue(5, 30), 40))));
  EXPECT_LE(eigenvalues.at("consensus_time"), 13.0);
  EXPECT_NEAR(eigenvalues.at("gain_mean"), 0.3618, 1e-3);
}

// --- noise --------------------------------------------------------------------------------------------------------------

Parameters with_dead_zone(Parameters parameters, double dead_zone) {
  parameters["dead_zone"] = dead_zone;
  return parameters;
}
double noisy_mean(const Parameters& parameters, Seconds duration) {
  return run(with_noise(on_ring(10, parameters, duration), 0.1)).at("gain_mean");
}

TEST(Noise, GainsAfter60SecondsAreThoseOfTheTable) {
  EXPECT_NEAR(noisy_mean(with_dead_zone(sliding(), 0.05), 60), 5.91, kGainTolerance * 5.91);
  EXPECT_NEAR(noisy_mean(with_dead_zone(block(), 0.05), 60), 4.12, kGainTolerance * 4.12);
  EXPECT_NEAR(run(with_reference(with_noise(on_ring(10, {}, 60), 0.1), 1.309)).at("gain_mean"), 1.63, kGainTolerance * 1.63);
}

TEST(Noise, LeavesTheTruePositionsApartByLessThanTheTablesFigure) {
  // 0.31 to 0.50 m among ten agents in the table, which is about the range of ten measurements; the states themselves are closer.
  const Trace trace = trace_of(with_reference(with_noise(on_ring(10, {}, 60), 0.1), 1.309));
  double low = 1e9, high = -1e9;
  for (std::size_t i = 0; i < 10; ++i) {
    const double position = trace.state_at(trace.rounds.size() - 1, agent_at(i))[0];
    low = std::min(low, position);
    high = std::max(high, position);
  }
  EXPECT_LT(high - low, 0.31);
  EXPECT_GT(high - low, 0.01);
}

TEST(Noise, GainsOfEdgesThatOnlyGrowNeverStop) {
  const auto li = [](Seconds duration) {
    return run(with_noise(experiment("li_edge_consensus", ring(10), positions(10), {}, duration), 0.1)).at("gain_mean");
  };
  EXPECT_NEAR(li(20), 5.31, kGainTolerance * 5.31);
  EXPECT_NEAR(li(40), 5.89, kGainTolerance * 5.89);
  EXPECT_NEAR(li(120), 7.88, kGainTolerance * 7.88);
}

TEST(Noise, IsBorneByAFixedReferenceAndByHalvingWithALargeEnoughDeadZoneOnly) {
  const auto fixed = [](Seconds duration) {
    return run(with_reference(with_noise(on_ring(10, {}, duration), 0.1), 1.309)).at("gain_mean");
  };
  for (const Seconds duration : {30.0, 60.0, 120.0}) EXPECT_NEAR(fixed(duration), 1.64, kGainTolerance * 1.64);
  for (const Parameters& parameters : {block(), sliding()}) {
    const auto drift = [&](double dead_zone) {
      return noisy_mean(with_dead_zone(parameters, dead_zone), 120) - noisy_mean(with_dead_zone(parameters, dead_zone), 30);
    };
    EXPECT_GT(drift(0.05), 2.0);  // as fast as gains that only grow: 5.61 to 7.88
    EXPECT_LT(drift(0.3), 0.6);
  }
}

TEST(Noise, IsBorneByTheEigenvalueReference) {
  const Metrics metrics = run(with_artificial_states(with_noise(on_ring(10, eigenvalue(5, 30), 60), 0.1)));
  EXPECT_NEAR(metrics.at("gain_mean"), 1.63, kGainTolerance * 1.63);
}

// --- Algorithm 4.2 ------------------------------------------------------------------------------------------------------

/// lambda_2 as each agent has it after one window.
std::vector<double> eigenvalues_found(const Experiment& e, std::uint64_t seed) {
  const Trace trace = trace_of(e, seed);
  std::vector<double> found;
  for (std::size_t i = 0; i < e.agents; ++i) found.push_back(0.5 / trace.final_estimate(agent_at(i))[1]);
  return found;
}

TEST(EigenvalueReference, FindsLambda2OfRingsWhereTheWindowResolvesIt) {
  // Property: xi lambda_2 window >= 4 pi and xi lambda_max < pi f_s.
  std::size_t right = 0, all = 0;
  for (const std::size_t n : {5u, 10u, 20u}) {
    const double lambda_2 = 2.0 - 2.0 * std::cos(2.0 * M_PI / static_cast<double>(n));
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      for (const double lambda : eigenvalues_found(with_artificial_states(on_ring(n, eigenvalue(5, 30), 5.1)), seed)) {
        ++all;
        if (std::abs(lambda - lambda_2) <= 0.02 * lambda_2) ++right;
        EXPECT_GE(lambda, 0.98 * lambda_2) << "ring of " << n << ", seed " << seed;  // never less: kappa never too large
      }
    }
  }
  EXPECT_GE(static_cast<double>(right), 0.9 * static_cast<double>(all)) << "the others drew an eigenvector they do not see (Remark 33)";
}

TEST(EigenvalueReference, FindsLambda2OfTheFiftyRingIn40SecondsAndKappa31Point7) {
  const Metrics metrics = run(with_artificial_states(on_ring(50, eigenvalue(40, 25), 70)));
  EXPECT_NEAR(metrics.at("gain_min"), 31.70, 0.02 * 31.70);
  EXPECT_NEAR(metrics.at("gain_max"), 31.70, 0.02 * 31.70);
  EXPECT_LE(metrics.at("consensus_time"), 70.0);
}

TEST(EigenvalueReference, CannotFindLambda2OfTheFiftyRingInThePublicationsWindowOf10Seconds) {
  // xi lambda_2 window >= 4 pi asks for xi >= 79.7, xi lambda_max < pi f_s for xi < 39.3: kappa 3.6 to 8.5 instead of 31.7.
  for (const double lambda : eigenvalues_found(with_artificial_states(on_ring(50, eigenvalue(10, 35), 20.1)), 1)) {
    EXPECT_GT(lambda, 0.05);
    EXPECT_LT(lambda, 0.15);
  }
}

TEST(EigenvalueReference, MissesAnEigenvalueThatTheDrawLeavesUnexcited) {
  // Ring of four: eigenvalues 0, 2, 2, 4. Some draws of +-1 excite only 4, and kappa is 1/8 instead of 1/4.
  std::size_t found_2 = 0, found_4 = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const double lambda = eigenvalues_found(with_artificial_states(on_ring(4, eigenvalue(5, 30), 5.1)), seed).front();
    if (std::abs(lambda - 2.0) < 0.04) ++found_2;
    if (std::abs(lambda - 4.0) < 0.08) ++found_4;
  }
  EXPECT_GE(found_2, 10u);
  EXPECT_GE(found_4, 1u);
}

// --- directed graphs ----------------------------------------------------------------------------------------------------

Graph two_circles() {
  std::vector<Edge> edges;
  for (const unsigned before : {0u, 25u})
    for (unsigned i = 1; i <= 25; ++i) edges.push_back({AgentId{before + i}, AgentId{before + i % 25 + 1}});
  edges.push_back({AgentId{25}, AgentId{26}});
  edges.push_back({AgentId{50}, AgentId{1}});
  return Graph(50, std::span<const Edge>(edges));
}

TEST(TwoCircles, AgreeWithHalvingBelowAndWithTheStaticBoundAtTheSameGains) {
  EXPECT_NEAR(algebraic_connectivity(two_circles()), 0.032379, 1e-6);
  Parameters parameters = block();
  parameters["sampling"] = 25;
  parameters["window"] = 2;
  const Metrics halving = run(experiment("adaptive_consensus", two_circles(), positions(50), parameters, 60));
  EXPECT_LE(halving.at("consensus_time"), 60.0);
  const Metrics bound = run(with_reference(experiment("adaptive_consensus", two_circles(), positions(50), {}, 60), 15.4419));
  EXPECT_LE(bound.at("consensus_time"), 60.0);
  EXPECT_NEAR(bound.at("gain_mean"), 15.4419, 1e-3);
}

Experiment behind_a_leader(const Parameters& parameters) {
  std::vector<double> position = positions(6);
  position.push_back(5.0);
  Experiment e = experiment("adaptive_consensus", *seeds::graph_of(7, {{7, 1}, {1, 2}, {2, 3}, {3, 1}, {3, 4}, {4, 5}, {5, 6}, {6, 4}}),
                            position, parameters, 60);
  e.plant->initial.push_back({"velocity", each({0, 0, 0, 0, 0, 0, 1})});
  return e;
}

TEST(Leader, IsFollowedOnADirectedGraph) {
  EXPECT_NEAR(algebraic_connectivity(*behind_a_leader({}).schedule({}).at(0)), 0.245122, 1e-6);
  for (const Experiment& e : {behind_a_leader(block()), behind_a_leader(sliding()), with_reference(behind_a_leader({}), 2.039798)}) {
    const Trace trace = trace_of(e);
    for (std::size_t i = 0; i < 7; ++i) {
      EXPECT_NEAR(trace.state_at(trace.rounds.size() - 1, agent_at(i))[0], 65.0, 1e-6);  // x0 = 5 + t
      EXPECT_NEAR(trace.state_at(trace.rounds.size() - 1, agent_at(i))[1], 1.0, 1e-6);
    }
  }
}

}  // namespace
}  // namespace consort
