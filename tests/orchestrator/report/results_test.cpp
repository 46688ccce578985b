#include "orchestrator/report/results.hpp"
#include "orchestrator/report/export.hpp"
#include "orchestrator/report/record.hpp"
#include "orchestrator/report/table.hpp"
#include "tests/orchestrator/folder.hpp"
#include "tests/support/text_of.hpp"

#include <gtest/gtest.h>

#include <array>
#include <nlohmann/json.hpp>

#include <cmath>
#include <limits>
#include <sstream>
#include <thread>

namespace consort {
namespace {

/// Two agents that have reached `value`, and `other`, after `rounds` rounds; agent 1 has started one below it.
JobOutcome agreed_on(const Job& job, double value, std::size_t dimension, Round rounds, std::optional<double> other = {}) {
  JobOutcome outcome{job, {}, 0.5};
  Trace& trace = outcome.trace;
  trace.agents = 2;
  trace.dimension = dimension;
  trace.estimate_layout = {{{"x", dimension, 1}}, 0, 0};
  std::vector<double> first(2 * dimension, value), last(2 * dimension, value);
  std::fill_n(first.begin(), dimension, value - 1.0);
  std::fill_n(last.begin() + static_cast<std::ptrdiff_t>(dimension), dimension, other.value_or(value));
  const std::vector<std::uint64_t> hashes(2);
  const std::vector<AgentCounters> counters(2);
  trace.add({0, first, hashes, counters});
  trace.add({rounds, last, hashes, counters});
  trace.hash = 7 + job.number;
  trace.totals = {100, 90, 10};
  return outcome;
}

Experiment experiment_with(std::vector<std::string> protocols, std::size_t runs, Matrix start) {
  Experiment experiment;
  experiment.name = "small";
  experiment.mode = Mode::simulate;
  experiment.agents = 2;
  experiment.runs = runs;
  experiment.seed = Seed{11};
  for (auto& name : protocols) experiment.protocols.push_back({std::move(name), {}});
  experiment.initial = {{"x", PerAgent{PerAgent::Same{std::move(start)}}}};
  experiment.topology = FixedSchedule{{{std::make_shared<const Graph>(complete(2)), 1}}, false};
  return experiment;
}

Experiment scalar_experiment(std::vector<std::string> protocols, std::size_t runs) {
  return experiment_with(std::move(protocols), runs, Matrix::Constant(1, 1, 4.0));
}

TEST(Results, SummaryHoldsEveryFieldPromised) {
  Experiment experiment = scalar_experiment({"local_voting"}, 1);
  experiment.criteria = {"bias < 2", "disagreement > 1"};
  Results results(experiment, "results/small");
  results.add(agreed_on({0, 0, Seed{11}}, 5.0, 1, 40));
  const Summary summary = results.summary({0.25, 0.5}, Exit::ok, "");
  const auto json = nlohmann::json::parse(to_json(summary));
  EXPECT_EQ(json["passed"], false);
  EXPECT_EQ(json["exit"], 1);
  ASSERT_EQ(json["criteria"].size(), 2u);
  EXPECT_EQ(json["criteria"][0]["text"], "bias < 2");
  EXPECT_EQ(json["criteria"][0]["met"], true);
  EXPECT_DOUBLE_EQ(json["criteria"][0]["value"].get<double>(), json["metrics"]["bias"].get<double>());
  EXPECT_EQ(json["criteria"][1]["met"], false);
  EXPECT_EQ(json["metrics"]["consensus_value"], 5.0);
  EXPECT_NEAR(json["metrics"]["centralised_value"].get<double>(), 4.0, 1e-12);
  EXPECT_NEAR(json["metrics"]["bias"].get<double>(), 1.0, 1e-12);
  EXPECT_EQ(json["metrics"]["disagreement"], 0.0);
  EXPECT_EQ(json["mode"], "simulate");
  EXPECT_EQ(json["seed"], 11);
  EXPECT_EQ(json["rounds"], 40);
  EXPECT_EQ(json["trace_hash"].get<std::string>().size(), 16u);
  EXPECT_EQ(json["performance"]["startup_seconds"], 0.25);
  EXPECT_EQ(json["performance"]["rounds_per_second"], 80.0);
  EXPECT_EQ(json["performance"]["messages_sent"], 100);
  EXPECT_EQ(json["performance"]["messages_delivered"], 90);
  EXPECT_EQ(json["performance"]["messages_lost"], 10);
  EXPECT_EQ(json["output"], "results/small");
  EXPECT_FALSE(json.contains("error"));
}

TEST(Results, FailureIsSummarisedWithWhatIsKnown) {
  Experiment experiment = scalar_experiment({"local_voting"}, 1);
  experiment.criteria = {"bias < 2"};
  const Results results(experiment, "out");
  const auto json = nlohmann::json::parse(to_json(results.summary({}, Exit::run_failed, "agent 7 died \xff")));
  EXPECT_EQ(json["passed"], false);
  EXPECT_EQ(json["exit"], 3);
  EXPECT_TRUE(json["error"].get<std::string>().starts_with("agent 7 died"));
  EXPECT_TRUE(json["criteria"].empty());
  EXPECT_TRUE(json["metrics"].is_object());
}

TEST(Results, OfARunThatNeverBeganThereIsNeitherTraceNorStartUp) {
  const Experiment experiment = scalar_experiment({"local_voting"}, 1);
  const Summary never = Results(experiment, "out").summary({}, Exit::run_failed, "agent 7 died");
  const auto json = nlohmann::json::parse(to_json(never));
  EXPECT_FALSE(json.contains("trace_hash"));
  EXPECT_FALSE(json["performance"].contains("startup_seconds"));
  EXPECT_EQ(json["ending"], "failure");
  const Results none(experiment, "out");
  EXPECT_EQ(none.summary({}, Exit::terminated, "interrupted").ending, Ending::signal);
  EXPECT_EQ(none.summary({}, Exit::timed_out, "deadline").ending, Ending::deadline);
  EXPECT_EQ(render(never, {}).find("trace "), std::string::npos) << render(never, {});
  EXPECT_EQ(render(never, {}).find("start-up"), std::string::npos);
  Results results(experiment, "out");
  results.add(agreed_on({0, 0, Seed{11}}, 5.0, 1, 40));
  EXPECT_NE(render(results.summary({0.25, 0.5}, Exit::ok, ""), {}).find("start-up 0.25 s, trace "), std::string::npos);
}

TEST(Results, SeveralProtocolsPrefixTheirMetrics) {
  const Experiment experiment = scalar_experiment({"local_voting", "kalman_consensus"}, 1);
  Results results(experiment, "out");
  results.add(agreed_on({0, 0, Seed{11}}, 5.0, 1, 40));
  results.add(agreed_on({1, 1, Seed{11}}, 3.0, 1, 60));
  const Summary summary = results.summary({}, Exit::ok, "");
  EXPECT_NEAR(summary.metrics.at("local_voting.bias"), 1.0, 1e-12);
  EXPECT_NEAR(summary.metrics.at("kalman_consensus.bias"), -1.0, 1e-12);
  EXPECT_FALSE(summary.metrics.contains("bias"));
  EXPECT_EQ(summary.rounds, 60u);
  EXPECT_EQ(summary.totals.sent, 200u);
}

TEST(Results, RunsAreAveragedWithTheirDeviation) {
  const Experiment experiment = scalar_experiment({"local_voting"}, 3);
  Results results(experiment, "out");
  std::size_t number = 0;
  for (const double value : {4.0, 5.0, 6.0}) results.add(agreed_on({number, 0, Seed{11 + number++}}, value, 1, 40));
  const Summary summary = results.summary({}, Exit::ok, "");
  EXPECT_DOUBLE_EQ(summary.metrics.at("consensus_value"), 5.0);
  EXPECT_DOUBLE_EQ(summary.metrics.at("consensus_value.std"), 1.0) << "sample deviation of 4, 5, 6";
}

/// A run of two agents that comes to agree in round 30, or never does.
JobOutcome perhaps_agreed(const Job& job, bool agrees) { return agrees ? agreed_on(job, 5.0, 1, 30) : agreed_on(job, 5.0, 1, 40, 4.0); }

TEST(Results, RunThatNeverConvergesCountsInTheShareAlone) {
  Experiment experiment = scalar_experiment({"local_voting"}, 3);
  experiment.criteria = {"rounds_to_convergence <= 30", "rounds_to_convergence.share > 0.6", "rounds_to_convergence.share == 1"};
  Results results(experiment, "out");
  for (std::size_t i = 0; i < 3; ++i) results.add(perhaps_agreed({i, 0, Seed{11 + i}}, i != 1));
  const Summary summary = results.summary({}, Exit::ok, "");
  EXPECT_EQ(summary.metrics.at("rounds_to_convergence"), 30.0);
  EXPECT_EQ(summary.metrics.at("rounds_to_convergence.std"), 0.0);
  EXPECT_DOUBLE_EQ(summary.metrics.at("rounds_to_convergence.share"), 2.0 / 3.0);
  EXPECT_EQ(summary.metrics.at("bias.share"), 1.0);
  EXPECT_TRUE(summary.criteria[0].met && summary.criteria[1].met && !summary.criteria[2].met);
  const std::string text = render(summary, {false, false, false, 80});
  EXPECT_NE(text.find("30 +- 0 (2 of 3 runs)"), std::string::npos) << text;
  EXPECT_NE(render(summary, {false, false, false, 120}).find("rounds_to_convergence 30, rounds_to_convergence.share 0.666667"),
            std::string::npos);
  const auto json = nlohmann::json::parse(to_json(summary));
  EXPECT_DOUBLE_EQ(json["criteria"][0]["metrics"]["rounds_to_convergence.share"].get<double>(), 2.0 / 3.0);
}

TEST(Results, WithOneRunThatConvergedThereIsAMeanAndNoDeviation) {
  const Experiment experiment = scalar_experiment({"local_voting"}, 2);
  Results one(experiment, "out"), none(experiment, "out");
  for (std::size_t i = 0; i < 2; ++i) {
    one.add(perhaps_agreed({i, 0, Seed{11 + i}}, i == 1));
    none.add(perhaps_agreed({i, 0, Seed{11 + i}}, false));
  }
  const Summary some = one.summary({}, Exit::ok, "");
  EXPECT_EQ(some.metrics.at("rounds_to_convergence"), 30.0);
  EXPECT_TRUE(std::isnan(some.metrics.at("rounds_to_convergence.std")));
  EXPECT_NE(render(some, {false, false, false, 80}).find("30 (1 of 2 runs)"), std::string::npos);
  const Summary nobody = none.summary({}, Exit::ok, "");
  EXPECT_TRUE(std::isnan(nobody.metrics.at("rounds_to_convergence")));
  EXPECT_EQ(nobody.metrics.at("rounds_to_convergence.share"), 0.0);
}

TEST(Results, EveryRunKeepsItsOwnMetrics) {
  const Experiment experiment = scalar_experiment({"local_voting", "kalman_consensus"}, 2);
  Results results(experiment, "out");
  for (const Job& job : jobs_of(experiment)) results.add(perhaps_agreed(job, job.number != 1));
  const Summary summary = results.summary({}, Exit::ok, "");
  ASSERT_EQ(summary.protocols[0].per_run.size(), 2u);
  EXPECT_EQ(summary.protocols[0].per_run[1].seed, Seed{12});
  EXPECT_EQ(summary.protocols[0].per_run[0].metrics.at("rounds_to_convergence"), 30.0);
  const auto json = nlohmann::json::parse(to_json(summary))["per_run"];
  ASSERT_EQ(json.size(), 2u);
  EXPECT_EQ(json[1]["protocol"], "kalman_consensus");
  EXPECT_EQ(json[0]["seeds"], (std::vector{11, 12}));
  EXPECT_EQ(json[0]["metrics"]["rounds_to_convergence"][0], 30.0);
  EXPECT_TRUE(json[0]["metrics"]["rounds_to_convergence"][1].is_null());
  EXPECT_EQ(json[1]["metrics"]["bias"].size(), 2u);
}

TEST(Results, HashDependsOnTheOrderOfRuns) {
  const Experiment experiment = scalar_experiment({"local_voting"}, 2);
  Results forward(experiment, "out"), backward(experiment, "out"), again(experiment, "out");
  const JobOutcome a = agreed_on({0, 0, Seed{11}}, 4.0, 1, 40), b = agreed_on({1, 0, Seed{12}}, 5.0, 1, 40);
  forward.add(a), forward.add(b), backward.add(b), backward.add(a), again.add(a), again.add(b);
  EXPECT_NE(forward.summary({}, Exit::ok, "").trace_hash, backward.summary({}, Exit::ok, "").trace_hash);
  EXPECT_EQ(forward.summary({}, Exit::ok, "").trace_hash, again.summary({}, Exit::ok, "").trace_hash);
}

TEST(Results, WhatIsNotANumberBecomesNull) {
  Summary summary;
  summary.metrics["rounds_to_convergence"] = std::numeric_limits<double>::quiet_NaN();
  summary.criteria.push_back({"rounds_to_convergence < 10", false, std::numeric_limits<double>::infinity()});
  const auto json = nlohmann::json::parse(to_json(summary));
  EXPECT_TRUE(json["metrics"]["rounds_to_convergence"].is_null());
  EXPECT_TRUE(json["criteria"][0]["value"].is_null());
}

TEST(Results, FoldersAreNeverSharedOrOverwritten) {
  const ScratchFolder scratch;
  const std::time_t now = 1'700'000'000;
  std::vector<std::filesystem::path> folders(40);
  {
    std::vector<std::jthread> threads;
    for (std::size_t t = 0; t < 4; ++t)
      threads.emplace_back([&, t] {
        for (std::size_t i = t * 10; i < t * 10 + 10; ++i) folders[i] = create_results_folder(scratch.path() / "results", "meet", now);
      });
  }
  std::sort(folders.begin(), folders.end());
  EXPECT_EQ(std::unique(folders.begin(), folders.end()), folders.end());
  const std::string first = folders.front().filename().string();
  EXPECT_EQ(first.size(), std::string("meet-20231114-221320").size()) << first;
  EXPECT_TRUE(std::filesystem::is_directory(scratch.path() / "results" / (first + "-2")));
  EXPECT_TRUE(create_results_folder(scratch.path(), "../a b", now).filename().string().starts_with("_.._a_b-"));
}

TEST(Results, OutputFolderMustBeAbsentOrEmpty) {
  const ScratchFolder scratch;
  claim_output_folder(scratch.path() / "a" / "b");
  EXPECT_TRUE(std::filesystem::is_directory(scratch.path() / "a" / "b"));
  claim_output_folder(scratch.path() / "a" / "b");
  write_file(scratch.path() / "file", "x");
  EXPECT_THROW(claim_output_folder(scratch.path()), ConfigError);
  EXPECT_THROW(claim_output_folder(scratch.path() / "file"), ConfigError);
  EXPECT_THROW(claim_output_folder(scratch.path() / "file" / "below"), ConfigError);
  EXPECT_EQ(text_of(scratch.path() / "file"), "x");
}

TEST(Results, WritingWhereNothingCanBeWrittenIsARunError) { EXPECT_THROW(write_file("/proc/consort/summary.json", "x"), RunError); }

std::size_t widest_line(const std::string& text) {
  std::size_t widest = 0;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) widest = std::max(widest, shown_width(line));
  return widest;
}

TEST(Table, ShowsOneProtocolInPlainText) {
  Experiment experiment = scalar_experiment({"local_voting"}, 1);
  experiment.criteria = {"abs(bias) < 2", "disagreement > 1"};
  Results results(experiment, "results/small");
  results.add(agreed_on({0, 0, Seed{11}}, 5.0, 1, 40));
  Summary summary = results.summary({0.25, 0.5}, Exit::ok, "");
  summary.trace_hash = 0x1234;
  EXPECT_EQ(render(summary, {false, false, false, 80}), R"(
  small                          NOT MET
  simulate, 2 agents, seed 11

                          local_voting
  ------------------------------------
  consensus value           5
  centralised value         4
  bias                      1
  disagreement              0
  rounds to convergence    40
  spread                    0
  predicted value           4.5
  rounds                   40
  messages sent           100
  messages lost            10 (10.0 %)
  time                      0.50 s
  rounds/s                 80

  met     1  abs(bias) < 2
  NOT met 0  disagreement > 1

  start-up 0.25 s, trace 0000000000001234
  results/small
)");
}

TEST(Table, FitsEightyColumnsWhateverItHolds) {
  for (const std::size_t protocols : {1u, 2u, 3u, 5u}) {
    for (const std::size_t runs : {1u, 4u}) {
      for (const std::size_t dimension : {1u, 2u, 8u}) {
        SCOPED_TRACE(testing::Message() << protocols << " protocols, " << runs << " runs, dimension " << dimension);
        std::vector<std::string> names;
        constexpr std::array kLong{"unbiased_kalman_consensus", "unbiased_information_consensus", "robust_information_consensus",
                                   "continuous_kalman_consensus", "minimum_energy_consensus"};
        for (std::size_t p = 0; p < protocols; ++p) names.emplace_back(kLong.at(p));
        const Experiment experiment = experiment_with(names, runs, Matrix::Constant(static_cast<Eigen::Index>(dimension), 1, 123456.789));
        Results results(experiment, "results/small");
        for (const Job& job : jobs_of(experiment)) results.add(agreed_on(job, 0.001 * double(job.number), dimension, 123456));
        for (const bool unicode : {true, false}) {
          const std::string text = render(results.summary({}, Exit::ok, ""), {unicode, false, false, 80});
          EXPECT_LE(widest_line(text), 80u) << text;
          for (const auto& name : names) EXPECT_NE(text.find(name), std::string::npos) << text;
          EXPECT_EQ(text.find("[3]"), std::string::npos) << "only the first components are shown";
          EXPECT_EQ(text.find("5 more") != std::string::npos, dimension == 8) << text;
          EXPECT_EQ(text.find(unicode ? " ± 0" : " +- 0") != std::string::npos, runs > 1) << text;
        }
      }
    }
  }
}

TEST(Table, RunThatNeverBeganStillHasItsTable) {
  const Experiment experiment = scalar_experiment({"local_voting"}, 1);
  const std::string text = render(Results(experiment, "out").summary({}, Exit::timed_out, "nobody came"), {true, false, false, 80});
  EXPECT_NE(text.find("TIMED OUT"), std::string::npos) << text;
}

TEST(Export, WritesEveryTableSoThatItReadsBack) {
  const ScratchFolder scratch;
  const Experiment experiment = scalar_experiment({"local_voting"}, 1);
  const Job job{0, 0, Seed{11}};
  {
    Record record(scratch.path() / "record.sqlite", experiment);
    Trace outline;
    outline.agents = 2;
    outline.dimension = 1;
    outline.estimate_layout = {{{"x", 1, 1}}, 0, 0};
    record.begin_run(job, outline);
    const std::vector<double> estimates{0.1, 1.0 / 3.0};
    const std::vector<std::uint64_t> hashes(2);
    const std::vector<AgentCounters> counters(2);
    record.add(job, {0, estimates, hashes, counters});
    record.event(job, 0, "cut", "1 -> 2, \"both\"");
  }
  std::vector<std::string> names;
  for (const auto& table : export_record(scratch.path()).tables) names.push_back(table.file.filename().string());
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"agents.csv", "columns.csv", "criteria.csv", "edges.csv", "estimates.csv", "events.csv",
                                             "experiment.csv", "links.csv", "metrics.csv", "network.csv", "processes.csv", "results.csv",
                                             "runs.csv", "segments.csv"}));
  EXPECT_EQ(text_of(scratch.path() / "csv" / "estimates.csv"), "run,round,agent,time,x\n0,0,1,0,0.1\n0,0,2,0,0.3333333333333333\n");
  EXPECT_EQ(text_of(scratch.path() / "csv" / "events.csv"), "run,round,time,kind,text\n0,0,0,cut,\"1 -> 2, \"\"both\"\"\"\n");
  EXPECT_EQ(text_of(scratch.path() / "csv" / "links.csv"), "run,sender,receiver,delivered,lost,duplicated,reordered,superseded\n");
}

TEST(Export, FolderWithoutRecordIsRefused) {
  const ScratchFolder scratch;
  EXPECT_THROW(export_record(scratch.path()), ConfigError);
}

}  // namespace
}  // namespace consort
