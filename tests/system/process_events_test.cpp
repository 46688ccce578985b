/// Kill, restart, stop, continue, leave and join as the file schedules them: real processes, real signals, the simulated trace.

#include "orchestrator/script/script.hpp"
#include "tests/support/process_run.hpp"
#include "tests/support/same_trace.hpp"
#include "tests/support/tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace consort {
namespace {

Experiment case_of(const std::string& more) {
  return parse_experiment(R"(
experiment: events
seed: 9
rounds: 300
dt: 0.05
links: {loss: 0.2, overrides: [{edge: 2 -> 3, delay_rounds: 3}]}
)" + more,
                          "events.yaml", ".");
}

/// The same for fewer agents.
Experiment small_case_of(const std::string& more) {
  return parse_experiment("experiment: few\nseed: 9\nrounds: 300\ndt: 0.05\nlinks: {loss: 0.2}\n" + more, "few.yaml", ".");
}

/// Four integrators and a plant; agent 3 dies and comes back.
constexpr const char* kTeam = R"(
agents: {count: 5, protocol: local_voting, initial: {x: 0}}
topology: ring
plant: {model: integrator, initial: {position: [1, 2, 30, 4, 5]}, disturbances: [{on: measurement, gaussian: {deviation: 0.01}}]}
)";

bool tells(const Keeper& keeper, const std::string& what) {
  return std::find(keeper.events.begin(), keeper.events.end(), what) != keeper.events.end();
}

bool absent_in(const Trace& trace, Round k, std::uint32_t agent) {
  const auto report = std::find(trace.rounds.begin(), trace.rounds.end(), k);
  EXPECT_NE(report, trace.rounds.end()) << "round " << k << " is not reported";
  return is_absent(trace.state_at(static_cast<std::size_t>(report - trace.rounds.begin()), AgentId{agent})[0]);
}

TEST(ProcessEvents, AKilledAgentThatComesBackGivesTheSimulatedTrace) {
  // The interval divides neither round, so who is killed has to be asked how it stands.
  for (const char* telemetry : {"", "telemetry: {every: 7}\n"}) {
    SCOPED_TRACE(telemetry);
    const Experiment experiment =
        case_of(std::string(kTeam) + telemetry + "events: [{round: 100, kill: 3}, {round: 173, restart: 3}, {round: 240, kill: 3}]");
    const auto outcome = run_over_dds(experiment);
    expect_same_traces(outcome, run_in_simulation(experiment));
    EXPECT_FALSE(absent_in(outcome[0].trace, 98, 3));
    EXPECT_TRUE(absent_in(outcome[0].trace, 126, 3)) << "killed before round 100";
    EXPECT_FALSE(absent_in(outcome[0].trace, 175, 3)) << "back from round 173 on";
    EXPECT_TRUE(absent_in(outcome[0].trace, 245, 3));
  }
}

TEST(ProcessEvents, WhoLeavesMayJoinAgainAndAgainInEveryRunOfASession) {
  Experiment experiment =
      case_of(std::string(kTeam) +
              "runs: 2\nevents: [{round: 20, leave: 2}, {round: 60, join: 2}, {round: 61, leave: 5}, {round: 90, leave: 2}, "
              "{round: 120, join: [2, 5]}, {round: 130, kill: 4}, {round: 131, restart: 4}]");
  const auto simulated = run_in_simulation(experiment);
  expect_same_traces(run_over_dds(experiment), simulated);
  experiment.agents_per_process = 2;
  expect_same_traces(run_over_dds(experiment), simulated);
  experiment.discovery = Discovery::neighbours;
  expect_same_traces(run_over_dds(experiment), simulated);
}

TEST(ProcessEvents, WhoComesBackWaitsForNobodyThatIsNotThere) {
  // When agent 5 does, agent 3 has left, agent 1 is dead for good, and agent 4 is still to come back.
  const std::string events =
      "events: [{round: 20, leave: 3}, {round: 25, kill: 1}, {round: 30, kill: 4}, {round: 40, kill: 5}, {round: 60, restart: 5}, "
      "{round: 90, restart: 4}]\n";
  constexpr const char* kObservers = R"(
agents: {count: 5, protocol: {name: distributed_observer, mu: 5, weights: binary, F: 2}}
topology: complete
plant: {model: {name: linear, A: [[-0.1]]}, initial: {x: {uniform: [-1, 1]}}, couplings: [{edge: 1 -> 2, A: [[0.5]], C: [[0.5]]}]}
)";
  for (const char* team : {kTeam, kObservers}) {
    SCOPED_TRACE(team);
    Experiment experiment = case_of(team + events);
    if (team == kObservers) experiment.dt = 0.001;
    expect_same_traces(run_over_dds(experiment), run_in_simulation(experiment));
  }
}

TEST(ProcessEvents, TheRunEndsWhenTheLastOneIsGoneAndNoneWillCome) {
  const std::string plant = "plant: {model: integrator, initial: {position: {linspace: [0, 1]}}}\n";
  for (const std::string& text : {std::string("agents: {count: 4, protocol: local_voting, initial: {x: [0, 1, 2, 3]}}\ntopology: complete\n"
                                              "events: [{round: 50, leave: 1}, {round: 50, leave: 2}, {round: 50, leave: 3}, "
                                              "{round: 50, leave: 4}]\n"),
                                  std::string("agents: {count: 1, protocol: local_voting, initial: {x: 1}}\n"
                                              "topology: {edges: []}\nevents: [{round: 50, kill: 1}]\n"),
                                  "agents: {count: 2, protocol: local_voting, initial: {x: 0}}\ntopology: complete\n"
                                  "events: [{round: 20, kill: 1}, {round: 50, leave: 2}]\n" +
                                      plant}) {
    SCOPED_TRACE(text);
    const Experiment experiment = small_case_of(text);
    Keeper keeper;
    const auto outcome = run_over_dds(experiment, nullptr, &keeper);
    expect_same_traces(outcome, run_in_simulation(experiment));
    EXPECT_EQ(outcome.at(0).trace.last_round, 50u);
    EXPECT_EQ(outcome.at(0).end.ending, Ending::nobody_left);
    EXPECT_TRUE(std::any_of(keeper.events.begin(), keeper.events.end(), [](const std::string& event) {
      return event.starts_with("leave: ") || event.starts_with("kill: ");
    })) << "what ends the run is told";
  }
}

TEST(ProcessEvents, EverybodyMayBeAwayForAWhile) {
  for (const char* plant : {"", "plant: {model: integrator, initial: {position: {linspace: [0, 1]}}}\n"}) {
    SCOPED_TRACE(plant);
    const Experiment experiment = small_case_of(std::string(R"(
agents: {count: 2, protocol: local_voting, initial: {x: 0}}
topology: complete
events: [{round: 40, leave: 1}, {round: 50, kill: 2}, {round: 90, restart: 2}, {round: 100, join: 1}]
)") + plant);
    const auto outcome = run_over_dds(experiment);
    expect_same_traces(outcome, run_in_simulation(experiment));
    EXPECT_EQ(outcome.at(0).trace.last_round, 300u);
    EXPECT_EQ(outcome.at(0).end.ending, Ending::last_round);
  }
}

TEST(ProcessEvents, AnObserverThatIsRestartedIsToldAgainWhatOthersAnnounced) {
  Experiment experiment = load_experiment(std::filesystem::path(kSourceDir) / "experiments" / "observer_join.yaml");
  experiment.rounds = 1200;
  experiment.presence.clear();
  experiment.presence[AgentId{2}] = {0, 300, {{700}}};
  experiment.faults = {{300, AgentId{2}, Fault::Kind::kill}, {700, AgentId{2}, Fault::Kind::restart}};
  expect_same_traces(run_over_dds(experiment), run_in_simulation(experiment));
}

TEST(ProcessEvents, AStragglerIsWaitedForAndChangesNothing) {
  const Experiment experiment = case_of(std::string(kTeam) + "events: [{round: 50, stop: [2, 4]}, {round: 70, continue: [2, 4]}]");
  Keeper keeper;
  const auto outcome = run_over_dds(experiment, nullptr, &keeper);
  expect_same_traces(outcome, run_in_simulation(experiment));
  EXPECT_GE(outcome[0].seconds, 0.9) << "20 rounds of 0.05 s asleep";
  EXPECT_TRUE(tells(keeper, "stop: agent 2")) << "an entry in the record";
  EXPECT_TRUE(tells(keeper, "continue: agent 4"));
}

TEST(PatientProcessEvents, AStopMayLastLongerThanDdsWaitsForASilentParticipantByDefault) {
  const Experiment experiment = case_of(std::string(kTeam) + "events: [{round: 50, stop: 2}, {round: 290, continue: 2}]");
  const auto outcome = run_over_dds(experiment);
  expect_same_traces(outcome, run_in_simulation(experiment));
  EXPECT_GE(outcome[0].seconds, 11.9) << "240 rounds of 0.05 s asleep";
}

#ifndef CONSORT_SANITIZE  // sanitizers keep what was freed
TEST(Memory, DoesNotGrowWithTheRounds) {
  const auto largest = [](Round rounds) {
    Experiment experiment = parse_experiment(R"(
experiment: memory
rounds: 1
dt: 0.1
agents: {count: 3, protocol: local_voting, initial: {x: {linspace: [0, 1]}}}
topology: ring
)",
                                             "memory.yaml", ".");
    experiment.rounds = rounds;
    std::uint64_t bytes = 0;
    for (const Performance& process : run_over_dds(experiment).at(0).trace.processes) bytes = std::max(bytes, process.resident_bytes);
    return bytes;
  };
  const std::uint64_t of_ten_thousand = largest(10'000), of_fifty_thousand = largest(50'000);
  EXPECT_GT(of_ten_thousand, 1'000'000U);
  EXPECT_LT(of_fifty_thousand, of_ten_thousand + 6'000'000) << "40,000 unacknowledged messages would be 18 MB";
}
#endif

TEST(ProcessEvents, AStoppedProcessDoesNotKeepARestartFromHappening) {
  const Experiment experiment = case_of(
      std::string(kTeam) + "events: [{round: 30, kill: 1}, {round: 50, stop: 4}, {round: 51, restart: 1}, {round: 60, continue: 4}]");
  expect_same_traces(run_over_dds(experiment), run_in_simulation(experiment));
}

TEST(ProcessEvents, MayFillTheWholeRunAndFallOnNeighbours) {
  const Experiment experiment = case_of(std::string(kTeam) +
                                        "events: [{round: 10, kill: [1, 2]}, {round: 11, kill: 3}, {round: 12, restart: [1, 2]}, {round: "
                                        "13, restart: 3}, {round: 299, kill: 5}]");
  expect_same_traces(run_over_dds(experiment), run_in_simulation(experiment));
}

class PatientTransportLoss : public testing::TestWithParam<double> {};

TEST_P(PatientTransportLoss, EveryRunStartsRunsEndsAndAccountsForIt) {
  Experiment experiment = case_of(std::string(kTeam) + "events: [{round: 6, join: 5}, {round: 9, kill: 2}, {round: 12, restart: 2}]");
  experiment.rounds = 20;
  experiment.transport.loss = GetParam();
  Keeper keeper;
  expect_same_traces(run_over_dds(experiment, nullptr, &keeper), run_in_simulation(experiment));
  const bool told = std::any_of(keeper.events.begin(), keeper.events.end(),
                                [](const std::string& event) { return event.find("sent again") != std::string::npos; });
  EXPECT_TRUE(told) << "what the transport repeated is told";
}
INSTANTIATE_TEST_SUITE_P(Loss, PatientTransportLoss, testing::Values(0.05, 0.1, 0.2));

}  // namespace
}  // namespace consort
