/// Mode realtime: real processes on the wall clock. What a busy machine may delay is never taken for granted here: each test either holds
/// however late things are, or gives them more time until nothing was late.

#include "orchestrator/script/script.hpp"
#include "tests/support/process_run.hpp"
#include "tests/support/same_trace.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace consort {
namespace {

Experiment case_of(const std::string& more) {
  return parse_experiment("experiment: real\nmode: realtime\nseed: 3\n" + more, "real.yaml", ".");
}

/// Nothing was late, lost or left out.
bool undisturbed(const Trace& trace) {
  const bool came = std::all_of(trace.network.begin(), trace.network.end(),
                                [](const NetworkTotals& link) { return link.counters.received == link.counters.sent; });
  const bool in_time = std::all_of(trace.processes.begin(), trace.processes.end(),
                                   [](const Performance& p) { return p.missed_deadlines == 0 && p.missed_inputs == 0; });
  return came && in_time;
}

/// Runs with rounds of more and more time until nothing is late; the numbers must then be those of the simulation.
void expect_simulated_trace(Experiment experiment, Seconds longest) {
  for (Seconds round = 0.02; round <= longest; round *= 3.0) {
    experiment.dt = round;
    const auto outcome = run_over_dds(experiment);
    ASSERT_EQ(outcome.size(), 1u);
    if (!undisturbed(outcome[0].trace)) continue;
    expect_same_traces(outcome, run_in_simulation(experiment));
    return;
  }
  FAIL() << "in no run did all messages come in time";
}

TEST(RealTime, OnAnUndisturbedNetworkEqualsTheSimulation) {
  expect_simulated_trace(case_of(R"(
rounds: 50
agents: {count: 6, protocol: {name: kalman_consensus, Q: 0.1, Omega: 0.1}, initial: {x: {uniform: [0, 1], dimension: 2}, P: 1}}
topology: {random_pairs: {dwell_rounds: [1, 4]}}
links: {loss: 0.2, noise_covariance: 0.01, overrides: [{edge: 1 -> 2, delay_rounds: 2}]}
telemetry: {every: 3}
)"),
                         6.0);
}

TEST(RealTime, TheClosedLoopEqualsTheSimulationToo) {
  Experiment experiment = case_of(R"(
rounds: 40
agents: {count: 4, protocol: local_voting, initial: {x: 0}}
topology: ring
plant: {model: integrator, initial: {position: [1, 2, 3, 40]}, disturbances: [{on: measurement, gaussian: {deviation: 0.01}}]}
)");
  experiment.agents_per_process = 2;
  expect_simulated_trace(experiment, 6.0);
}

TEST(RealTime, WhatHappensToLinksAndSensorsOnTheWayEqualsTheSimulationToo) {
  expect_simulated_trace(case_of(R"(
rounds: 60
agents: {count: 5, protocol: local_voting}
plant: {model: integrator, initial: {position: [0, 3, 6, 9, 30]}}
topology: complete
links: {loss: {distance: {safe: 1, lost: 10}}}
events:
  - {round: 10, set_link: {edge: 1 -> 2, loss: 0.5}}
  - {round: 20, degrade: {agent: 2, gaussian: {deviation: 0.5}}}
  - {round: 30, cut: [1 <-> 3]}
  - {round: 40, heal: all}
  - {round: 50, set_link: {loss: 0.3, duplication: 0.3, quantisation: {bits: 8, range: [-50, 50]}}}
)"),
                         6.0);
}

TEST(RealTime, EveryMessageIsAccountedForAndInjectedLossIsKeptApart) {
  Experiment experiment = case_of(R"(
rounds: 150
dt: 0.01
agents: {count: 5, protocol: local_voting, initial: {x: {linspace: [0, 1]}}}
topology: complete
links: {loss: 0.3}
transport: {loss: 0.1}
)");
  const auto outcome = run_over_dds(experiment);
  const Trace& trace = outcome.at(0).trace;
  ASSERT_EQ(trace.processes.size(), 5u);
  ASSERT_EQ(trace.network.size(), 20u);
  NetworkCounters total;
  for (const auto& [edge, counters] : trace.network) {
    EXPECT_EQ(counters.sent, counters.received + counters.lost + counters.late);
    const auto link =
        std::find_if(trace.links.begin(), trace.links.end(), [&edge = edge](const LinkTotals& each) { return each.edge == edge; });
    ASSERT_NE(link, trace.links.end());
    EXPECT_EQ(link->counters.delivered + link->counters.lost, counters.received) << "the link model decides on what has come";
    total.lost += counters.lost;
    total.sent += counters.sent;
  }
  EXPECT_GT(total.lost, 0u) << "a tenth of all packets is thrown away";
  EXPECT_LT(total.lost, total.sent);
  EXPECT_GT(trace.totals.lost, 0u);
  for (const Performance& process : trace.processes) {
    EXPECT_GT(process.periods, 0u);
    EXPECT_LE(process.periods + process.missed_deadlines, 151u);
    EXPECT_GT(process.cpu, 0.0);
    EXPECT_GT(process.resident_bytes, 1'000'000u);
    EXPECT_LE(process.jitter_p50, process.jitter_p99);
    EXPECT_LE(process.jitter_p99, process.jitter_max);
  }
}

TEST(RealTime, NobodyWaitsForWhoDiesOrSleepsAndBothComeBack) {
  Experiment experiment = case_of(R"(
rounds: 500
dt: 0.02
agents: {count: 5, protocol: local_voting, initial: {x: {linspace: [0, 1]}}}
topology: complete
events: [{round: 30, kill: 3}, {round: 100, restart: 3}, {round: 40, stop: 2}, {round: 90, continue: 2}, {round: 60, leave: 5},
         {round: 300, kill: 4}]
)");
  Keeper keeper;
  const auto outcome = run_over_dds(experiment, nullptr, &keeper);
  const Trace& trace = outcome.at(0).trace;
  EXPECT_EQ(trace.last_round, 500u);
  const auto at = [&](Round k, std::uint32_t agent) {
    const auto report = std::find(trace.rounds.begin(), trace.rounds.end(), k);
    return trace.at(static_cast<std::size_t>(report - trace.rounds.begin()), AgentId{agent})[0];
  };
  EXPECT_TRUE(is_absent(at(60, 3))) << "killed at round 30";
  EXPECT_TRUE(is_absent(at(99, 3)));
  EXPECT_FALSE(is_absent(at(500, 3))) << "started again for round 100";
  EXPECT_TRUE(is_absent(at(60, 5)));
  EXPECT_FALSE(is_absent(at(60, 1)));
  const auto straggler =
      std::find_if(trace.processes.begin(), trace.processes.end(), [](const Performance& process) { return process.process == 2; });
  ASSERT_NE(straggler, trace.processes.end());
  EXPECT_GE(straggler->missed_deadlines, 20u) << "it slept over fifty rounds";
  const RunEnd& end = outcome.at(0).end;
  EXPECT_EQ(end.ending, Ending::last_round);
  EXPECT_GE(end.agents.at(1).slept, 20u);
  EXPECT_EQ(end.agents.at(1).reached, 500u);
  EXPECT_EQ(end.agents.at(4).absence, AgentEnd::Absence::left);
  EXPECT_TRUE(std::any_of(keeper.events.begin(), keeper.events.end(), [](const std::string& event) { return event == "kill: agent 3"; }));
  EXPECT_EQ(trace.links.size(), 20u);
  EXPECT_EQ(trace.network.size(), 20u);
  for (const LinkTotals& link : trace.links)
    EXPECT_TRUE(link.edge.to != AgentId{4} || link.counters.delivered > 20) << "what the killed one had counted is known";
}

TEST(RealTime, WhoIsAsleepPastTheEndMakesTheRunIncompleteAndIsNamed) {
  Experiment experiment = case_of(R"(
rounds: 60
dt: 0.01
agents: {count: 3, protocol: local_voting, initial: {x: {linspace: [0, 1]}}}
topology: complete
)");
  experiment.faults = {{5, AgentId{2}, Fault::Kind::stop}, {1'000'000, AgentId{2}, Fault::Kind::proceed}};
  RunOptions options;
  options.last_reports_seconds = 0.5;
  const auto outcome = run_over_dds(experiment, nullptr, nullptr, options);
  ASSERT_EQ(outcome.size(), 1u);
  const RunEnd& end = outcome[0].end;
  ASSERT_EQ(end.ending, Ending::out_of_time);
  EXPECT_LT(end.agents.at(1).reached, 60u);
  EXPECT_EQ(end.agents.at(1).asked, 60u);
  const Completeness verdict = completeness(end, outcome[0].trace.last_round, 60);
  EXPECT_FALSE(verdict.complete);
  EXPECT_TRUE(std::count(verdict.missing.begin(), verdict.missing.end(), 2u) == 1) << verdict.words;
  EXPECT_NE(verdict.words.find("agent 2 reached round"), std::string::npos) << verdict.words;
  EXPECT_EQ(outcome[0].trace.last_round, 60u) << "the others are recorded to the end";
}

TEST(RealTime, TheRunEndsWhenTheLastOneIsGone) {
  const auto outcome = run_over_dds(case_of(R"(
rounds: 100000
dt: 0.01
stop: {deadline: 2000 s}
agents: {count: 2, protocol: local_voting, initial: {x: {linspace: [0, 1]}}}
topology: complete
events: [{round: 30, kill: 1}, {round: 40, leave: 2}]
)"));
  ASSERT_EQ(outcome.size(), 1u);
  EXPECT_EQ(outcome[0].end.ending, Ending::nobody_left);
  EXPECT_EQ(outcome[0].trace.last_round, 40u);
  EXPECT_TRUE(is_absent(outcome[0].trace.final_estimate(AgentId{2})[0]));
}

TEST(RealTime, ReliableDeliverySendsAgainWhatWasLost) {
  const Experiment experiment = case_of(R"(
rounds: 20
dt: 0.5
agents: {count: 3, protocol: local_voting, initial: {x: {linspace: [0, 1]}}}
topology: ring
transport: {loss: 0.2, reliability: reliable, history: 8}
)");
  const auto outcome = run_over_dds(experiment);
  std::uint64_t again = 0;
  for (const Performance& process : outcome.at(0).trace.processes) again += process.sent_again_bytes;
  EXPECT_GT(again, 0u);
}

}  // namespace
}  // namespace consort
