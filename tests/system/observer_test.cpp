// The distributed observer and cooperative localisation by real processes.

#include "orchestrator/script/script.hpp"
#include "tests/support/process_run.hpp"
#include "tests/support/same_trace.hpp"
#include "tests/support/tree.hpp"

#include <gtest/gtest.h>

#include <filesystem>

namespace consort {
namespace {

Experiment shipped(const std::string& name) {
  return load_experiment(std::filesystem::path(kSourceDir) / "experiments" / (name + ".yaml"));
}

TEST(Observer, TheShippedJoinEqualsItsSimulation) {
  const Experiment experiment = shipped("observer_join");
  const auto outcome = run_over_dds(experiment);
  expect_same_traces(outcome, run_in_simulation(experiment));
  const Trace& trace = outcome.at(0).trace;
  EXPECT_TRUE(is_absent(trace.at(0, AgentId{1})[6]));
  EXPECT_FALSE(is_absent(trace.final_estimate(AgentId{1})[6])) << "everybody estimates the newcomer";
  EXPECT_FALSE(is_absent(trace.final_estimate(AgentId{4})[0])) << "and the newcomer everybody";
}

TEST(Observer, TheShippedLeaveEqualsItsSimulation) {
  const Experiment experiment = shipped("observer_leave");
  const auto outcome = run_over_dds(experiment);
  expect_same_traces(outcome, run_in_simulation(experiment));
  EXPECT_TRUE(is_absent(outcome.at(0).trace.final_estimate(AgentId{1})[2])) << "agent 2 is forgotten";
}

TEST(SensorNetworkObserver, WithAJoinAndALeaveEqualsItsSimulation) {
  Experiment experiment = shipped("beam");
  experiment.rounds = 600;
  experiment.presence[AgentId{6}] = {200, Attendance{}.until, {}};
  experiment.presence[AgentId{5}] = {0, 400, {}};
  const auto outcome = run_over_dds(experiment);
  expect_same_traces(outcome, run_in_simulation(experiment));
  EXPECT_TRUE(is_absent(outcome.at(0).trace.at(0, AgentId{6})[0]));
  EXPECT_FALSE(is_absent(outcome.at(0).trace.final_estimate(AgentId{6})[0])) << "it has joined";
  EXPECT_TRUE(is_absent(outcome.at(0).trace.final_estimate(AgentId{5})[0])) << "it has left";
}

TEST(Localisation, WithAJoinAndALeaveEqualsItsSimulation) {
  Experiment experiment = parse_experiment(
      "experiment: t\nrounds: 600\ndt: 0.02\n"
      "agents: {count: 5, protocol: {name: cooperative_localization, F: -1}}\n"
      "plant:\n  model: {name: integrator, dimension: 2}\n  initial: {position: [[1, 2], [3, 4], [5, 2], [2, 2], [1, 4]]}\n"
      "  sensing: {relative: {1: [2], 2: [3], 3: [4], 4: [5], 5: [1]}, absolute: [2, 4]}\n"
      "topology: complete\nevents: [{round: 200, leave: 4}, {round: 300, join: 5}]\n",
      "t.yaml", ".");
  experiment.report_every = 7;
  const auto simulated = run_in_simulation(experiment);
  expect_same_traces(run_over_dds(experiment), simulated);
  experiment.agents_per_process = 2;
  expect_same_traces(run_over_dds(experiment), simulated);
}

}  // namespace
}  // namespace consort
