// Alighanbari, How, "An unbiased Kalman consensus algorithm", ACC 2006.

#include "protocols/consensus/kalman_consensus.hpp"
#include "protocols/consensus/unbiased_information_consensus.hpp"
#include "protocols/consensus/unbiased_kalman_consensus.hpp"
#include "protocols/metrics.hpp"
#include "rounds/simulate.hpp"
#include "tests/support/direct.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/seeds_data.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

using namespace seeds;

constexpr double kPrinted = 5e-7;  // half a unit of the sixth decimal
const char* const kUnbiasedForms[] = {"unbiased_kalman_consensus", "unbiased_information_consensus"};

std::vector<double> final_estimates(const std::string& protocol, const std::vector<double>& x, const std::vector<double>& P,
                                    TopologySpec topology, Round rounds = 300) {
  const Experiment e = scalar_experiment(protocol, x, P, std::move(topology), rounds);
  return finals(simulate(e, e.protocols[0], e.seed));
}

void expect_all(const std::vector<double>& values, double expected, double tolerance) {
  for (const double value : values) EXPECT_NEAR(value, expected, tolerance);
}

/// Equation (6).
double centralised(const std::vector<double>& x, const std::vector<double>& P) {
  double weighted = 0.0, information = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    weighted += x[i] / P[i];
    information += 1.0 / P[i];
  }
  return weighted / information;
}

// --- Fig. 1 ---------------------------------------------------------------------------------------------------------------

TEST(Figure1, KalmanConsensusPassesThroughThePrintedIterates) {
  const Experiment e = scalar_experiment("kalman_consensus", fig1::x(), fig1::P(), always(fig1::graph()), 4);
  const Trace trace = simulate(e, e.protocols[0], e.seed);
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(trace.at(k + 1, agent_at(i))[0], fig1::kKalmanIterates[k][i], kPrinted) << "after round " << k + 1;
}

TEST(Figure1, AfterThreeRoundsEverybodyIsBelowFiveAndAfterTwoNot) {
  const Experiment e = scalar_experiment("kalman_consensus", fig1::x(), fig1::P(), always(fig1::graph()), 3);
  const Trace trace = simulate(e, e.protocols[0], e.seed);
  for (const double x : scalars_at(trace, 3)) EXPECT_LT(x, 5.0);
  EXPECT_NEAR(scalars_at(trace, 2)[0], 5.0, 1e-12);
}

TEST(Figure1, KalmanConsensusEndsAtItsBiasedValue) {
  expect_all(final_estimates("kalman_consensus", fig1::x(), fig1::P(), always(fig1::graph())), fig1::kKalmanLimit, kPrinted);
}

TEST(Figure1, KalmanLimitIsTheClosedFormOfTheLeftPerronVector) {
  // sum w_i Y_i x_i / sum w_i Y_i with w^T (I + g) = lambda w^T
  const auto check_case = [](const std::vector<double>& x, const std::vector<double>& P, const std::shared_ptr<const Graph>& graph) {
    const Matrix g = adjacency(*graph) + Matrix::Identity(static_cast<Eigen::Index>(x.size()), static_cast<Eigen::Index>(x.size()));
    Vector w = Vector::Ones(g.rows());
    for (int i = 0; i < 20000; ++i) w = (g.transpose() * w).normalized();
    double above = 0.0, below = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      above += w[static_cast<Eigen::Index>(i)] * x[i] / P[i];
      below += w[static_cast<Eigen::Index>(i)] / P[i];
    }
    expect_all(final_estimates("kalman_consensus", x, P, always(graph)), above / below, 1e-9);
  };
  check_case(fig1::x(), fig1::P(), fig1::graph());
  check_case(table1::x(), table1::P(false), table1::unbalanced());
  check_case(table1::x(), table1::P(true), table1::unbalanced());
}

TEST(Figure1, UnbiasedConsensusEndsAtFiveExactly) {
  for (const char* protocol : kUnbiasedForms) {
    SCOPED_TRACE(protocol);
    expect_all(final_estimates(protocol, fig1::x(), fig1::P(), always(fig1::graph())), fig1::kUnbiased, 1e-9);
  }
}

TEST(Figure1, InformationFormKeepsTheTotalAndEndsAtTheFixtureInformation) {
  using Information = UnbiasedInformationConsensus<1>;
  auto states = direct::states<Information>({}, fig1::x(), fig1::P());
  for (Round k = 0; k < 300; ++k) states = direct::advance<Information>({}, states, *fig1::graph());
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(states[i].Y(0, 0), fig1::kInformationLimits[i], 1e-9);
}

TEST(Figure1, Equation8WithItsSelfTermWouldBeBiased) {
  using Unbiased = UnbiasedKalmanConsensus<1>;
  const Unbiased::Params params{Eigen::Matrix<double, 1, 1>(0.0), Eigen::Matrix<double, 1, 1>(0.0)};
  auto states = direct::states<Unbiased>(params, fig1::x(), fig1::P());
  for (Round k = 0; k < 300; ++k) states = direct::advance<Unbiased>(params, states, *fig1::graph(), {.k = k, .with_self = true});
  for (const auto& state : states) EXPECT_NEAR(state.x[0], fig1::kSelfTermLimit, 5e-5);
}

TEST(UnbiasedConsensus, BothFormsGiveTheSameEstimatesWhileTheCovarianceFormHalves) {
  // (8) is (11) without its factor 1/2: P_i of (8) falls to 2^-k / Y_i of (11).
  using Covariance = UnbiasedKalmanConsensus<1>;
  using Information = UnbiasedInformationConsensus<1>;
  const Covariance::Params params{Eigen::Matrix<double, 1, 1>(0.0), Eigen::Matrix<double, 1, 1>(0.0)};
  auto covariance = direct::states<Covariance>(params, table1::x(), table1::P(true));
  auto information = direct::states<Information>({}, table1::x(), table1::P(true));
  for (Round k = 1; k <= 2000; ++k) {
    covariance = direct::advance<Covariance>(params, covariance, *table1::unbalanced(), {.k = k});
    information = direct::advance<Information>({}, information, *table1::unbalanced(), {.k = k});
    for (std::size_t i = 0; i < table1::kAgents; ++i) {
      ASSERT_NEAR(covariance[i].x[0], information[i].x[0], 1e-9) << "round " << k;
      const int scale = static_cast<int>(k) + 2 * static_cast<int>(covariance[i].e[0]);
      ASSERT_NEAR(std::ldexp(covariance[i].P(0, 0), scale) * information[i].Y(0, 0), 1.0, 1e-9) << "round " << k;
    }
  }
}

TEST(UnbiasedConsensus, BothFormsStayAtTheCentralisedEstimate) {
  for (const char* protocol : {"unbiased_kalman_consensus", "unbiased_information_consensus"})
    expect_all(final_estimates(protocol, fig1::x(), fig1::P(), always(fig1::graph()), 5000), fig1::kUnbiased, 1e-9);
}

// --- Table I --------------------------------------------------------------------------------------------------------------

TEST(Table1, CentralisedValuesOfTheFixtureAreThePrintedOnes) {
  EXPECT_NEAR(centralised(table1::x(), table1::P(false)), table1::kCentralised, kPrinted);
  EXPECT_NEAR(centralised(table1::x(), table1::P(true)), table1::kCentralisedLeader, kPrinted);
  EXPECT_NEAR(table1::kCentralised, 6.043, 5e-4);
  EXPECT_NEAR(table1::kCentralisedLeader, 6.914, 5e-4);
}

TEST(Table1, ThePrintedLeaderCovarianceFitsNoDraw) {
  auto P = table1::P(true);
  P.back() = 0.001;
  EXPECT_NEAR(centralised(table1::x(), P), table1::kCentralisedLeaderAsPrinted, kPrinted);
  // The least value: everybody else at 5 with the smallest covariance.
  std::vector<double> x(table1::kAgents, 5.0), least(table1::kAgents, 0.8);
  x.back() = 7.0;
  least.back() = 0.001;
  EXPECT_GE(centralised(x, least), table1::kLeastWithPrintedLeader);
  EXPECT_NEAR(centralised(x, least), table1::kLeastWithPrintedLeader, 5e-6);
  EXPECT_GT(table1::kLeastWithPrintedLeader, 6.914);
}

TEST(Table1, EvenlySpacedCovariancesGiveOtherCentralisedValues) {
  auto ascending = linspace(0.8, 1.2, 10), descending = linspace(1.2, 0.8, 10);
  EXPECT_NEAR(centralised(table1::x(), ascending), 5.917463, kPrinted);
  EXPECT_NEAR(centralised(table1::x(), descending), 6.082537, kPrinted);
  descending.back() = table1::kLeaderP;
  EXPECT_NEAR(centralised(table1::x(), descending), 6.914352, kPrinted);
}

TEST(Table1, CentralisedMetricIsEquation6) {
  const Experiment e = scalar_experiment("kalman_consensus", table1::x(), table1::P(true), always(table1::ring()), 1);
  EXPECT_NEAR(centralised_estimate(e, e.seed)[0], centralised(table1::x(), table1::P(true)), 1e-12);
}

TEST(Table1, Cases1And2OnABalancedGraphEverybodyIsUnbiased) {
  EXPECT_TRUE(balanced(*table1::ring()));
  for (const bool leader : {false, true}) {
    for (const char* protocol : {"kalman_consensus", "unbiased_kalman_consensus", "unbiased_information_consensus"}) {
      SCOPED_TRACE(protocol);
      const double exact = centralised(table1::x(), table1::P(leader));
      expect_all(final_estimates(protocol, table1::x(), table1::P(leader), always(table1::ring()), 900), exact, 1e-12);
      EXPECT_NEAR(exact, leader ? table1::kCentralisedLeader : table1::kCentralised, kPrinted);
    }
  }
}

TEST(Table1, AnySequenceOfPerfectMatchingsIsUnbiased) {
  expect_all(final_estimates("kalman_consensus", table1::x(), table1::P(false), dinner::matchings()), table1::kCentralised, kPrinted);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const Experiment e = scalar_experiment("kalman_consensus", table1::x(), table1::P(false), RandomPairs{}, 600);
    expect_all(finals(simulate(e, e.protocols[0], Seed{seed})), centralised(table1::x(), table1::P(false)), 1e-9);
  }
}

TEST(Table1, Cases3And4OnlyTheUnbiasedLawReachesTheCentralisedValue) {
  EXPECT_FALSE(balanced(*table1::unbalanced()));
  EXPECT_TRUE(strongly_connected(*table1::unbalanced()));
  for (const bool leader : {false, true}) {
    SCOPED_TRACE(leader ? "case 4" : "case 3");
    const auto P = table1::P(leader);
    expect_all(final_estimates("kalman_consensus", table1::x(), P, always(table1::unbalanced())),
               leader ? table1::kKalmanCase4 : table1::kKalmanCase3, kPrinted);
    for (const char* protocol : kUnbiasedForms)
      expect_all(final_estimates(protocol, table1::x(), P, always(table1::unbalanced())), centralised(table1::x(), P), 1e-9);
  }
}

TEST(Theorem7, HoldsOnAGraphThatChangesEveryRound) {
  const auto topology = table1::time_varying();
  constexpr Round kRounds = 900;
  expect_all(final_estimates("kalman_consensus", table1::x(), table1::P(false), topology, kRounds), table1::kKalmanTimeVarying, kPrinted);
  for (const char* protocol : kUnbiasedForms)
    expect_all(final_estimates(protocol, table1::x(), table1::P(false), topology, kRounds), centralised(table1::x(), table1::P(false)),
               1e-9);
}

class NoisyCase : public testing::TestWithParam<table1::Noisy> {};

TEST_P(NoisyCase, Cases5And6GiveTheFixtureStatistics) {
  const auto& [protocol, leader, Omega, rounds, expected, expected_deviation] = GetParam();
  Experiment e = scalar_experiment(protocol, table1::x(), table1::P(leader), always(table1::unbalanced()), rounds);
  e.report_every = rounds;
  e.protocols[0].parameters.set("Omega", Omega);
  e.links.standard.noise_covariance = Matrix::Constant(1, 1, table1::kNoise);
  std::vector<double> means;
  for (int run = 0; run < table1::kNoisyRuns; ++run)
    means.push_back(mean(finals(simulate(e, e.protocols[0], Seed{static_cast<std::uint64_t>(run + 1)}))));
  // Both sides are samples of 300 runs: 3 sigma of their difference.
  const double runs = table1::kNoisyRuns;
  EXPECT_NEAR(mean(means), expected, 3 * std::sqrt(2.0) * expected_deviation / std::sqrt(runs));
  EXPECT_NEAR(deviation(means), expected_deviation, 3 * std::sqrt(2.0) * expected_deviation / std::sqrt(2 * runs));
}

INSTANTIATE_TEST_SUITE_P(Table1, NoisyCase, testing::ValuesIn(table1::kNoisy), [](const auto& test) {
  return std::string(test.param.protocol) + (test.param.leader ? "_case6" : "_case5") + (test.param.Omega > 0.0 ? "_OmegaInGains" : "");
});

TEST(Table1, Cases5And6TheUnbiasedLawIsCloserToCentralisedInBothReadings) {
  for (const bool leader : {false, true}) {
    for (const double Omega : {0.0, 0.01}) {
      SCOPED_TRACE(testing::Message() << "leader " << leader << ", Omega " << Omega);
      const double target = centralised(table1::x(), table1::P(leader));
      std::vector<double> distance;
      for (const char* protocol : {"unbiased_kalman_consensus", "kalman_consensus"}) {
        Experiment e = scalar_experiment(protocol, table1::x(), table1::P(leader), always(table1::unbalanced()), 25);
        e.protocols[0].parameters.set("Omega", Omega);
        e.links.standard.noise_covariance = Matrix::Constant(1, 1, table1::kNoise);
        std::vector<double> means;
        for (std::uint64_t seed = 1; seed <= 100; ++seed) means.push_back(mean(finals(simulate(e, e.protocols[0], Seed{seed}))));
        distance.push_back(std::abs(mean(means) - target));
      }
      EXPECT_LT(distance[0], distance[1]);
    }
  }
}

TEST(Table1, OmegaInTheGainsBiasesTheUnbiasedLawEvenWithoutNoise) {
  // Once P << Omega the gains fall like 1/k: agreement comes so slowly that the fixture's figures are the mean after 400 rounds.
  for (const bool leader : {false, true}) {
    Experiment e = scalar_experiment("unbiased_kalman_consensus", table1::x(), table1::P(leader), always(table1::unbalanced()), 400);
    e.protocols[0].parameters.set("Omega", 0.01);
    const double value = mean(finals(simulate(e, e.protocols[0], e.seed)));
    EXPECT_NEAR(value, leader ? table1::kUnbiasedOmegaCase6 : table1::kUnbiasedOmegaCase5, 5e-5);
    EXPECT_LT(value, centralised(table1::x(), table1::P(leader)) - 0.1);
  }
}

}  // namespace
}  // namespace consort
