#include "protocols/theory.hpp"

#include "core/errors.hpp"
#include "core/network/survey.hpp"
#include "orchestrator/script/script.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace consort {
namespace {

using Verdict = Rating;

std::vector<Finding> findings(const std::string& agents, const std::string& rest) {
  return examine(parse_experiment("experiment: t\nagents: {" + agents + "}\n" + rest + "\n", "t.yaml", "."));
}

// The only finding whose condition begins so.
Finding only(const std::vector<Finding>& all, const std::string& condition) {
  std::vector<Finding> out;
  for (const auto& finding : all)
    if (finding.condition.starts_with(condition)) out.push_back(finding);
  EXPECT_EQ(out.size(), 1u) << condition;
  return out.empty() ? Finding{} : out.front();
}

#define EXPECT_SAYS(text, where) EXPECT_PRED_FORMAT2(testing::IsSubstring, text, where)

const std::string kFigure1 = "topology: {edges: [1 -> 2, 1 -> 3, 2 -> 3, 3 -> 1]}";
const std::string kListeners = "kalman_consensus: in every round all agents have the same number of listeners";
const std::string kStarts = "initial: {x: [4, 5, 6]}, count: 3, ";

TEST(Theory, PredictsTheBiasedLimitOfKalmanConsensus) {
  // Alighanbari, How 2006, Figure 1: 4.89, centralised 5.
  const auto all = findings(kStarts + "protocol: kalman_consensus", kFigure1);
  const Finding f = only(all, kListeners);
  EXPECT_EQ(f.verdict, Verdict::fails);
  EXPECT_SAYS("limit 4.89456, centralised 5", f.consequence);
  const Finding graphs = only(all, "the graphs");
  EXPECT_EQ(graphs.verdict, Verdict::note);
  EXPECT_EQ(graphs.evidence, "strongly connected in every round; balanced in no round; a spanning tree in every round");
}

TEST(Theory, SeesThatBalanceAloneDoesNotMakeKalmanConsensusUnbiased) {
  // An undirected path is balanced, but its middle has two listeners: w = (1, sqrt 2, 1) on information, so 5 moves with unequal starts.
  const auto all = findings("initial: {x: [4, 5, 9]}, count: 3, protocol: kalman_consensus", "topology: path");
  EXPECT_SAYS("; balanced in every round", only(all, "the graphs").evidence);
  const Finding f = only(all, kListeners);
  EXPECT_EQ(f.verdict, Verdict::fails);
  const double limit = (4 + std::sqrt(2.0) * 5 + 9) / (2 + std::sqrt(2.0));
  EXPECT_SAYS("limit " + std::to_string(limit).substr(0, 6), f.consequence);
  EXPECT_EQ(only(findings(kStarts + "protocol: kalman_consensus", "topology: directed_ring"), kListeners).verdict, Verdict::holds);
}

TEST(Theory, AsksUnbiasedConsensusForStrongConnectionInEveryRound) {
  const std::string ring_then_chain =
      "rounds: 20\ntopology: {intervals: [{rounds: 7, topology: directed_ring}, {rounds: 1, topology: {edges: [1 -> 2 -> 3]}}]}";
  const Finding bad =
      only(findings(kStarts + "protocol: unbiased_kalman_consensus", ring_then_chain), "unbiased_kalman_consensus: strongly connected");
  EXPECT_EQ(bad.verdict, Verdict::fails);
  EXPECT_SAYS("not in 13 of 20 rounds, first in round 7", bad.evidence);
  EXPECT_SAYS("Theorem 7", bad.consequence);
  const Finding good =
      only(findings(kStarts + "protocol: unbiased_kalman_consensus", kFigure1), "unbiased_kalman_consensus: strongly connected");
  EXPECT_EQ(good.verdict, Verdict::holds);
  EXPECT_SAYS("centralised estimate 5 ", good.consequence);
  const Finding noisy = only(findings(kStarts + "protocol: {name: unbiased_kalman_consensus, Omega: 0.01}", kFigure1),
                             "unbiased_kalman_consensus: strongly connected");
  EXPECT_EQ(noisy.verdict, Verdict::fails);
  EXPECT_SAYS("Q or Omega is above 0", noisy.evidence);
}

TEST(Theory, GivesTheStepAndTheValueOfLocalVoting) {
  // Ring of 4: Laplacian eigenvalues 0, 2, 2, 4, so dt < 0.5.
  const std::string agents = "initial: {x: [1, 2, 3, 6]}, count: 4, protocol: local_voting";
  const Finding good = only(findings(agents, "dt: 0.25\ntopology: ring"), "local_voting: all eigenvalues");
  EXPECT_EQ(good.verdict, Verdict::holds);
  EXPECT_SAYS("largest modulus 0.5; dt = 0.25, allowed below 0.5", good.evidence);
  EXPECT_SAYS("w^T x(0) = 3,", good.consequence);
  EXPECT_EQ(only(findings(agents, "dt: 0.5\ntopology: ring"), "local_voting: all eigenvalues").verdict, Verdict::fails);
  // A chain of command: everybody follows agent 1.
  EXPECT_SAYS("w^T x(0) = 1,",
              only(findings(agents, "dt: 0.5\ntopology: {edges: [1 -> 2 -> 3 -> 4]}"), "local_voting: all eigenvalues").consequence);
  // No spanning tree: a second eigenvalue 0.
  EXPECT_EQ(only(findings(agents, "dt: 0.1\ntopology: {edges: [1 -> 2, 3 -> 4]}"), "local_voting: all eigenvalues").verdict,
            Verdict::fails);
}

TEST(Theory, NamesTheRemedyThatHelps) {
  const auto remedy = [](const std::string& agents, const std::string& rest, const std::string& condition) {
    const Finding f = only(findings(agents, rest), condition);
    EXPECT_EQ(f.verdict, Verdict::fails) << rest;
    return f.consequence;
  };
  const std::string voting = "initial: {x: [1, 2, 3, 6]}, count: 4, protocol: local_voting", eigenvalues = "local_voting: all eigenvalues";
  EXPECT_SAYS("take a shorter dt", remedy(voting, "dt: 0.6\ntopology: ring", eigenvalues));
  EXPECT_SAYS("so short that a round changes nothing, take a longer one", remedy(voting, "dt: 1.0e-308\ntopology: ring", eigenvalues));
  EXPECT_SAYS("take a graph with a spanning tree", remedy(voting, "dt: 0.1\ntopology: {edges: [1 -> 2, 3 -> 4]}", eigenvalues));
  const std::string large = "initial: {x: 1}, count: 3000, protocol: local_voting";  // more than eigenvalues are worked out for
  EXPECT_SAYS("take a longer one", remedy(large, "dt: 1.0e-308\ntopology: ring", eigenvalues));
  EXPECT_SAYS("take a shorter dt", remedy(large, "dt: 0.9\ntopology: ring", eigenvalues));
  const std::string steering =
      "plant: {model: {name: linear, A: [[0, 1], [0, 0]], B: [0, 1]}, sensing: neighbours, initial: {x: {all: [0, 1]}}}\ntopology: ring\n";
  const std::string held = "static_consensus: dt is short enough";
  EXPECT_SAYS("take a shorter dt", remedy("count: 4, protocol: {name: static_consensus, c: 1}", steering + "dt: 5", held));
  EXPECT_SAYS("take a longer one", remedy("count: 4, protocol: {name: static_consensus, c: 1}", steering + "dt: 1.0e-300", held));
}

TEST(Theory, FindsTheSmallestWindowWhoseUnionSpans) {
  const std::string agents = kStarts + "protocol: kalman_consensus";
  const std::string alternating =
      "rounds: 40\ntopology: {periodic: [{rounds: 3, topology: {edges: [1 -> 2]}}, {rounds: 2, topology: {edges: [2 -> 3]}}]}";
  const Finding f = only(findings(agents, alternating), "kalman_consensus: the union");
  EXPECT_EQ(f.verdict, Verdict::holds);
  EXPECT_SAYS("over every 4 rounds on end", f.evidence);  // a window that begins with the three rounds of 1 -> 2
  EXPECT_SAYS("Theorem 3.9", f.consequence);
  EXPECT_SAYS("in every single round", only(findings(agents, kFigure1), "kalman_consensus: the union").evidence);
  const Finding never = only(findings(agents, "topology: {edges: [1 <-> 2]}"), "kalman_consensus: the union");
  EXPECT_EQ(never.verdict, Verdict::fails);
  const Finding cut = only(findings(agents, "topology: path\nevents: [{round: 60, cut: [1 <-> 2]}]"), "kalman_consensus: the union");
  EXPECT_EQ(cut.verdict, Verdict::fails);
  EXPECT_SAYS("not from round 60 on", cut.evidence);
}

TEST(Theory, SaysThatARandomScheduleWasSampled) {
  const std::string agents = "initial: {x: 1}, count: 10, protocol: kalman_consensus";
  EXPECT_SAYS("drawn with seed 1", only(findings(agents, "topology: random_pairs"), "what was examined").consequence);
  EXPECT_SAYS("exact", only(findings(agents, "topology: ring"), "what was examined").consequence);
}

TEST(Theory, WarnsOfLossNoiseDelayAndIdleExceptions) {
  const auto all =
      findings(kStarts + "protocol: unbiased_kalman_consensus",
               kFigure1 + "\nlinks: {loss: 0.1, noise_covariance: 0.1, delay_rounds: 1, overrides: [{edge: 3 -> 2, loss: 0}]}");
  EXPECT_EQ(only(all, "links lose messages").verdict, Verdict::note);
  const Finding loss = only(all, "unbiased_kalman_consensus: no loss");
  EXPECT_EQ(loss.verdict, Verdict::fails);
  EXPECT_SAYS("biased", loss.consequence);
  EXPECT_SAYS("wanders", only(all, "links add noise").consequence);
  EXPECT_SAYS("do not cover", only(all, "links delay messages").consequence);
  EXPECT_SAYS("no effect", only(all, "link override on 3 -> 2").consequence);
  EXPECT_EQ(findings(kStarts + "protocol: unbiased_kalman_consensus", kFigure1).size() + 4, all.size());
}

// The window, found the slow way: every w from 1 on, every start.
std::optional<Round> slow_window(const Schedule& schedule, Round rounds) {
  for (Round w = 1; w <= rounds; ++w) {
    bool all = true;
    for (Round k = 0; k + w <= rounds && all; ++k) all = has_spanning_tree(schedule.union_over(k, w));
    if (all) return w;
  }
  return std::nullopt;
}

TEST(Survey, WindowEqualsTheSlowSearch) {
  constexpr Round kRounds = 60;
  std::size_t compared = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    const Schedule::Spec spec =
        seed % 2 == 0
            ? Schedule::Spec(RandomPairs{1, 4})
            : Schedule::Spec(RandomLinks{std::make_shared<const Graph>(directed_ring(6)), 0.3 + 0.6 * static_cast<double>(seed % 10) / 10});
    const Schedule schedule(6, spec, {}, Seed{seed});
    const auto fast = survey(schedule, kRounds, 1e9).spanning();
    if (!fast.window) continue;  // declared broken: the tail is longer than any window before it
    EXPECT_EQ(fast.window, slow_window(schedule, kRounds));
    ++compared;
  }
  EXPECT_GT(compared, 150u);
}

}  // namespace
}  // namespace consort
