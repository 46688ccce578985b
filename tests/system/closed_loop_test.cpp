/// The closed loop over DDS: plant process, measurements, actuations, agents that join and leave. Equal to simulate(), bit for bit.

#include "core/errors.hpp"
#include "orchestrator/script/script.hpp"
#include "tests/support/process_run.hpp"
#include "tests/support/same_trace.hpp"
#include "tests/support/tree.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

Experiment experiment_of(const std::string& text) { return parse_experiment(text, "closed_loop.yaml", "."); }

Experiment everything_disturbed() {
  return experiment_of(R"(
experiment: everything_disturbed
seed: 9
rounds: 300
dt: 0.02
agents: {count: 7, protocol: local_voting, initial: {x: 0}}
topology: {random_links: {base: complete, probability: 0.5}}
links: {loss: 0.1, noise_covariance: 0.001, overrides: [{edge: 2 -> 3, delay_rounds: 3}]}
plant:
  model: integrator
  initial: {position: {uniform: [-5, 5]}}
  disturbances:
    - {on: measurement, gaussian: {deviation: 0.05}, hold: 0.1 s}
    - {on: state, gaussian: {intensity: 0.01}}
    - {on: input, sinusoid: {amplitude: 0.1, frequency: 2, phase: {linspace: [0, 3]}}}
    - {on: input, uniform: {bound: 0.1}, agents: [3, 4]}
    - {on: state, constant: 0.01}
events: [{round: 100, cut: [1 -> 2]}]
)");
}

TEST(ClosedLoop, EqualsSimulationUnderEveryDisturbance) {
  const Experiment experiment = everything_disturbed();
  expect_same_traces(run_over_dds(experiment), run_in_simulation(experiment));
}

TEST(ClosedLoop, PlacementAndDiscoveryChangeNothing) {
  Experiment experiment = everything_disturbed();
  experiment.rounds = 100;
  const auto simulated = run_in_simulation(experiment);
  for (const std::size_t per_process : {1u, 3u, 7u}) {
    for (const Discovery discovery : {Discovery::multicast, Discovery::neighbours}) {
      SCOPED_TRACE(testing::Message() << per_process << " agents per process, discovery " << static_cast<int>(discovery));
      experiment.agents_per_process = per_process;
      experiment.discovery = discovery;
      expect_same_traces(run_over_dds(experiment), simulated);
    }
  }
}

TEST(ClosedLoop, APlantThatNobodySteersRunsBesideTheAgents) {
  Experiment experiment = everything_disturbed();
  experiment.protocols = {{"kalman_consensus", {}}};
  experiment.protocols[0].parameters.set("Q", 0.1);
  experiment.protocols[0].parameters.set("Omega", 0.1);
  const auto outcome = run_over_dds(experiment);
  expect_same_traces(outcome, run_in_simulation(experiment));
  EXPECT_FALSE(outcome.at(0).trace.agrees_on_states);
  EXPECT_EQ(outcome.at(0).trace.state_dimension, 1u);
}

TEST(ClosedLoop, SeveralSeedsAndProtocolsUseTheSameProcesses) {
  Experiment experiment = everything_disturbed();
  experiment.rounds = 60;
  experiment.runs = 2;
  ProtocolChoice other{"kalman_consensus", {}};
  other.parameters.set("Q", 0.1);
  other.parameters.set("Omega", 0.1);
  experiment.protocols.push_back(other);
  expect_same_traces(run_over_dds(experiment), run_in_simulation(experiment));
}

TEST(Seeds, OneThatAProtocolRefusesIsSaidAlikeWithProcessesAndWithout) {
  const auto with_seed = [](std::uint64_t seed) {
    return parse_experiment("experiment: drawn\ntopology: ring\nrounds: 5\nseed: " + std::to_string(seed) +
                                "\nagents: {count: 3, protocol: kalman_consensus, initial: {x: 1, P: {uniform: [-0.2, 1]}}}\n",
                            "drawn.yaml", ".");
  };
  const auto refused = [&](std::uint64_t seed) {
    try {
      static_cast<void>(with_seed(seed));
      return false;
    } catch (const ConfigError&) {
      return true;
    }
  };
  std::uint64_t seed = 1;
  while (refused(seed) || !refused(seed + 1)) ++seed;
  Experiment experiment = with_seed(seed);
  experiment.runs = 2;  // so many that the reader does not try them all
  for (const auto run : {+[](const Experiment& each) { run_over_dds(each); }, +[](const Experiment& each) { run_in_simulation(each); }}) {
    try {
      run(experiment);
      ADD_FAILURE() << "the second run was not refused";
    } catch (const SeedRefused& refusal) {
      EXPECT_EQ(refusal.seed.value, seed + 1);
      EXPECT_NE(std::string(refusal.what()).find("P"), std::string::npos) << refusal.what();
    }
  }
}

Experiment somebody_joins(const std::string& events) {
  return experiment_of(R"(
experiment: somebody_joins
seed: 4
rounds: 400
dt: 0.02
agents: {count: 6, protocol: local_voting, initial: {x: 0}}
topology: ring
links: {loss: 0.1, overrides: [{edge: 2 -> 1, delay_rounds: 2}]}
plant:
  model: integrator
  initial: {position: [1, 2, 3, 4, 5, 60]}
  disturbances: [{on: measurement, gaussian: {deviation: 0.01}}]
)" + events);
}

TEST(Joining, ARealProcessStartsMidRunAndTheRunEqualsTheSimulation) {
  const Experiment experiment = somebody_joins("events: [{round: 150, join: 6}, {round: 150, cut: [5 <-> 1]}]");
  std::string log;
  const auto outcome = run_over_dds(experiment, &log);
  expect_same_traces(outcome, run_in_simulation(experiment));
  const Trace& trace = outcome.at(0).trace;
  EXPECT_TRUE(is_absent(trace.state_at(100, AgentId{6})[0])) << "not there yet";
  EXPECT_EQ(trace.state_at(150, AgentId{6})[0], 60.0);
  EXPECT_LT(trace.state_at(400, AgentId{6})[0], 50.0) << "the others pull";
}

TEST(Joining, TheShippedJoinExperimentEqualsItsSimulationToItsEnd) {
  const Experiment experiment = load_experiment(std::filesystem::path(kSourceDir) / "experiments" / "adaptive_ring5_join.yaml");
  expect_same_traces(run_over_dds(experiment), run_in_simulation(experiment));
}

TEST(Joining, NeedNotFallOnAReportedRoundAndMayComeTwice) {
  Experiment experiment = somebody_joins("events: [{round: 1, join: 2}, {round: 77, join: [4, 6]}, {round: 213, join: 5}]");
  experiment.report_every = 10;
  const auto simulated = run_in_simulation(experiment);
  expect_same_traces(run_over_dds(experiment), simulated);
  experiment.agents_per_process = 3;
  expect_same_traces(run_over_dds(experiment), simulated);
  experiment.discovery = Discovery::neighbours;
  expect_same_traces(run_over_dds(experiment), simulated);
}

TEST(Joining, NeedsNoPlantAndHappensInEveryRunOfASession) {
  Experiment experiment = somebody_joins("events: [{round: 50, join: 3}]");
  experiment.plant.reset();
  experiment.rounds = 120;
  experiment.runs = 3;
  expect_same_traces(run_over_dds(experiment), run_in_simulation(experiment));
}

TEST(Leaving, TheRestGoOnWithoutThem) {
  for (const std::size_t per_process : {1u, 4u}) {
    SCOPED_TRACE(per_process);
    Experiment experiment = somebody_joins("events: [{round: 33, leave: 2}, {round: 100, join: 6}, {round: 250, leave: [6, 1]}]");
    experiment.report_every = 7;
    experiment.agents_per_process = per_process;
    const auto outcome = run_over_dds(experiment);
    expect_same_traces(outcome, run_in_simulation(experiment));
    EXPECT_TRUE(is_absent(outcome.at(0).trace.final_estimate(AgentId{2})[0]));
  }
}

TEST(Leaving, EndsTheProcessAndTheNextRunOfTheSessionHasItBack) {
  Experiment experiment = somebody_joins("events: [{round: 33, leave: 2}, {round: 100, join: 6}]");
  experiment.rounds = 150;
  experiment.runs = 3;
  expect_same_traces(run_over_dds(experiment), run_in_simulation(experiment));
  experiment.discovery = Discovery::neighbours;
  expect_same_traces(run_over_dds(experiment), run_in_simulation(experiment));
}

TEST(Plant, ThatDivergesEndsTheRunNamingAgentRoundAndModel) {
  Experiment experiment = everything_disturbed();
  experiment.plant->model = "linear";
  experiment.plant->parameters.set("A", 1.0);
  experiment.plant->initial = {{"x", {PerAgent::Same{Matrix::Constant(1, 1, 1.0)}}}};
  experiment.plant->overrides[AgentId{5}].parameters.set("A", 1000.0);
  try {
    run_over_dds(experiment);
    FAIL() << "a state beyond every number went unnoticed";
  } catch (const RunError& error) {
    const std::string text = error.what();
    for (const char* part : {"plant", "linear", "agent 5", "round"}) EXPECT_NE(text.find(part), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace consort
