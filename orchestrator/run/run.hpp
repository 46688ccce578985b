#pragma once
/// Running an experiment: the same jobs, the same observer, two drivers.

#include "core/errors.hpp"
#include "core/experiment.hpp"
#include "core/trace.hpp"
#include "idl/refusal.hpp"
#include "orchestrator/run/ending.hpp"
#include "orchestrator/script/hosts.hpp"

#include <atomic>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace consort {

/// One run of the experiment: one protocol, one seed. Jobs are ordered protocol by protocol, seeds ascending.
struct Job {
  std::size_t number = 0;    ///< 0, 1, ... in order
  std::size_t protocol = 0;  ///< index into Experiment::protocols
  Seed seed;
};
std::vector<Job> jobs_of(const Experiment& experiment);

struct JobOutcome {
  Job job;
  Trace trace;
  double seconds = 0.0;  ///< wall clock from round 0 to the last round
  RunEnd end = {};
};

/// A protocol refuses what a run with this seed would start from.
struct SeedRefused : ConfigError {
  SeedRefused(Seed of, const std::string& text) : ConfigError(text), seed(of) {}
  Seed seed;
};

/// Watches a run. All calls come from one thread, in order; run_begins .. run_ends nest per job.
class RunObserver {
 public:
  virtual ~RunObserver() = default;
  /// Processes found (they said hello) and ready (they met their neighbours), of `total`. Not called by simulate.
  virtual void launching(std::size_t found, std::size_t ready, std::size_t total) = 0;
  /// `outline`: the trace before its first report.
  virtual void run_begins(const Job& job, const Trace& outline) = 0;
  virtual void report(const Job& job, const RoundReport& report) = 0;
  /// Something worth keeping: an agent died, an event took effect, a stall.
  virtual void event(const Job& job, Round round, const std::string& kind, const std::string& text) = 0;
  virtual void run_ends(const JobOutcome& outcome) = 0;
  /// Something worth knowing before the first job begins: somebody came who may not take part.
  virtual void remark(const std::string& text) { static_cast<void>(text); }
  /// What the processes have refused since the session began. Called at the end of each job.
  virtual void refused(const std::vector<Refusal>& refusals) { static_cast<void>(refusals); }
};

class PortBlock;

struct RunOptions {
  std::string run_name;                 ///< discovery tag; unique per run
  int domain = -1;                      ///< DDS domain; -1: derived from run_name
  std::string interface = "lo";         ///< network interface of all processes (name or address); another than lo for agents on other hosts
  bool open_domain = false;             ///< no discovery tag: whoever looks on in the domain sees the run
  std::filesystem::path log_directory;  ///< one log per process; must exist
  std::filesystem::path spill_directory;         ///< where reports go that are too many for memory; empty: nowhere
  std::filesystem::path agent_executable;        ///< consort-agent; consort-plant stands beside it
  std::vector<AgentId> external;                 ///< started by hand, not launched here
  std::string key = {};                          ///< secret the processes know each other by; empty: a random one
  bool external_plant = false;                   ///< the same of the plant
  std::vector<Host> hosts = {};                  ///< where processes are started; none: all here
  std::vector<std::string> host_addresses = {};  ///< by host: numeric, under which the others find its processes
  std::shared_ptr<const PortBlock> ports = {};   ///< of a run that states them; none: it looks for some
  double tell_awaited_seconds = 10.0;            ///< for so long nothing is said of whoever has not come yet, and then so often
  double last_reports_seconds = 5.0;             ///< real time: for so long after the last round, reports under way are waited for
  std::size_t threads = 0;                       ///< simulate: so many jobs at once; 0: one per core
  const std::atomic<int>* interrupt = nullptr;   ///< signal number once the user asked to stop; 0 before

  /// Is a process that hosts these agents started by hand?
  [[nodiscard]] bool by_hand(std::span<const AgentId> hosted) const;
  /// Processes may come that this run does not start, or that are on other hosts.
  [[nodiscard]] bool expects_others() const { return !external.empty() || external_plant || interface != "lo"; }
};

/// Environment variable that holds a run's key.
constexpr const char* kRunKeyVariable = "CONSORT_KEY";
/// What it holds, or a random key. Throws ConfigError if that is too short to be a secret.
std::string run_key();
/// <experiment>-<random>: unique among those that run.
std::string random_run_name(const std::string& experiment);

struct SessionTimes {
  double startup_seconds = 0.0;  ///< from the call to round 0 of the first job, everything included
  double running_seconds = 0.0;  ///< sum over jobs of round 0 .. last round
};

/// Real processes over DDS (lockstep). Throws RunError (a process died, DDS failed: names agent, pid, signal, last log lines) or
/// TimeoutError (says who is missing or who waits for whom). On interrupt it ends the processes and returns what it has.
SessionTimes run_processes(const Experiment& experiment, const RunOptions& options, RunObserver& observer);

/// The same jobs through simulate(). With one job reports stream to the observer as they come; with several they run on all cores and are
/// handed over job by job, in order.
SessionTimes run_simulated(const Experiment& experiment, const RunOptions& options, RunObserver& observer);

}  // namespace consort
