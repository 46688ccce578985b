#include "orchestrator/run/run.hpp"

#include "core/errors.hpp"
#include "orchestrator/run/event_teller.hpp"
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

RunLayouts layouts_of(const Experiment& experiment, const Job& job) {
  const ProtocolChoice& choice = experiment.protocols.at(job.protocol);
  return consort::layouts_of(experiment, choice, AgentMaker(experiment, choice, job.seed));
}

/// What ends a simulation before its stop rule does: the user's signal, or the deadline. Asked from several threads.
class Watch {
 public:
  Watch(const Experiment& experiment, const RunOptions& options)
      : interrupt_(options.interrupt), start_(Clock::now()), deadline_seconds_(experiment.deadline) {}
  [[nodiscard]] Clock::time_point start() const { return start_; }
  [[nodiscard]] bool interrupted() const { return interrupt_ != nullptr && interrupt_->load(std::memory_order_relaxed) != 0; }
  [[nodiscard]] bool expired() const { return elapsed_since(start_) > deadline_seconds_; }
  [[nodiscard]] bool ended() const { return interrupted() || expired(); }

  /// Throws TimeoutError naming the round if it was the deadline that ended `outcome`.
  void check_deadline(const Experiment& experiment, const JobOutcome& outcome) const {
    if (interrupted()) return;
    throw TimeoutError(
        fmt::format("the deadline of {:g} s passed in round {} of {} ({}, seed {}); a longer one is written `stop: {{deadline: ...}}` in "
                    "the experiment",
                    deadline_seconds_, outcome.trace.last_round, experiment.rounds, experiment.protocols.at(outcome.job.protocol).title(),
                    outcome.job.seed.value));
  }

 private:
  const std::atomic<int>* interrupt_;
  Clock::time_point start_;
  Seconds deadline_seconds_;
};

/// A finished job with its reports, waiting for its turn to be handed to the observer.
struct Finished {
  JobOutcome outcome;
  std::vector<double> estimates, states, recorded;
  std::vector<std::uint64_t> hashes, state_hashes;
  std::vector<AgentCounters> counters;
  double began_seconds = 0.0;  ///< of round 0, after the call
  bool ended_early = false;
  std::exception_ptr failure = {};  ///< what the simulation threw; what was known by then is in the outcome

  void keep(const RoundReport& report) {
    estimates.insert(estimates.end(), report.estimates.begin(), report.estimates.end());
    hashes.insert(hashes.end(), report.hashes.begin(), report.hashes.end());
    counters.insert(counters.end(), report.counters.begin(), report.counters.end());
    recorded.insert(recorded.end(), report.recorded.begin(), report.recorded.end());
    states.insert(states.end(), report.states.begin(), report.states.end());
    state_hashes.insert(state_hashes.end(), report.state_hashes.begin(), report.state_hashes.end());
  }

  void replay(const Experiment& experiment, RunObserver& observer) const {
    EventTeller teller(experiment, outcome.job, observer);
    const std::vector<Round>& rounds = outcome.trace.rounds;
    const std::size_t count = std::max<std::size_t>(rounds.size(), 1), n = hashes.size() / count, width = estimates.size() / count,
                      state_width = states.size() / count, recorded_width = recorded.size() / count;
    for (std::size_t i = 0; i < rounds.size(); ++i) {
      RoundReport report{rounds[i], std::span(estimates).subspan(i * width, width), std::span(hashes).subspan(i * n, n),
                         std::span(counters).subspan(i * n, n)};
      report.recorded = std::span(recorded).subspan(i * recorded_width, recorded_width);
      if (state_width > 0) {
        report.states = std::span(states).subspan(i * state_width, state_width);
        report.state_hashes = std::span(state_hashes).subspan(i * n, n);
      }
      teller.report(report);
    }
    if (outcome.end.ending == Ending::nobody_left) teller.rest(outcome.trace.last_round);
  }
};

Ending ending_of(const Experiment& experiment, const Finished& finished, const Watch& watch) {
  if (finished.failure) return Ending::failure;
  if (finished.ended_early) return watch.interrupted() ? Ending::signal : Ending::deadline;
  if (finished.outcome.trace.converged) return Ending::stop_rule;
  return finished.outcome.trace.last_round < experiment.rounds ? Ending::nobody_left : Ending::last_round;
}

/// Hands over what a job came to, then throws what ended it, if something did.
void conclude(const Finished& finished, RunObserver& observer) {
  try {
    observer.run_ends(finished.outcome);
  } catch (const std::exception&) {
    if (!finished.failure) throw;  // else that is why
  }
  if (finished.failure) std::rethrow_exception(finished.failure);
}

/// Runs one job; `each` sees every report on the way. Ends early when `ended()` says so.
template <class Each, class Ended>
Finished run_job(const Experiment& experiment, const Job& job, const Watch& watch, Ended&& ended, Each&& each) {
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
  try {
    simulate(experiment, experiment.protocols.at(job.protocol), job.seed, sink, trace);
  } catch (const std::exception&) {
    if (trace.rounds.empty()) throw;  // it never began
    finished.failure = std::current_exception();
  }
  finished.outcome.seconds = round_zero ? elapsed_since(*round_zero) : 0.0;
  finished.outcome.end = {ending_of(experiment, finished, watch), agents_by_plan(experiment, trace.last_round)};
  return finished;
}

SessionTimes run_one(const Experiment& experiment, const Job& job, const Watch& watch, RunObserver& observer) {
  observer.run_begins(job, layouts_of(experiment, job));
  EventTeller teller(experiment, job, observer);
  const Finished finished = run_job(
      experiment, job, watch, [&] { return watch.ended(); }, [&](const Finished&, const RoundReport& report) { teller.report(report); });
  if (finished.outcome.end.ending == Ending::nobody_left) teller.rest(finished.outcome.trace.last_round);
  conclude(finished, observer);
  if (finished.ended_early) watch.check_deadline(experiment, finished.outcome);
  return {finished.began_seconds, finished.outcome.seconds};
}

/// Jobs on all cores. Workers stay at most `window` jobs ahead of what the observer has taken, so memory stays bounded.
class Workers {
 public:
  Workers(const Experiment& experiment, const std::vector<Job>& jobs, const Watch& watch) {
    for (const Job& job : jobs) {
      tasks_.emplace_back([&experiment, &watch, job](const std::stop_token& stop) {
        return run_job(
            experiment, job, watch, [&] { return stop.stop_requested() || watch.ended(); },
            [](Finished& finished, const RoundReport& report) { finished.keep(report); });
      });
    }
    const std::size_t threads = std::min<std::size_t>(std::max(1u, std::thread::hardware_concurrency()), jobs.size());
    window_ = 2 * threads;
    for (std::size_t i = 0; i < threads; ++i) threads_.emplace_back([this](const std::stop_token& stop) { work(stop); });
  }

  /// The next job in order.
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

SessionTimes run_many(const Experiment& experiment, const std::vector<Job>& jobs, const Watch& watch, RunObserver& observer) {
  SessionTimes times;
  RunLayouts layouts;
  Workers workers(experiment, jobs, watch);
  for (const Job& job : jobs) {
    if (job.number == 0 || job.protocol != jobs[job.number - 1].protocol) layouts = layouts_of(experiment, job);
    const Finished finished = workers.next();
    observer.run_begins(job, layouts);
    finished.replay(experiment, observer);
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

RunLayouts layouts_of(const Experiment& experiment, const ProtocolChoice& choice, const AgentMaker& maker) {
  const auto protocol = maker.make(AgentId{1});
  RunLayouts layouts{protocol->message_layout(), protocol->estimate_layout()};
  layouts.recorded = recorded_part(protocol->recorded_layout(), experiment.recording.state);
  if (maker.physics()) {
    layouts.state = maker.physics()->state_layout();
    layouts.truth = find_protocol(choice.name).truth;
    layouts.agrees_on_states = protocol->control_size() > 0 && layouts.truth == Truth::none;
  }
  return layouts;
}

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
  return jobs.size() == 1 ? run_one(experiment, jobs.front(), watch, observer) : run_many(experiment, jobs, watch, observer);
}

}  // namespace consort
