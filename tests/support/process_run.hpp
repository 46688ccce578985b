#pragma once
/// Runs an experiment through real agent processes inside a test, and keeps what the observer sees.

#include "orchestrator/run/run.hpp"
#include "tests/support/program.hpp"
#include "tests/support/tree.hpp"

#include <algorithm>
#include <atomic>

namespace consort {

/// Keeps everything, for comparison.
class Keeper : public RunObserver {
 public:
  void launching(std::size_t, std::size_t, std::size_t) override {}
  void run_begins(const Job&, const Trace&) override {}
  void report(const Job&, const RoundReport&) override { ++reports; }
  void event(const Job&, Round, const std::string& kind, const std::string& text) override { events.push_back(kind + ": " + text); }
  void remark(const std::string& text) override { events.push_back("remark: " + text); }
  void run_ends(const JobOutcome& outcome) override { outcomes.push_back(outcome); }
  void refused(const std::vector<Refusal>& what) override { refusals = what; }

  std::vector<JobOutcome> outcomes;
  std::vector<std::string> events;
  std::vector<Refusal> refusals;
  std::size_t reports = 0;
};

/// A name no other run on this host has.
inline std::string unique_run_name(const std::string& stem) {
  static std::atomic<int> number{0};
  return stem + "-" + std::to_string(getpid()) + "-" + std::to_string(number++);
}

/// `watcher`: keeps the events as well.
inline std::vector<JobOutcome> run_over_dds(const Experiment& experiment, std::string* log = nullptr, Keeper* watcher = nullptr,
                                            RunOptions options = {}) {
  const Folder logs;
  Keeper own;
  Keeper& keeper = watcher ? *watcher : own;
  options.run_name = unique_run_name("test");
  options.log_directory = logs.path();
  options.agent_executable = std::filesystem::path(kBinDir) / "consort-agent";
  constexpr double kPatience = 500.0;  // s; below the test's own limit, so that a stall says who waits for whom
  Experiment patient = experiment;
  patient.deadline = std::min(patient.deadline, kPatience);
  run_processes(patient, options, keeper);
  if (log) *log = text_of(logs.path() / "agent-1.log");
  return keeper.outcomes;
}

inline std::vector<JobOutcome> run_in_simulation(const Experiment& experiment) {
  Keeper keeper;
  run_simulated(experiment, {}, keeper);
  return keeper.outcomes;
}

}  // namespace consort
