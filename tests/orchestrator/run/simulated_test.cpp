#include "orchestrator/run/run.hpp"

#include "core/errors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace consort {
namespace {

Experiment ring_experiment(std::size_t runs, std::size_t protocols = 1) {
  Experiment experiment;
  experiment.name = "ring";
  experiment.mode = Mode::simulate;
  experiment.agents = 5;
  experiment.runs = runs;
  experiment.rounds = 50;
  experiment.dt = 0.25;
  experiment.seed = Seed{3};
  experiment.initial = {{"x", PerAgent{PerAgent::Uniform{0.0, 1.0, 2}}}};
  experiment.protocols.assign(protocols, {"local_voting", {}});
  FixedSchedule schedule;
  schedule.intervals.push_back({std::make_shared<const Graph>(ring(5)), 1});
  experiment.topology = schedule;
  experiment.links.standard.loss_probability = 0.1;
  return experiment;
}

/// Writes down all that happens, and may act on a report.
struct Witness : RunObserver {
  std::vector<std::string> calls;
  std::vector<std::size_t> begun;
  std::vector<JobOutcome> outcomes;
  std::vector<std::vector<double>> estimates;  // of every report
  std::function<void(const RoundReport&)> on_report;

  void launching(std::size_t, std::size_t, std::size_t) override { calls.emplace_back("launching"); }
  void run_begins(const Job& job, const Trace& outline) override {
    calls.emplace_back("begin");
    begun.push_back(job.number);
    EXPECT_EQ(outline.agents, 5u);
    EXPECT_EQ(outline.estimate_layout.size(), 2u);
  }
  void report(const Job& job, const RoundReport& report) override {
    if (calls.back() != "report") calls.emplace_back("report");
    EXPECT_EQ(job.number, begun.back());
    EXPECT_EQ(report.hashes.size(), 5u);
    EXPECT_EQ(report.counters.size(), 5u);
    estimates.emplace_back(report.estimates.begin(), report.estimates.end());
    if (on_report) on_report(report);
  }
  void event(const Job&, Round, const std::string& kind, const std::string& text) override { calls.push_back(kind + " " + text); }
  void run_ends(const JobOutcome& outcome) override {
    calls.emplace_back("end");
    EXPECT_EQ(outcome.job.number, begun.back());
    outcomes.push_back(outcome);
  }
};

TEST(JobsOf, OrdersProtocolByProtocolWithAscendingSeeds) {
  const auto jobs = jobs_of(ring_experiment(3, 2));
  ASSERT_EQ(jobs.size(), 6u);
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    EXPECT_EQ(jobs[i].number, i);
    EXPECT_EQ(jobs[i].protocol, i / 3);
    EXPECT_EQ(jobs[i].seed.value, 3 + i % 3);
  }
}

TEST(RunSimulated, OneJobStreamsItsReports) {
  Witness witness;
  const SessionTimes times = run_simulated(ring_experiment(1), {}, witness);
  EXPECT_EQ(witness.calls, (std::vector<std::string>{"begin", "report", "end"}));
  ASSERT_EQ(witness.outcomes.size(), 1u);
  EXPECT_EQ(witness.estimates.size(), 51u) << "rounds 0 to 50";
  EXPECT_EQ(witness.outcomes[0].trace.last_round, 50u);
  EXPECT_GE(times.startup_seconds, 0.0);
  EXPECT_EQ(times.running_seconds, witness.outcomes[0].seconds);
}

TEST(RunSimulated, ManyJobsArriveInOrderAndEqualTheSameJobsAlone) {
  const Experiment experiment = ring_experiment(40, 2);
  Witness together;
  run_simulated(experiment, {}, together);
  ASSERT_EQ(together.outcomes.size(), 80u);
  std::size_t report = 0;
  for (std::size_t i = 0; i < together.outcomes.size(); ++i) {
    SCOPED_TRACE(i);
    EXPECT_EQ(together.begun[i], i);
    Experiment alone = experiment;
    alone.runs = 1;
    alone.protocols.resize(1);
    alone.seed = together.outcomes[i].job.seed;
    Witness single;
    run_simulated(alone, {}, single);
    EXPECT_EQ(together.outcomes[i].trace.hash, single.outcomes.at(0).trace.hash);
    for (const auto& estimates : single.estimates) ASSERT_EQ(together.estimates.at(report++), estimates);
  }
  EXPECT_EQ(report, together.estimates.size());
}

TEST(RunSimulated, WhatAFailedJobHadReachedIsHandedOver) {
  Experiment experiment = ring_experiment(3);
  experiment.dt = 5.0;  // local voting runs away
  experiment.rounds = 5000;
  for (const std::size_t runs : {1u, 3u}) {
    experiment.runs = runs;
    Witness witness;
    EXPECT_THROW(run_simulated(experiment, {}, witness), RunError);
    EXPECT_EQ(witness.calls, (std::vector<std::string>{"begin", "report", "end"})) << "its links are told too";
    EXPECT_GT(witness.estimates.size(), 10u);
    EXPECT_TRUE(std::isfinite(witness.estimates.back().front()));
  }
}

TEST(RunSimulated, SignalEndsTheRunAfterTheNextReport) {
  std::atomic<int> signal{0};
  RunOptions options;
  options.interrupt = &signal;
  Witness witness;
  witness.on_report = [&](const RoundReport& report) {
    if (report.k == 20) signal = 2;
  };
  run_simulated(ring_experiment(1), options, witness);
  ASSERT_EQ(witness.outcomes.size(), 1u) << "the run is ended, not abandoned";
  EXPECT_EQ(witness.estimates.size(), 21u);
  EXPECT_EQ(witness.outcomes[0].trace.last_round, 20u);
}

TEST(RunSimulated, SignalEndsManyJobsToo) {
  std::atomic<int> signal{0};
  RunOptions options;
  options.interrupt = &signal;
  Witness witness;
  witness.on_report = [&](const RoundReport&) { signal = 15; };
  Experiment experiment = ring_experiment(10'000);
  experiment.rounds = 2000;
  run_simulated(experiment, options, witness);
  EXPECT_LT(witness.outcomes.size(), 100u);
  EXPECT_EQ(witness.calls.back(), "end");
}

TEST(RunSimulated, DeadlineNamesTheRound) {
  for (const std::size_t runs : {1u, 3u}) {
    SCOPED_TRACE(runs);
    Experiment experiment = ring_experiment(runs);
    experiment.deadline = 0.1;
    experiment.rounds = 1'000'000'000;
    experiment.report_every = 1000;
    Witness witness;
    try {
      run_simulated(experiment, {}, witness);
      FAIL() << "the deadline passed and nobody noticed";
    } catch (const TimeoutError& error) {
      EXPECT_NE(std::string(error.what()).find("000 of 1000000000 (local_voting, seed 3)"), std::string::npos) << error.what();
    }
    EXPECT_EQ(witness.calls.back(), "end") << "what was reached is handed over first";
  }
}

TEST(RunSimulated, DeadlineIsNoticedWhileTheAgentsAreMade) {
  for (const std::size_t runs : {1u, 3u}) {
    SCOPED_TRACE(runs);
    Experiment experiment = ring_experiment(runs);
    experiment.deadline = 1e-9;
    Witness witness;
    try {
      run_simulated(experiment, {}, witness);
      FAIL() << "the deadline passed and nobody noticed";
    } catch (const TimeoutError& error) {
      EXPECT_NE(std::string(error.what()).find("before round 0, while 5 agents were made (local_voting, seed 3)"), std::string::npos)
          << error.what();
    }
    EXPECT_TRUE(witness.outcomes.empty());
  }
}

TEST(RunSimulated, FailureOfOneJobEndsTheOthers) {
  Experiment experiment = ring_experiment(200);
  experiment.dt = 1e200;  // local voting overflows within a few rounds
  Witness witness;
  EXPECT_THROW(run_simulated(experiment, {}, witness), RunError);
  EXPECT_EQ(witness.outcomes.size(), 1u);
}

TEST(RunSimulated, AFailureLeavesWhatWasKnownOfTheRunToo) {
  for (const std::size_t runs : {1u, 3u}) {
    SCOPED_TRACE(runs);
    Experiment experiment = ring_experiment(runs);
    experiment.dt = 1e100;  // the estimates overflow in the fourth round
    Witness witness;
    EXPECT_THROW(run_simulated(experiment, {}, witness), RunError);
    ASSERT_EQ(witness.outcomes.size(), 1u);
    const auto& [job, trace, seconds, end] = witness.outcomes[0];
    EXPECT_EQ(end.ending, Ending::failure);
    EXPECT_GT(trace.last_round, 0u);
    EXPECT_EQ(witness.estimates.size(), trace.rounds.size());
    EXPECT_EQ(completeness(end, trace.last_round, 50).missing.size(), 5u);
    ASSERT_EQ(trace.links.size(), 10u) << "of each edge, to and fro";
    LinkCounters sum;
    for (const LinkTotals& link : trace.links) sum += link.counters;
    EXPECT_GE(sum.delivered, trace.totals.delivered);
    EXPECT_GE(sum.lost, trace.totals.lost);
  }
}

TEST(RunSimulated, WhatTheObserverCannotTakeIsTheReasonThatIsTold) {
  Witness witness;
  witness.on_report = [](const RoundReport& report) {
    if (report.k == 7) throw RunError("the disk is full");
  };
  try {
    run_simulated(ring_experiment(1), {}, witness);
    FAIL() << "nobody noticed";
  } catch (const RunError& failure) {
    EXPECT_STREQ(failure.what(), "the disk is full");
  }
  ASSERT_EQ(witness.outcomes.size(), 1u);
  EXPECT_EQ(witness.outcomes[0].end.ending, Ending::failure);
}

TEST(RunSimulated, LinkEventsAreTold) {
  Experiment experiment = ring_experiment(1);
  experiment.link_events = {{10, {{AgentId{1}, AgentId{2}}, {AgentId{2}, AgentId{1}}}, false}, {30, {{AgentId{1}, AgentId{2}}}, true}};
  Witness witness;
  run_simulated(experiment, {}, witness);
  EXPECT_EQ(witness.calls, (std::vector<std::string>{"begin", "report", "cut 1 -> 2, 2 -> 1", "report", "heal 1 -> 2", "report", "end"}));
}

/// Everybody there until round 20.
Experiment deserted(std::size_t runs) {
  Experiment experiment = ring_experiment(runs);
  Attendance until_20;
  until_20.until = 20;
  for (std::size_t i = 0; i < 5; ++i) experiment.presence[agent_at(i)] = until_20;
  return experiment;
}

TEST(Simulated, EndsWhenTheLastAgentIsGoneAndNoneWillCome) {
  for (const std::size_t runs : {1u, 3u}) {
    Witness witness;
    run_simulated(deserted(runs), {}, witness);
    ASSERT_EQ(witness.outcomes.size(), runs);
    for (const JobOutcome& outcome : witness.outcomes) {
      EXPECT_EQ(outcome.trace.last_round, 20u);
      EXPECT_EQ(outcome.end.ending, Ending::nobody_left);
      EXPECT_TRUE(is_absent(outcome.trace.final_estimate(AgentId{1})[0]));
    }
    EXPECT_TRUE(std::find(witness.calls.begin(), witness.calls.end(), "leave agent 5") != witness.calls.end()) << "what ends it is told";
  }
}

TEST(Simulated, NobodyConvergesWhereNobodyIs) {
  Experiment experiment = deserted(1);
  for (auto& [agent, presence] : experiment.presence) presence.again = {{40}};
  experiment.convergence = Convergence{1e-30, 5};
  Witness witness;
  run_simulated(experiment, {}, witness);
  EXPECT_EQ(witness.outcomes.at(0).trace.last_round, 50u) << "they come back in round 40";
  EXPECT_EQ(witness.outcomes.at(0).end.ending, Ending::last_round);
}

TEST(Simulated, AStopRuleThatHeldIsACompleteRunAndADeadlineIsNot) {
  Experiment experiment = ring_experiment(1);
  experiment.convergence = Convergence{1e9, 1};
  Witness held;
  run_simulated(experiment, {}, held);
  EXPECT_EQ(held.outcomes.at(0).end.ending, Ending::stop_rule);
  EXPECT_TRUE(completeness(held.outcomes[0].end, held.outcomes[0].trace.last_round, 50).complete);

  experiment.convergence.reset();
  experiment.deadline = 0.1;
  experiment.rounds = 1'000'000'000;
  experiment.report_every = 1000;
  Witness late;
  EXPECT_THROW(run_simulated(experiment, {}, late), TimeoutError);
  ASSERT_EQ(late.outcomes.size(), 1u);
  EXPECT_EQ(late.outcomes[0].end.ending, Ending::deadline);
  EXPECT_EQ(completeness(late.outcomes[0].end, late.outcomes[0].trace.last_round, experiment.rounds).missing.size(), 5u);
}

}  // namespace
}  // namespace consort
