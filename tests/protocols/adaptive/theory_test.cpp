// What `validate` says of experiments whose agents adapt coupling gains.

#include "protocols/theory.hpp"
#include "orchestrator/script/script.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

using Verdict = Rating;

const std::string kRing = "topology: ring\n";
const std::string kIntegrators = "plant: {model: {name: integrator, order: 2}, initial: {position: {linspace: [-1, 1]}}}\n";

std::vector<Finding> findings(const std::string& agents, const std::string& rest) {
  return examine(parse_experiment("experiment: t\nagents: {" + agents + "}\n" + rest, "t.yaml", "."));
}

/// The only finding whose condition begins so.
Finding only(const std::vector<Finding>& all, const std::string& condition) {
  std::vector<Finding> out;
  for (const auto& finding : all)
    if (finding.condition.starts_with(condition)) out.push_back(finding);
  EXPECT_EQ(out.size(), 1u) << condition;
  return out.empty() ? Finding{} : out.front();
}

#define EXPECT_SAYS(text, where) EXPECT_PRED_FORMAT2(testing::IsSubstring, text, where)

TEST(AdaptiveTheory, AcceptsARingOfDoubleIntegrators) {
  const auto all = findings("count: 10, protocol: adaptive_consensus", kRing + kIntegrators + "dt: 0.001\nduration: 1 s\n");
  EXPECT_EQ(only(all, "adaptive_consensus: strongly connected, or a leader").verdict, Verdict::holds);
  EXPECT_EQ(only(all, "adaptive_consensus: (A, B) is stabilisable").verdict, Verdict::holds);
  const Finding step = only(all, "adaptive_consensus: dt < 2 / (c lambda_max(K B) lambda_max(L))");
  EXPECT_EQ(step.verdict, Verdict::note);
  EXPECT_SAYS("gains up to 288.675", step.evidence);  // 2 / (0.001 sqrt3 4)
}

TEST(AdaptiveTheory, ReportsAStepTooLargeForAGainItKnows) {
  const auto all =
      findings("count: 10, protocol: adaptive_consensus, initial: {kappa: 31.7}", kRing + kIntegrators + "dt: 0.02\nduration: 1 s\n");
  const Finding step = only(all, "adaptive_consensus: dt <");
  EXPECT_EQ(step.verdict, Verdict::fails);
  EXPECT_SAYS("kappa = 31.7", step.evidence);
  EXPECT_SAYS("14.4338", step.evidence);
}

TEST(AdaptiveTheory, APairThatIsNotStabilisableIsRefusedWithItsEigenvalue) {
  try {
    findings("count: 3, protocol: adaptive_consensus",
             kRing + "plant: {model: {name: linear, A: [[0.5, 0], [0, -1]], B: [[0], [1]]}}\ndt: 0.01\nrounds: 10\n");
    FAIL() << "no gain exists for this plant";
  } catch (const ConfigError& error) {
    EXPECT_SAYS("(A, B) is not stabilisable: B does not reach the eigenvalue 0.5 of A", std::string(error.what()));
  }
}

TEST(AdaptiveTheory, ReportsAGraphWithoutASpanningTree) {
  const auto all = findings("count: 4, protocol: adaptive_consensus",
                            "topology: {edges: [1 <-> 2, 3 <-> 4]}\n" + kIntegrators + "dt: 0.01\nrounds: 10\n");
  const Finding finding = only(all, "adaptive_consensus: strongly connected, or a leader");
  EXPECT_EQ(finding.verdict, Verdict::fails);
  EXPECT_SAYS("no spanning tree", finding.consequence);
}

TEST(AdaptiveTheory, LooksAtTheAgentsThatAreThereOnly) {
  const auto all = findings("count: 3, protocol: adaptive_consensus", "topology: {edges: [1 <-> 2, 2 <-> 3]}\n" + kIntegrators +
                                                                          "dt: 0.01\nrounds: 20\nevents: [{round: 10, join: 3}]\n");
  EXPECT_EQ(only(all, "adaptive_consensus: strongly connected, or a leader").verdict, Verdict::holds);
}

const std::string kEigenvalue = "protocol: {name: adaptive_consensus, reference: eigenvalue, xi: 35, window: ";
const std::string kArtificial = "initial: {r: {uniform: [-1, 1]}, q: {uniform: [-1, 1]}}";

TEST(AdaptiveTheory, SaysWhetherTheWindowResolvesTheSmallestEigenvalue) {
  const std::string rest = kRing + kIntegrators + "dt: 0.002\nduration: 1 s\n";
  auto all = findings("count: 50, " + kEigenvalue + "10}, " + kArtificial, rest);
  const Finding finding = only(all, "adaptive_consensus: xi lambda_2 window >= 4 pi");
  EXPECT_EQ(finding.verdict, Verdict::fails);
  EXPECT_SAYS("5.5197", finding.evidence);  // 35 * 0.0157706 * 10
  EXPECT_EQ(only(all, "adaptive_consensus: xi lambda_max < pi f_s").verdict, Verdict::holds);
  EXPECT_EQ(only(all, "adaptive_consensus: undirected, for the estimation").verdict, Verdict::holds);
  all = findings("count: 50, " + kEigenvalue + "40}, " + kArtificial, rest);
  EXPECT_EQ(only(all, "adaptive_consensus: xi lambda_2 window >= 4 pi").verdict, Verdict::holds);
  EXPECT_SAYS("1 / (2 lambda_2) = 31.7", only(all, "adaptive_consensus: dt <").evidence);
}

TEST(AdaptiveTheory, SaysThatAlgorithm42NeedsAnUndirectedGraphAndFastSampling) {
  const auto all = findings("count: 5, protocol: {name: adaptive_consensus, reference: eigenvalue, xi: 100, sampling: 20}, " + kArtificial,
                            "topology: directed_ring\n" + kIntegrators + "dt: 0.01\nduration: 1 s\n");
  EXPECT_EQ(only(all, "adaptive_consensus: undirected, for the estimation").verdict, Verdict::fails);
  EXPECT_EQ(only(all, "adaptive_consensus: xi lambda_max < pi f_s").verdict, Verdict::fails);
  EXPECT_EQ(only(all, "adaptive_consensus: dt xi lambda_max < 1").verdict, Verdict::fails);
}

TEST(AdaptiveTheory, AsksOfTheOthersWhatTheirSourcesAsk) {
  const std::string times = "dt: 0.001\nrounds: 10\n", led = "topology: {edges: [3 -> 1, 1 <-> 2]}\n",
                    chain = "topology: {edges: [3 -> 1, 1 -> 2]}\n";
  const auto verdict = [&](const std::string& protocol, const std::string& topology) {
    const auto all = findings("count: 3, protocol: " + protocol, topology + kIntegrators + times);
    return std::find_if(all.begin(), all.end(), [&](const Finding& finding) { return finding.condition.starts_with(protocol + ":"); })
        ->verdict;
  };
  EXPECT_EQ(verdict("li_edge_consensus", kRing), Verdict::holds);
  EXPECT_EQ(verdict("li_edge_consensus", "topology: directed_ring\n"), Verdict::fails);
  EXPECT_EQ(verdict("li_agent_consensus", chain), Verdict::holds);
  EXPECT_EQ(verdict("li_agent_consensus", kRing), Verdict::fails);
  EXPECT_EQ(verdict("yu_consensus", led), Verdict::holds);
  EXPECT_EQ(verdict("yu_consensus", kRing), Verdict::holds);
  EXPECT_EQ(verdict("yu_consensus", chain), Verdict::fails);
  EXPECT_EQ(verdict("su_consensus", led), Verdict::holds);
  EXPECT_EQ(verdict("su_consensus", kRing), Verdict::fails);
}

TEST(AdaptiveTheory, KnowsThatTheSixthPowerOfLargeDifferencesNeedsTinySteps) {
  const auto all = findings("count: 2, protocol: li_agent_consensus",
                            "topology: {edges: [2 -> 1]}\nplant: {model: {name: integrator, order: 2}, initial: {position: [10, 0]}}\ndt: "
                            "0.001\nrounds: 10\n");
  const Finding step = only(all, "li_agent_consensus: dt <");
  EXPECT_EQ(step.verdict, Verdict::fails);
  EXPECT_SAYS("c(0) rho(0)", step.evidence);
}

TEST(AdaptiveTheory, KnowsTheStepOfAFixedCoupling) {
  const auto verdict = [](const std::string& dt) {
    return only(findings("count: 3, protocol: das_neural_consensus",
                         "topology: ring\nplant: {model: sine_drift}\ndt: " + dt + "\nrounds: 10\n"),
                "das_neural_consensus: dt <")
        .verdict;
  };
  EXPECT_EQ(verdict("0.001"), Verdict::holds);
  EXPECT_EQ(verdict("0.05"), Verdict::fails);  // 2 / (20 * 3) = 0.033
}

}  // namespace
}  // namespace consort
