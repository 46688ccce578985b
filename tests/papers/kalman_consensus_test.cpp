// Ren, Beard, Kingston, "Multi-agent Kalman consensus with relative uncertainty", ACC 2005.

#include "protocols/consensus/kalman_consensus.hpp"
#include "rounds/simulate.hpp"
#include "tests/support/direct.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/seeds_data.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

using namespace seeds;

TEST(DinnerFixture, FirstMatchingIsTheOneStated) {
  const FixedSchedule schedule = dinner::matchings();
  for (std::size_t i = 0; i < dinner::kAgents; ++i) {
    const auto partners = schedule.intervals.front().graph->in_neighbours(agent_at(i));
    ASSERT_EQ(partners.size(), 1u);
    EXPECT_EQ(partners.front().id.value, dinner::kFirstPartners[i]);
  }
}

/// Equations (4)-(5) with plain numbers and the whole adjacency matrix, written a second time.
struct DumbKalman {
  std::vector<double> x, P;
  bool self_term;

  void step(const Graph& graph) {
    const std::vector<double> x_old = x, P_old = P;
    for (std::size_t i = 0; i < x.size(); ++i) {
      double information = 1.0 / (P_old[i] + dinner::kQ), pull = 0.0;
      for (std::size_t j = 0; j < x.size(); ++j) {
        const bool hears = (i == j && self_term) || (i != j && graph.has({agent_at(j), agent_at(i)}));
        if (!hears) continue;
        information += 1.0 / (P_old[j] + dinner::kOmega);
        pull += (x_old[j] - x_old[i]) / (P_old[j] + dinner::kOmega);
      }
      P[i] = 1.0 / information;
      x[i] = x_old[i] + P[i] * pull;
    }
  }
};

class Dinner : public testing::TestWithParam<dinner::Expected> {};

TEST_P(Dinner, Equations4And5MatchASecondImplementationInEveryRound) {
  const Experiment e = dinner::experiment(GetParam().leader, GetParam().self_term);
  const Trace trace = simulate(e, e.protocols[0], e.seed);
  const Schedule schedule = e.schedule(e.seed);
  DumbKalman dumb{dinner::x(), dinner::P(GetParam().leader), GetParam().self_term};
  for (Round k = 0; k < dinner::kRounds; ++k) {
    dumb.step(*schedule.at(k));
    for (std::size_t i = 0; i < e.agents; ++i) ASSERT_NEAR(trace.at(k + 1, agent_at(i))[0], dumb.x[i], 1e-9) << "round " << k;
  }
  for (const double P : dumb.P) EXPECT_NEAR(P, GetParam().P_limit, 1e-9);
}

TEST_P(Dinner, EverybodyReachesTheFixtureValue) {
  const Experiment e = dinner::experiment(GetParam().leader, GetParam().self_term);
  const Trace trace = simulate(e, e.protocols[0], e.seed);
  for (const double x : finals(trace)) EXPECT_NEAR(x, GetParam().x_limit, 5e-7);
}

TEST_P(Dinner, SpreadFallsBelowOneThousandthInTheFixtureRound) {
  const Experiment e = dinner::experiment(GetParam().leader, GetParam().self_term);
  const Trace trace = simulate(e, e.protocols[0], e.seed);
  std::size_t report = 0;
  while (spread_at(trace, report) >= 1e-3) ++report;
  EXPECT_EQ(trace.rounds[report], GetParam().rounds_to_spread_below_1e_3);
}

INSTANTIATE_TEST_SUITE_P(Fixtures, Dinner, testing::Values(dinner::kEqual, dinner::kLeader),
                         [](const auto& fixture) { return fixture.param.leader ? "Leader" : "Equal"; });

TEST(KalmanConsensus, Figure1LeaderPullsTheValueTowardsItself) {
  const Experiment equal = dinner::experiment(false, true), leader = dinner::experiment(true, true);
  const double without = mean(finals(simulate(equal, equal.protocols[0], equal.seed)));
  const double with = mean(finals(simulate(leader, leader.protocols[0], leader.seed)));
  EXPECT_GT(with, without + 0.1);  // the leader starts at 7, the largest value
}

/// Over the runs: mean and standard deviation of the agents' final mean, and mean of the standard deviation among the agents.
struct Statistics {
  std::vector<double> means, deviations;

  void add(const std::vector<double>& final_estimates) {
    means.push_back(mean(final_estimates));
    deviations.push_back(deviation(final_estimates));
  }
  /// Both sides are samples of 300 runs, hence the root of two; `noises` is the number of equal noises per agent and round, of the
  /// fixture's two.
  void expect(double noises) const {
    const double scale = std::sqrt(noises / 2.0), sigma = dinner::kNoisyStd * scale, runs = dinner::kNoisyRuns;
    EXPECT_NEAR(mean(means), dinner::kNoisyMean, 3 * std::sqrt(2.0) * sigma / std::sqrt(runs));
    EXPECT_NEAR(deviation(means), sigma, 3 * std::sqrt(2.0) * sigma / std::sqrt(2 * runs));
    EXPECT_NEAR(mean(deviations), dinner::kNoisyAmongAgents * scale, 3 * std::sqrt(2.0) * deviation(deviations) / std::sqrt(runs) + 0.005);
  }
};

TEST(KalmanConsensus, NoisyFixtureStatisticsHoldWhenEveryAgentHearsItselfThroughANoisyLinkToo) {
  // The letter of (4)-(5) with g_ii = 1: the agent's own message is in its inbox, disturbed by nu_ii.
  using Kalman = KalmanConsensus<1>;
  const Eigen::Matrix<double, 1, 1> variance(0.1);
  const Kalman::Params params{variance, variance, false};
  const FixedSchedule matchings = dinner::matchings();
  const Schedule schedule(dinner::kAgents, matchings, {}, Seed{1});
  Statistics statistics;
  for (int run = 0; run < dinner::kNoisyRuns; ++run) {
    Stream noise = Seed{static_cast<std::uint64_t>(run)}.stream(Purpose("test noise"));
    auto states = direct::states<Kalman>(params, dinner::x(), dinner::P(true));
    const auto disturb = [&](Kalman::Message& message) { message.x[0] += std::sqrt(dinner::kNoise) * noise.normal(); };
    for (Round k = 0; k < dinner::kRounds; ++k)
      states = direct::advance<Kalman>(params, states, *schedule.at(k), {.k = k, .with_self = true, .disturb = disturb});
    std::vector<double> x;
    for (const auto& state : states) x.push_back(state.x[0]);
    statistics.add(x);
  }
  statistics.expect(2);
}

TEST(KalmanConsensus, NoisyLinksGiveTheFixtureStatisticsWithoutTheNoiseOfTheSelfTerm) {
  Experiment e = dinner::experiment(true, true);
  e.report_every = e.rounds;
  e.links.standard.noise_covariance = Matrix::Constant(1, 1, dinner::kNoise);
  Statistics statistics;
  for (int run = 0; run < dinner::kNoisyRuns; ++run)
    statistics.add(finals(simulate(e, e.protocols[0], Seed{static_cast<std::uint64_t>(run + 1)})));
  statistics.expect(1);  // nobody disturbs what an agent knows of itself: one noise per agent and round
}

TEST(KalmanConsensus, Theorem39DirectedChainFollowsItsRoot) {
  std::vector<std::pair<unsigned, unsigned>> edges;
  for (unsigned i = 1; i < dinner::kAgents; ++i) edges.emplace_back(i, i + 1);
  Experiment e = dinner::experiment(false, false);
  auto x = dinner::x();
  x.front() = 7.0;
  e.initial[0].values = per_agent(x);
  e.topology = always(graph_of(dinner::kAgents, edges));
  EXPECT_FALSE(strongly_connected(*graph_of(dinner::kAgents, edges)));
  for (const double value : finals(simulate(e, e.protocols[0], e.seed))) EXPECT_NEAR(value, 7.0, 5e-5);
}

}  // namespace
}  // namespace consort
