/// A stranger in the run's own domain writes on every topic: nothing of it counts, and all of it is counted.

#include "orchestrator/report/results.hpp"
#include "orchestrator/script/script.hpp"
#include "tests/support/process_run.hpp"
#include "tests/support/same_trace.hpp"
#include "tests/support/tree.hpp"
#include "tests/system/stranger.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <exception>
#include <set>
#include <thread>

namespace consort {
namespace {

constexpr const char* kLoop = R"(
experiment: attacked
seed: 4
rounds: 4000
dt: 0.01
agents: {count: 5, protocol: local_voting}
topology: ring
links: {loss: 0.1}
plant: {model: integrator, initial: {position: {linspace: [0, 1]}}}
telemetry: {every: 10}
stop: {deadline: 240 s}
)";

struct Attacked {
  Keeper keeper;
  std::string writer;  // the stranger's participant
};

/// Runs the experiment over DDS with a stranger who attacks from before it begins until it is over.
Attacked attacked(Experiment experiment, std::uint32_t wire_domain) {
  const Folder logs;
  Attacked result;
  RunOptions options;
  options.run_name = unique_run_name("attacked");
  options.domain = static_cast<int>(wire_domain);
  options.log_directory = logs.path();
  options.agent_executable = std::filesystem::path(kBinDir) / "consort-agent";
  experiment.discovery = Discovery::multicast;
  std::atomic<bool> over{false};
  std::exception_ptr failure;
  Stranger stranger(wire_domain + 100, wire_domain, options.run_name, static_cast<std::uint32_t>(experiment.agents));
  for (const unsigned char byte : stranger.guid().v) {
    constexpr char kDigits[] = "0123456789abcdef";
    result.writer += {kDigits[byte / 16], kDigits[byte % 16]};
  }
  std::thread run([&] {
    try {
      run_processes(experiment, options, result.keeper);
    } catch (...) {
      failure = std::current_exception();
    }
    over = true;
  });
  for (Round round = 0; !over; round += 20) {
    stranger.attack(round % experiment.rounds);
    poll(nullptr, 0, 20);
  }
  run.join();
  if (failure) std::rethrow_exception(failure);
  return result;
}

TEST(Hostile, WhatAStrangerWritesOnEveryTopicChangesNothingAndIsCountedAndNamed) {
  const Experiment experiment = parse_experiment(kLoop, "attacked.yaml", ".");
  const Attacked seen = attacked(experiment, 71);
  expect_same_traces(seen.keeper.outcomes, run_in_simulation(experiment));

  std::set<std::string> topics;
  std::uint64_t malformed = 0;
  for (const Refusal& refusal : seen.keeper.refusals) {
    if (refusal.reason == Refusal::Reason::malformed) {  // DDS itself cannot read the garbage
      malformed += refusal.samples;
      continue;
    }
    EXPECT_EQ(refusal.reason, Refusal::Reason::stranger) << refusal.topic << ": " << refusal.field;
    if (refusal.writer != seen.writer) continue;  // the garbage has participants of its own
    if (refusal.samples > 0) topics.insert(refusal.topic);
    EXPECT_NE(refusal.who.find("pid " + std::to_string(getpid())), std::string::npos) << refusal.who;
  }
  EXPECT_GT(malformed, 0u);
  EXPECT_EQ(topics, (std::set<std::string>{"consort_actuation", "consort_assignment", "consort_command", "consort_grant",
                                           "consort_information", "consort_layout", "consort_measurement", "consort_plant_assignment",
                                           "consort_presence", "consort_standing", "consort_telemetry"}));
  const auto named = std::find_if(seen.keeper.events.begin(), seen.keeper.events.end(), [&](const std::string& event) {
    return event.find("stranger") != std::string::npos && event.find(seen.writer) != std::string::npos;
  });
  EXPECT_NE(named, seen.keeper.events.end()) << "the run itself tells of the stranger";
}

TEST(Hostile, ForgedAnnouncementsDoNotReachAgentsThatListenToThem) {
  ScriptOverrides shorter;
  shorter.rounds = 1500;
  const Experiment experiment = load_experiment(std::filesystem::path(kSourceDir) / "experiments" / "observer_mas.yaml", shorter);
  const Attacked seen = attacked(experiment, 72);
  expect_same_traces(seen.keeper.outcomes, run_in_simulation(experiment));
  EXPECT_GT(samples_of(seen.keeper.refusals), 0u);
}

}  // namespace
}  // namespace consort
