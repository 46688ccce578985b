#include "protocols/theory_case.hpp"

#include "core/errors.hpp"
#include "orchestrator/script/script.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace consort {
namespace {

using Verdict = Rating;

#define EXPECT_SAYS(text, where) EXPECT_PRED_FORMAT2(testing::IsSubstring, text, where)

/// The only finding about `text` + "\n" whose condition begins so.
Finding only(const std::string& text, const std::string& condition) {
  std::vector<Finding> out;
  for (const auto& finding : examine(parse_experiment("experiment: t\nrounds: 100\n" + text + "\n", "t.yaml", ".")))
    if (finding.condition.starts_with(condition)) out.push_back(finding);
  EXPECT_EQ(out.size(), 1U) << condition;
  return out.empty() ? Finding{} : out.front();
}

std::string static_consensus(int count, const std::string& c, const std::string& topology, const std::string& dt = "0.01") {
  return "agents: {count: " + std::to_string(count) + ", protocol: {name: static_consensus, c: " + c +
         "}}\nplant: {model: {name: integrator, order: 2}}\ndt: " + dt + "\ntopology: " + topology;
}

TEST(TheoryControl, ComparesTheCouplingGainWithItsBound) {
  const std::string condition = "static_consensus: c >= 1 / (2 min Re lambda)";
  const Finding low = only(static_consensus(10, "1.2", "ring"), condition);
  EXPECT_EQ(low.verdict, Verdict::fails);
  EXPECT_SAYS("c = 1.2, the bound is 1.30902", low.evidence);
  EXPECT_EQ(only(static_consensus(10, "1.309017", "ring"), condition).verdict, Verdict::holds);
  EXPECT_SAYS("the bound is 31.7046", only(static_consensus(50, "32", "ring"), condition).evidence);
  EXPECT_SAYS("the bound is 1", only(static_consensus(6, "1", "directed_ring"), condition).evidence);
  const Finding torn = only(static_consensus(4, "9", "{edges: [1 <-> 2, 3 <-> 4]}"), condition);
  EXPECT_EQ(torn.verdict, Verdict::fails);
  EXPECT_SAYS("no spanning tree", torn.evidence);
  const std::string stabilisable = "static_consensus: (A, B) is stabilisable";
  EXPECT_EQ(only(static_consensus(10, "2", "ring"), stabilisable).verdict, Verdict::holds);
}

TEST(TheoryControl, RefusesAPairThatIsNotStabilisableNamingTheCondition) {
  try {
    static_cast<void>(
        parse_experiment("experiment: t\nrounds: 9\nagents: {count: 2, protocol: {name: static_consensus, c: 1}}\n"
                         "plant: {model: {name: linear, A: [[1, 0], [0, -1]], B: [[0], [1]]}}\ntopology: ring\n",
                         "t.yaml", "."));
    FAIL() << "an unstable mode that no control reaches was accepted";
  } catch (const ConfigError& error) {
    EXPECT_SAYS("stabilisable", std::string(error.what()));
  }
}

TEST(TheoryControl, FindsTheLongestStepOfTheStaticLoop) {
  // Two double integrators: one mode, lambda = 2. With c = 1 the sampled loop z^2 + (a h^2/2 + b h - 2) z + (a h^2/2 - b h + 1), a = 2,
  // b = 2 sqrt 3, leaves the unit circle at z = -1: 4 - 2 b h = 0, h = 1 / sqrt 3.
  const std::string condition = "static_consensus: dt is short enough";
  EXPECT_SAYS("allowed below 0.57735", only(static_consensus(2, "1", "ring"), condition).evidence);
  EXPECT_EQ(only(static_consensus(2, "1", "ring", "0.577"), condition).verdict, Verdict::holds);
  EXPECT_EQ(only(static_consensus(2, "1", "ring", "0.578"), condition).verdict, Verdict::fails);
}

TEST(TheoryControl, LargestStableStepHandlesLoopsThatAreNeverOrAlwaysStable) {
  EXPECT_NEAR(largest_stable_step([](double h) { return std::abs(1.0 - 3.0 * h); }, 1e-3), 2.0 / 3.0, 1e-6);
  EXPECT_EQ(largest_stable_step([](double h) { return 1.0 + h; }, 1e-3), 0.0);
  EXPECT_EQ(largest_stable_step([](double h) { return std::exp(-h); }, 1e-3), std::numeric_limits<double>::infinity());
}

std::string complete_100(const std::string& protocol, const std::string& dt, const std::string& sensing = "neighbours") {
  return "agents: {count: 100, protocol: " + protocol + ", initial: {x: 0}}\nplant: {model: integrator, sensing: " + sensing +
         "}\ndt: " + dt + "\ntopology: complete";
}

TEST(TheoryControl, GivesTheStepsOfTheCoherenceExample) {
  const std::string filtered = "minimum_energy_consensus: dt is short enough", direct = "measured_consensus: dt is short enough";
  EXPECT_SAYS("allowed below 0.0350", only(complete_100("minimum_energy_consensus", "0.002"), filtered).evidence);
  EXPECT_SAYS("allowed below 0.01819", only(complete_100("{name: minimum_energy_consensus, S: 1}", "0.002"), filtered).evidence);
  EXPECT_SAYS("allowed below 0.02", only(complete_100("measured_consensus", "0.002"), direct).evidence);
  EXPECT_EQ(only(complete_100("measured_consensus", "0.0199"), direct).verdict, Verdict::holds);
  EXPECT_EQ(only(complete_100("measured_consensus", "0.0201"), direct).verdict, Verdict::fails);
  EXPECT_EQ(only(complete_100("minimum_energy_consensus", "0.036"), filtered).verdict, Verdict::fails);
}

TEST(TheoryControl, AsksForSensedNeighboursAndStrongConnection) {
  for (const std::string protocol : {"minimum_energy_consensus", "measured_consensus"}) {
    EXPECT_EQ(only(complete_100(protocol, "0.01", "own"), protocol + ": agents measure").verdict, Verdict::fails);
    EXPECT_EQ(only(complete_100(protocol, "0.01"), protocol + ": agents measure").verdict, Verdict::holds);
  }
  const std::string chain =
      "agents: {count: 3, protocol: minimum_energy_consensus, initial: {x: 0}}\nplant: {model: integrator, sensing: neighbours}\n"
      "dt: 0.01\ntopology: {edges: [1 -> 2 -> 3]}";
  EXPECT_EQ(only(chain, "minimum_energy_consensus: strongly connected").verdict, Verdict::fails);
}

TEST(TheoryControl, LocalVotingWithAPlantConvergesToTheWeightedStates) {
  const std::string leader =
      "agents: {count: 3, protocol: local_voting}\nplant: {model: integrator, initial: {position: [1, 2, 7]}}\ndt: 0.1\n"
      "topology: {edges: [3 -> 1 -> 2]}";
  EXPECT_SAYS("w^T x(0) = 7,", only(leader, "local_voting: all eigenvalues").consequence);
}

TEST(TheoryControl, GivesTheStepOfContinuousKalmanConsensus) {
  // Equal agents in a pair: gain P / (P + Omega) = 1 / 1.5.
  const auto pair = [](const std::string& more, const std::string& dt) {
    return "agents: {count: 2, protocol: {name: continuous_kalman_consensus, Omega: 0.5" + more +
           "}, initial: {x: [1, 2], P: 1}}\ndt: " + dt + "\ntopology: ring";
  };
  const std::string condition = "continuous_kalman_consensus: the integration steps";
  const Finding good = only(pair("", "0.01"), condition);
  EXPECT_EQ(good.verdict, Verdict::holds);
  EXPECT_SAYS("largest gain at the start 0.666667", good.evidence);
  EXPECT_SAYS("allowed below 1.5 (Euler)", only(pair(", method: euler", "0.01"), condition).evidence);
  EXPECT_EQ(only(pair(", method: euler", "1.6"), condition).verdict, Verdict::fails);
  EXPECT_EQ(only(pair(", method: euler, steps: 2", "1.6"), condition).verdict, Verdict::holds);
}

}  // namespace
}  // namespace consort
