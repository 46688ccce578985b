/// Lockstep over DDS equals simulate(), bit for bit: every shipped experiment, every placement, every discovery.

#include "orchestrator/script/script.hpp"
#include "tests/support/process_run.hpp"
#include "tests/support/same_trace.hpp"
#include "tests/support/tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

namespace consort {
namespace {

/// Long and wide experiments are shortened, and every agent is a process of its own: every mechanism still takes part.
Experiment shipped(const std::filesystem::path& file) {
  const Experiment whole = load_experiment(file);
  ScriptOverrides shorter;
  shorter.rounds = std::min<Round>(whole.rounds, whole.agents >= 50 ? 20 : 300);
  shorter.agents_per_process = 1;
  shorter.mode = Mode::lockstep;
  shorter.runs = std::min<std::size_t>(whole.runs, 3);
  return load_experiment(file, shorter);
}

std::vector<std::filesystem::path> shipped_files() {
  std::vector<std::filesystem::path> out;
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(kSourceDir) / "experiments"))
    if (entry.path().extension() == ".yaml") out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  return out;
}

class Shipped : public testing::TestWithParam<std::filesystem::path> {};

TEST_P(Shipped, GivesTheSimulatedTrace) {
  const Experiment experiment = shipped(GetParam());
  expect_same_traces(run_over_dds(experiment), run_in_simulation(experiment));
}

INSTANTIATE_TEST_SUITE_P(Conformance, Shipped, testing::ValuesIn(shipped_files()),
                         [](const auto& file) { return file.param.stem().string(); });

Experiment everything_at_once() {
  return parse_experiment(R"(
experiment: everything_at_once
seed: 42
rounds: 400
dt: 0.1
agents:
  count: 12
  protocol: {name: kalman_consensus, Q: 0.01, Omega: 0.1}
  initial: {x: {uniform: [-5, 5], dimension: 3}, P: {linspace: [0.5, 2]}}
topology: {random_links: {base: complete, probability: 0.4}}
links: {loss: 0.2, noise_covariance: 0.01, overrides: [{edge: 3 -> 7, delay_rounds: 4}, {edge: 5 -> 1, loss: 1.0}]}
events: [{round: 100, cut: [1 -> 2, 2 -> 1]}, {round: 200, heal: [1 -> 2]}]
)",
                          "everything_at_once.yaml", ".");
}

TEST(Conformance, LossNoiseDelaySwitchingAndEventsTogether) {
  const Experiment experiment = everything_at_once();
  expect_same_traces(run_over_dds(experiment), run_in_simulation(experiment));
}

TEST(Conformance, PlacementChangesNothing) {
  Experiment experiment = everything_at_once();
  const auto simulated = run_in_simulation(experiment);
  for (const std::size_t per_process : {2u, 5u, 12u}) {
    SCOPED_TRACE(per_process);
    experiment.agents_per_process = per_process;
    expect_same_traces(run_over_dds(experiment), simulated);
  }
}

void expect_same_links(const std::vector<JobOutcome>& a, const std::vector<JobOutcome>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t job = 0; job < a.size(); ++job) EXPECT_EQ(a[job].trace.links, b[job].trace.links) << job;
}

TEST(Conformance, EverythingALinkCanDoIsTheSameOverDds) {
  Experiment experiment = parse_experiment(R"(
experiment: rough
seed: 5
rounds: 250
dt: 0.01
agents:
  count: 6
  protocols: [local_voting, robust_information_consensus]
  initial: {x: {linspace: [-5, 5]}}
topology: complete
links:
  loss: {bernoulli: 0.05, gilbert_elliott: {p_good_to_bad: 0.05, p_bad_to_good: 0.25, loss_in_good: 0.01, loss_in_bad: 0.9}}
  delay: {exponential: {shortest: 5 ms, mean: 15 ms}}
  duplication: 0.2
  reordering: {probability: 0.2, later_rounds: 3}
  noise_covariance: 0.01
  quantisation: {bits: 12, range: [-400, 400]}
  overrides: [{edge: 1 -> 2, loss: 0.9}, {edges: [2 <-> 3], delay_rounds: {uniform: [0, 4]}}]
sweep: {links.delay_rounds: {steady: 1, spread: {normal: {mean: 2, deviation: 1.5}}}}
events:
  - {round: 40, set_link: {edge: 4 -> 5, loss: 1}}
  - {round: 80, set_link: {loss: 0.3, quantisation: none}}
  - {round: 100, cut: {groups: [[1, 2, 3], [4, 5, 6]]}}
  - {round: 160, heal: all}
)",
                                           "rough.yaml", ".");
  const auto simulated = run_in_simulation(experiment);
  ASSERT_EQ(simulated.size(), 4U);
  for (const std::size_t per_process : {1, 3}) {
    SCOPED_TRACE(per_process);
    experiment.agents_per_process = per_process;
    const auto outcomes = run_over_dds(experiment);
    expect_same_traces(outcomes, simulated);
    expect_same_links(outcomes, simulated);
  }
  LinkCounters sum;
  for (const LinkTotals& link : simulated.front().trace.links) sum += link.counters;
  EXPECT_GT(sum.lost, 100U);
  EXPECT_GT(sum.duplicated, 100U);
  EXPECT_GT(sum.reordered, 100U);
  EXPECT_GT(sum.superseded, 100U);
}

TEST(Conformance, LossByDistanceAndDegradedSensorsAreTheSameOverDds) {
  Experiment experiment = parse_experiment(R"(
experiment: distant
seed: 6
rounds: 150
dt: 0.05
agents: {count: 5, protocol: local_voting}
plant:
  model: integrator
  initial: {position: [0, 3, 6, 9, 30]}
topology: complete
links: {loss: {distance: {safe: 1, lost: 10}}, overrides: [{edge: 1 -> 2, loss: 0.5}]}
events: [{round: 50, degrade: {agent: 2, gaussian: {deviation: 0.5}}}]
)",
                                           "distant.yaml", ".");
  const auto simulated = run_in_simulation(experiment);
  for (const std::size_t per_process : {1, 5}) {
    SCOPED_TRACE(per_process);
    experiment.agents_per_process = per_process;
    const auto outcomes = run_over_dds(experiment);
    expect_same_traces(outcomes, simulated);
    expect_same_links(outcomes, simulated);
  }
  for (const LinkTotals& link : simulated.front().trace.links) {
    if (link.edge.from == AgentId{5}) {
      EXPECT_EQ(link.counters.delivered, 0U) << "agent 5 is out of reach, and nobody moves towards it";
    }
    if (link.edge == Edge{AgentId{1}, AgentId{3}}) {
      EXPECT_GT(link.counters.delivered, 50U);
      EXPECT_GT(link.counters.lost, 0U);
    }
  }
}

TEST(Conformance, DiscoveryChangesNothing) {
  Experiment experiment = parse_experiment(R"(
experiment: directed
seed: 3
rounds: 200
dt: 0.1
agents: {count: 9, protocol: local_voting, initial: {x: {uniform: [0, 1], dimension: 2}}}
topology: directed_ring
stop: {converged: {disagreement: 0.05, for_rounds: 5}}
)",
                                           "directed.yaml", ".");
  const auto simulated = run_in_simulation(experiment);
  for (const Discovery discovery : {Discovery::multicast, Discovery::neighbours}) {
    SCOPED_TRACE(static_cast<int>(discovery));
    experiment.discovery = discovery;
    expect_same_traces(run_over_dds(experiment), simulated);
  }
}

TEST(Conformance, TheSameSeedTwiceGivesTheSameHashAndAnotherSeedAnother) {
  Experiment experiment = everything_at_once();
  experiment.rounds = 50;
  const auto first = run_over_dds(experiment), second = run_over_dds(experiment);
  EXPECT_EQ(first.at(0).trace.hash, second.at(0).trace.hash);
  experiment.seed = Seed{43};
  EXPECT_NE(run_over_dds(experiment).at(0).trace.hash, first.at(0).trace.hash);
}

TEST(Conformance, LinkTotalsAddUpToTheTrace) {
  Experiment experiment = everything_at_once();
  const auto outcome = run_over_dds(experiment).at(0);
  std::uint64_t delivered = 0, lost = 0;
  for (const LinkTotals& link : outcome.trace.links) {
    delivered += link.counters.delivered;
    lost += link.counters.lost;
    if (link.edge == Edge{AgentId{5}, AgentId{1}}) {
      EXPECT_EQ(link.counters.delivered, 0u) << "this link loses everything";
      EXPECT_GT(link.counters.lost, 0u);
    }
  }
  EXPECT_EQ(delivered, outcome.trace.totals.delivered);
  EXPECT_EQ(lost, outcome.trace.totals.lost);
}

}  // namespace
}  // namespace consort
