// The adaptive protocols that Knotek's thesis compares with (section 4.1), as it prints them with the signs corrected: what each does on
// its fixture.

#include "tests/papers/adaptive_cases.hpp"

#include <gtest/gtest.h>

#include <numeric>

namespace consort {
namespace {

using namespace adaptive;

constexpr AgentId kLeader{5};

/// Four double integrators on an undirected ring; the fifth agent leads with p = t and is heard by agent 1.
Experiment ring_of_four_with_leader(const std::string& protocol, Seconds duration) {
  const auto graph = seeds::graph_of(5, {{1, 2}, {2, 1}, {2, 3}, {3, 2}, {3, 4}, {4, 3}, {4, 1}, {1, 4}, {5, 1}});
  Experiment e = experiment(protocol, *graph, {3, -2, 1, 4, 0}, {}, duration);
  e.plant->initial.push_back({"velocity", each({0, 0, 0, 0, 1})});
  return e;
}

/// Largest distance from the leader in each component of the state, at the end.
Vector distance_from_leader(const Trace& trace, AgentId leader) {
  const std::size_t last = trace.rounds.size() - 1;
  const auto state = [&](AgentId i) {
    return Eigen::Map<const Vector>(trace.state_at(last, i).data(), static_cast<Eigen::Index>(trace.state_dimension));
  };
  Vector distance = Vector::Zero(static_cast<Eigen::Index>(trace.state_dimension));
  for (std::size_t i = 0; i < trace.agents; ++i) distance = distance.cwiseMax((state(agent_at(i)) - state(leader)).cwiseAbs());
  return distance;
}

/// Largest change of a recorded number of any agent over the last `reports` reports.
double drift_at_the_end(const Trace& trace, std::size_t reports) {
  const std::size_t last = trace.rounds.size() - 1;
  double largest = 0.0;
  for (std::size_t i = 0; i < trace.agents; ++i)
    for (std::size_t c = 0; c < trace.dimension; ++c)
      largest = std::max(largest, std::abs(trace.at(last, agent_at(i))[c] - trace.at(last - reports, agent_at(i))[c]));
  return largest;
}

TEST(SuConsensus, FollowsTheLeaderAndItsGainsSettle) {
  const Trace trace = trace_of(ring_of_four_with_leader("su_consensus", 80));
  const Vector distance = distance_from_leader(trace, kLeader);
  EXPECT_LE(distance[0], 1e-6);  // p = p0
  EXPECT_LE(distance[1], 1e-6);  // v = 1
  EXPECT_NEAR(trace.state_at(trace.rounds.size() - 1, AgentId{1})[1], 1.0, 1e-6);
  EXPECT_LE(drift_at_the_end(trace, 100), 1e-8);
  EXPECT_GT(trace.final_estimate(AgentId{1})[0], 1.0) << "the pinned agent has learnt";
  EXPECT_EQ(trace.final_estimate(AgentId{2})[0], 0.01) << "the others never hear the leader";
}

TEST(SuConsensus, GainsNeverFall) {
  const Trace trace = trace_of(ring_of_four_with_leader("su_consensus", 20));
  for (std::size_t report = 1; report < trace.rounds.size(); ++report)
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t c = 0; c < 2; ++c) ASSERT_GE(trace.at(report, agent_at(i))[c], trace.at(report - 1, agent_at(i))[c]);
}

TEST(YuConsensus, FollowsTheLeaderWithTheSignCorrectedAndItsGainsSettle) {
  const Trace at_40 = trace_of(ring_of_four_with_leader("yu_consensus", 40));
  EXPECT_LE(drift_at_the_end(at_40, 50), 0.01);
  EXPECT_LE(distance_from_leader(at_40, kLeader).maxCoeff(), 0.1);
  const Trace at_80 = trace_of(ring_of_four_with_leader("yu_consensus", 80));
  EXPECT_LE(distance_from_leader(at_80, kLeader).maxCoeff(), 0.01);
}

TEST(YuConsensus, AgreesWithoutALeaderToo) {
  Experiment e = experiment("yu_consensus", ring(4), {3, -2, 1, 4}, {}, 80);
  EXPECT_LE(run(e).at("consensus_time"), 80.0);
}

TEST(LiAgentConsensus, FollowsTheLeaderOnADirectedGraphWithin5e5) {
  Experiment e =
      experiment("li_agent_consensus", *seeds::graph_of(4, {{4, 1}, {1, 2}, {2, 3}, {3, 1}}), {0.3, -0.2, 0.1, 0.0}, {}, 30, 5e-4);
  e.plant->initial.push_back({"velocity", same(1.0)});
  const Trace trace = trace_of(e);
  EXPECT_LE(distance_from_leader(trace, AgentId{4}).maxCoeff(), 5e-5);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_GE(trace.final_estimate(agent_at(i))[0], 1.0);
}

TEST(LiAgentConsensus, RunsAwayWithLargeDifferencesBecauseTheFactorGrowsWithTheirSixthPower) {
  Experiment e = experiment("li_agent_consensus", *seeds::graph_of(4, {{4, 1}, {1, 2}, {2, 3}, {3, 1}}), {10, -8, 5, 0.0}, {}, 30);
  EXPECT_THROW(trace_of(e), RunError);
}

TEST(LiEdgeConsensus, BothEndsOfAnEdgeKeepTheSameGain) {
  const Trace trace = trace_of(experiment("li_edge_consensus", path(2), {3.0, -4.0}, {}, 20));
  for (std::size_t report = 0; report < trace.rounds.size(); ++report)
    for (std::size_t c = 0; c < 3; ++c) ASSERT_EQ(trace.at(report, AgentId{1})[c], trace.at(report, AgentId{2})[c]);
  EXPECT_GT(trace.final_estimate(AgentId{1})[1], 0.01);
}

Experiment das() {
  const auto graph = seeds::graph_of(4, {{4, 1}, {1, 2}, {2, 3}, {3, 1}});
  Experiment e = experiment("das_neural_consensus", *graph, {0, 0, 0, 1}, {}, 20);
  e.plant = PlantSpec{};
  e.plant->model = "sine_drift";
  e.plant->initial = {{"x", each({0, 0, 0, 1})}};
  const std::array<double, 4> a{1, -0.5, 2, 0}, b{0.5, -1, 0.2, 0};
  for (std::size_t i = 0; i < 4; ++i) {
    e.plant->overrides[agent_at(i)].parameters.set("a", a[i]);
    e.plant->overrides[agent_at(i)].parameters.set("b", b[i]);
  }
  return e;
}

TEST(DasNeuralConsensus, ComesWithinABoundOfTheLeaderThoughTheDriftsAreUnknown) {
  const Vector distance = distance_from_leader(trace_of(das()), AgentId{4});
  EXPECT_LE(distance[0], 0.01);
  EXPECT_GT(distance[0], 1e-5) << "bounded, not exact";
}

TEST(DasNeuralConsensus, WithoutLearningTheDriftsKeepTheAgentsFarther) {
  Experiment e = das();
  const double learning = distance_from_leader(trace_of(e), AgentId{4})[0];
  e.protocols[0].parameters.set("F", 1e-6);
  EXPECT_GT(distance_from_leader(trace_of(e), AgentId{4})[0], 5.0 * learning);
}

}  // namespace
}  // namespace consort
