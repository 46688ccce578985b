#include "orchestrator/run/run.hpp"

#include "core/errors.hpp"
#include "orchestrator/run/event_teller.hpp"
#include "orchestrator/run/spill.hpp"
#include "protocols/registry.hpp"
#include "rounds/simulate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <future>
#include <mutex>
#include <optional>
#include <thread>

namespace consort {
namespace {

using Clock = std::chrono::steady_clock;

double elapsed_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

Trace outline_of(const Experiment& experiment, const Job& job) {
  return AgentMaker(experiment, experiment.protocols.at(job.protocol), job.seed).empty_trace();
}

// What ends a simulation before its stop rule does: the user's signal, or the deadline. Asked from several threads.
class Watch {
 public:
  Watch(const Experiment& experiment, const RunOptions& options)
      : interrupt_(options.interrupt), start_(Clock::now()), deadline_seconds_(experiment.deadline) {}
  [[nodiscard]] Clock::time_point start() const { return start_; }
  [[nodiscard]] bool interrupted() const { return interrupt_ != nullptr && interrupt_->load(std::memory_order_relaxed) != 0; }
  [[nodiscard]] bool expired() const { return elapsed_since(start_) > deadline_seconds_; }
  [[nodiscard]] bool ended() const { return interrupted() || expired(); }

  // Throws if it is time to end before round 0.
  void check_while_made(const Experiment& experiment, const Job& job) const {
    if (interrupted()) throw RunError(fmt::format("interrupted while {} agents were made", experiment.agents));
    if (!expired()) return;
    throw TimeoutError(fmt::format("the deadline of {:g} s passed before round 0, while {} agents were made ({}, seed {}); {}",
                                   deadline_seconds_, experiment.agents, experiment.protocols.at(job.protocol).title(), job.seed.value,
                                   kLongerDeadline));
  }

  // Throws TimeoutError naming the round if it was the deadline that ended `outcome`.
  void check_deadline(const Experiment& experiment, const JobOutcome& outcome) const {
    if (interrupted()) return;
    throw TimeoutError(fmt::format("the deadline of {:g} s passed in round {} of {} ({}, seed {}); {}", deadline_seconds_,
                                   outcome.trace.last_round, experiment.rounds, experiment.protocols.at(outcome.job.protocol).title(),
                                   outcome.job.seed.value, kLongerDeadline));
  }

 private:
  static constexpr std::string_view kLongerDeadline = "a longer one is written `stop: {deadline: ...}` in the experiment";
  const std::atomic<int>* interrupt_;
  Clock::time_point start_;
  Seconds deadline_seconds_;
};

// A finished job with its reports, waiting for its turn to be handed to the observer.
struct Finished {
  JobOutcome outcome;
  Rows<std::uint64_t> hashes, state_hashes;  // of every report, by agent; its values are in the trace
  Rows<AgentCounters> counters;
  double began_seconds = 0.0;  // of round 0, after the call
  bool ended_early = false;
  std::exception_ptr failure = {};  // what the simulation threw; what was known by then is in the outcome

  // Of the exception that is being handled.
  void fail() {
    failure = std::current_exception();
    outcome.end.ending = Ending::failure;
  }

  void add(const RoundReport& report) {
    Shelf* const shelf = outcome.trace.shelf.get();
    hashes.add(report.hashes, shelf);
    state_hashes.add(report.state_hashes, shelf);
    counters.add(report.counters, shelf);
  }

  void replay(const Experiment& experiment, RunObserver& observer) const {
    EventTeller teller(experiment, outcome.job, observer);
    const Trace& trace = outcome.trace;
    for (std::size_t i = 0; i < trace.rounds.size(); ++i) {
      RoundReport report = trace.report(i);
      report.hashes = hashes[i];
      report.counters = counters[i];
      report.state_hashes = state_hashes[i];
      teller.report(report);
    }
    if (outcome.end.ending == Ending::nobody_left) teller.rest(trace.last_round);
  }
};

Ending ending_of(const Experiment& experiment, const Finished& finished, const Watch& watch) {
  if (finished.ended_early) return watch.interrupted() ? Ending::signal : Ending::deadline;
  if (finished.outcome.trace.converged) return Ending::stop_rule;
  return finished.outcome.trace.last_round < experiment.rounds ? Ending::nobody_left : Ending::last_round;
}

// Hands over what a job came to, then throws what ended it, if something did.
void conclude(const Finished& finished, RunObserver& observer) {
  try {
    observer.run_ends(finished.outcome);
  } catch (const std::exception&) {
    if (!finished.failure) throw;  // else that is why
  }
  if (finished.failure) std::rethrow_exception(finished.failure);
}

// Runs one job; `each` sees every report on the way. Ends early when `ended()` says so, or as `while_made` throws.
template <class Each, class Ended>
Finished run_job(const Experiment& experiment, const Job& job, const std::filesystem::path& spill, const Watch& watch,
                 const WhileMade& while_made, Ended&& ended, Each&& each) {
  Finished finished;
  std::optional<Clock::time_point> round_zero;
  const auto sink = [&](const RoundReport& report) {
    if (!round_zero) {
      round_zero = Clock::now();
      finished.began_seconds = elapsed_since(watch.start());
    }
    each(finished, report);
    finished.ended_early = ended();
    return !finished.ended_early;
  };
  finished.outcome.job = job;
  Trace& trace = finished.outcome.trace;
  trace.shelf = spill_in(spill);
  try {
    simulate(experiment, experiment.protocols.at(job.protocol), job.seed, sink, trace, while_made);
  } catch (const ConfigError& refusal) {
    throw SeedRefused(job.seed, refusal.what());
  } catch (const std::exception&) {
    if (trace.rounds.empty()) throw;  // it never began
    finished.fail();
  }
  finished.outcome.seconds = round_zero ? elapsed_since(*round_zero) : 0.0;
  finished.outcome.end.agents = agents_by_plan(experiment, trace.last_round);
  if (!finished.failure) finished.outcome.end.ending = ending_of(experiment, finished, watch);
  return finished;
}

SessionTimes run_one(const Experiment& experiment, const Job& job, const std::filesystem::path& spill, const Watch& watch,
                     RunObserver& observer) {
  observer.run_begins(job, outline_of(experiment, job));
  EventTeller teller(experiment, job, observer);
  const Finished finished = run_job(
      experiment, job, spill, watch, [&] { watch.check_while_made(experiment, job); }, [&] { return watch.ended(); },
      [&](const Finished&, const RoundReport& report) { teller.report(report); });
  if (finished.outcome.end.ending == Ending::nobody_left) teller.rest(finished.outcome.trace.last_round);
  conclude(finished, observer);
  if (finished.ended_early) watch.check_deadline(experiment, finished.outcome);
  return {finished.began_seconds, finished.outcome.seconds};
}

// A job that ends before its round 0, because nobody waits for it any more.
struct Dropped : std::exception {};

// Jobs on all cores. Workers stay at most `window` jobs ahead of what the observer has taken, so memory stays bounded.
class Workers {
 public:
  Workers(const Experiment& experiment, const std::vector<Job>& jobs, const std::filesystem::path& spill, const Watch& watch,
          std::size_t at_once) {
    // A packaged task carries an exception of its simulation to the thread that asks for the result.
    for (const Job& job : jobs) {
      tasks_.emplace_back([&experiment, &spill, &watch, job](const std::stop_token& stop) {
        return run_job(
            experiment, job, spill, watch,
            [&] {
              if (stop.stop_requested() || watch.interrupted()) throw Dropped{};
              watch.check_while_made(experiment, job);
            },
            [&] { return stop.stop_requested() || watch.ended(); },
            [](Finished& finished, const RoundReport& report) { finished.add(report); });
      });
    }
    const std::size_t threads = std::min(at_once > 0 ? at_once : std::max(1u, std::thread::hardware_concurrency()), jobs.size());
    window_ = 2 * threads;
    for (std::size_t i = 0; i < threads; ++i) threads_.emplace_back([this](const std::stop_token& stop) { work(stop); });
  }

  // The next job in order; throws what its simulation threw.
  Finished next() {
    Finished finished = tasks_[taken_].get_future().get();
    {
      const std::lock_guard lock(mutex_);
      ++taken_;
    }
    room_.notify_all();
    return finished;
  }

 private:
  void work(const std::stop_token& stop) {
    for (;;) {
      std::unique_lock lock(mutex_);
      const bool may_go_on = room_.wait(lock, stop, [&] { return started_ == tasks_.size() || started_ < taken_ + window_; });
      if (!may_go_on || started_ == tasks_.size()) return;
      auto& task = tasks_[started_++];
      lock.unlock();
      task(stop);
    }
  }

  std::vector<std::packaged_task<Finished(const std::stop_token&)>> tasks_;
  std::mutex mutex_;
  std::condition_variable_any room_;
  std::size_t started_ = 0, taken_ = 0, window_ = 1;
  std::vector<std::jthread> threads_;  // last member: stopped and joined before anything they use is gone
};

SessionTimes run_many(const Experiment& experiment, const std::vector<Job>& jobs, const RunOptions& options, const Watch& watch,
                      RunObserver& observer) {
  SessionTimes times;
  Trace outline;
  Workers workers(experiment, jobs, options.spill_directory, watch, options.threads);
  for (const Job& job : jobs) {
    if (job.number == 0 || job.protocol != jobs[job.number - 1].protocol) outline = outline_of(experiment, job);
    Finished finished;
    try {
      finished = workers.next();
    } catch (const Dropped&) {
      break;
    }
    observer.run_begins(job, outline);
    try {
      finished.replay(experiment, observer);
    } catch (const std::exception&) {
      finished.fail();
    }
    conclude(finished, observer);
    if (job.number == 0) times.startup_seconds = finished.began_seconds;
    times.running_seconds += finished.outcome.seconds;
    if (!finished.ended_early) continue;
    watch.check_deadline(experiment, finished.outcome);
    break;  // the user's signal: the jobs that have not been taken are dropped
  }
  return times;
}

}  // namespace

std::vector<Job> jobs_of(const Experiment& experiment) {
  std::vector<Job> jobs;
  for (std::size_t protocol = 0; protocol < experiment.protocols.size(); ++protocol) {
    for (std::size_t run = 0; run < experiment.runs; ++run) jobs.push_back({jobs.size(), protocol, Seed{experiment.seed.value + run}});
  }
  return jobs;
}

SessionTimes run_simulated(const Experiment& experiment, const RunOptions& options, RunObserver& observer) {
  const Watch watch(experiment, options);
  const std::vector<Job> jobs = jobs_of(experiment);
  check(!jobs.empty(), "an experiment has at least one protocol and one run");
  const std::filesystem::path& spill = options.spill_directory;
  return jobs.size() == 1 ? run_one(experiment, jobs.front(), spill, watch, observer)
                          : run_many(experiment, jobs, options, watch, observer);
}

}  // namespace consort
