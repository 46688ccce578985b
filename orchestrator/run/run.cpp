#include "orchestrator/run/run.hpp"

#include "core/errors.hpp"
#include "idl/trust.hpp"
#include "orchestrator/run/job_run.hpp"
#include "orchestrator/run/session.hpp"
#include "rounds/agent_maker.hpp"
#include "rounds/last_round.hpp"

#include <fmt/format.h>
#include <sys/random.h>

#include <algorithm>
#include <chrono>

namespace consort {

bool RunOptions::by_hand(std::span<const AgentId> hosted) const {
  return std::any_of(hosted.begin(), hosted.end(),
                     [&](AgentId agent) { return std::find(external.begin(), external.end(), agent) != external.end(); });
}

std::string random_run_name(const std::string& experiment) {
  std::uint32_t word = 0;
  if (::getrandom(&word, sizeof word, 0) != sizeof word) throw RunError("the kernel gives no random number for the name of the run");
  return fmt::format("{}-{:08x}", experiment, word);
}

std::string run_key() {
  static_assert(std::string_view(kRunKeyVariable) == wire::RunKey::kVariable);
  const auto given = wire::RunKey::secret_of_environment();
  return given ? *given : wire::RunKey::random_secret();
}

namespace {

/// What a protocol refuses of a later seed is said as of the first, with the seed, and not by the process that hosts the agent.
void try_seed(const Experiment& experiment, const Job& job) {
  if (job.seed.value == experiment.seed.value) return;  // was tried as the experiment was read
  try {
    const AgentMaker maker(experiment, experiment.protocols[job.protocol], job.seed);
    for (std::size_t i = 0; i < experiment.agents; ++i) static_cast<void>(maker.make(agent_at(i)));
  } catch (const ConfigError& refusal) {
    throw SeedRefused(job.seed, refusal.what());
  } catch (const RunError& refusal) {  // numbers that mathematics refuses
    throw SeedRefused(job.seed, refusal.what());
  }
}

}  // namespace

SessionTimes run_processes(const Experiment& asked, const RunOptions& options, RunObserver& observer) {
  const auto begin = std::chrono::steady_clock::now();
  Experiment experiment = asked;
  experiment.rounds = last_round(asked);
  experiment.report_every = asked.report_interval();
  const bool until_last_left = experiment.rounds < asked.rounds;
  SessionTimes times;
  Session session(experiment, options);
  try {
    session.launch(observer);
    for (const Job& job : jobs_of(experiment)) {
      try_seed(experiment, job);
      const std::uint32_t epoch = static_cast<std::uint32_t>(job.number) + 1;
      session.assign(job, epoch, observer);
      if (session.interrupted()) break;
      if (job.number == 0) times.startup_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      JobRun run(experiment, options, until_last_left, job, epoch, session, observer);
      run.run();
      times.running_seconds += run.seconds();
      if (session.interrupted()) break;
    }
  } catch (...) {
    observer.refused(session.refusals());
    throw;
  }
  session.shut_down();
  return times;
}

}  // namespace consort
