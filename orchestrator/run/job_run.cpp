#include "orchestrator/run/job_run.hpp"

#include "core/counted.hpp"
#include "core/errors.hpp"
#include "orchestrator/run/spill.hpp"

#include <algorithm>
#include <array>

namespace consort {
namespace {

constexpr double kStartDelay = 0.3;    // s: in real time the first grant reaches everybody before round 0 begins
constexpr double kStallSeconds = 5.0;  // silence after which the agents are asked whom they wait for
// For how long the agents' last words are waited for,
constexpr double kLastWords = 30.0;            // s
constexpr double kLastWordsOfSurvivors = 3.0;  // s; where somebody has not come to the end,
constexpr double kLastWordsOnASignal = 1.0;    // s; and where the user waits

}  // namespace

JobRun::JobRun(const Experiment& experiment, const RunOptions& options, bool until_last_left, const Job& job, std::uint32_t epoch,
               Session& session, RunObserver& observer)
    : experiment_(experiment),
      options_(options),
      until_last_left_(until_last_left),
      job_(job),
      epoch_(epoch),
      session_(session),
      observer_(observer),
      stop_(experiment.rounds, experiment.convergence),
      teller_(experiment, job_, observer),
      granting_(experiment, job.seed, epoch),
      outcome_{job, {}, 0.0} {}

void JobRun::run() {
  try {
    run_rounds();
    finish();
  } catch (const TimeoutError&) {
    salvage(Ending::deadline);
    throw;
  } catch (const std::exception&) {
    salvage(Ending::failure);
    throw;
  }
  complete_trace();
  conclude();
}

void JobRun::run_rounds() {
  trace_ = session_.outline();
  trace_.shelf = spill_in(options_.spill_directory);
  collector_.emplace(experiment_.agents, trace_.dimension, experiment_.rounds, experiment_.report_interval(), trace_.state_dimension,
                     experiment_.presence, trace_.recorded_dimension);
  observer_.run_begins(job_, trace_);
  begin();
  while (!over_) {
    session_.step([this](wire::Telemetry&& telemetry) {
      collect(telemetry);
      hand_on();
    });
    if (session_.interrupted()) {
      end(Ending::signal);
      break;
    }
    notice_losses();
    if (realtime())
      pace();
    else
      grant_more();
    notice_stall();
    tell_remarks();
  }
  const bool reported = ending_ != Ending::signal && ending_ != Ending::out_of_time;
  outcome_.seconds = reported ? std::chrono::duration<double>(last_news_ - started_).count() : elapsed();
}

// In real time round 0 begins in a moment, everywhere at once.
void JobRun::begin() {
  started_ = last_news_ = Clock::now();
  if (!realtime()) return grant_from(0);
  const auto soon = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(kStartDelay));
  started_ = last_news_ = Clock::now() + soon;
  const auto start = (std::chrono::system_clock::now() + soon).time_since_epoch();
  const auto start_ns = static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(start).count());
  pacing_.emplace(experiment_, job_.seed, epoch_, start_ns, options_.last_reports_seconds);
  pace();
}

void JobRun::end(Ending how) {
  if (!over_) ending_ = how;
  over_ = true;
}

// --- rounds go on -----------------------------------------------------------------------------------------------------

// Real time: tells the graphs of the rounds to come, lets happen what is due, and ends the run when its time is up and everybody has
// reported, or has had the time to.
void JobRun::pace() {
  const double now = elapsed();
  if (const auto grant = pacing_->graphs(now)) session_.grant(*grant);
  for (const Fault& fault : pacing_->faults(now)) {
    strike(fault);
    if (fault.kind != Fault::Kind::kill) continue;
    collector_->depart(std::array{fault.agent});
    hand_on();
  }
  for (const Pacing::Call& call : pacing_->calls(now)) {
    if (call.first) {
      forget(call.agent);
      session_.call(call.from);
    } else
      session_.start_for(call.agent, call.from);
  }
  if (pacing_->is_over(now)) end(Ending::out_of_time);
}

// Lockstep: everybody has come as far as round `reached`, and may go on.
void JobRun::grant_from(Round reached) {
  if (const auto news = granting_.release(reached)) session_.grant(*news);
  while (const auto pause = granting_.due(reached)) {
    happen(*pause);
    if (over_ || session_.interrupted()) return;
  }
  session_.grant(granting_.grant(reached, elapsed()));
}

// Everybody has come to the point where the newest grant asked for a report: time for the next one.
void JobRun::grant_more() {
  const Round reached = std::min(session_.processes().least(reached_), granting_.granted());
  if (over_) return;
  if (granting_.is_time(reached)) return grant_from(reached);
  if (const auto news = granting_.release(reached)) session_.grant(*news);
}

// Everybody stands before the round of the pause.
void JobRun::happen(const Granting::Pause& pause) {
  for (const Fault& fault : pause.faults) strike(fault);
  if (!pause.joins) return;
  for (const AgentId agent : pause.back) forget(agent);
  session_.join(pause.round, collecting());
  granting_.state_graphs_again();
  last_news_ = Clock::now();
}

void JobRun::strike(const Fault& fault) {
  if (fault.kind == Fault::Kind::kill)
    session_.kill(fault.agent, collecting());
  else
    session_.stop(fault.agent, time_until_proceed(experiment_, fault));
}

// Who comes back has not come anywhere yet, and not said its last word. What it had told of its links counts; it counts from nothing.
void JobRun::forget(AgentId agent) {
  reached_.erase(agent.value);
  last_words_.erase(agent.value);
  tally_.conclude(agent.value);
}

// --- what is reported -------------------------------------------------------------------------------------------------

void JobRun::collect(const wire::Telemetry& telemetry) {
  if (telemetry.epoch != epoch_) return;
  Round& reached = reached_[telemetry.process];
  reached = std::max(reached, telemetry.round);
  if (telemetry.last) {
    last_words_.insert(telemetry.process);
    reached = kNever;
    trace_.processes.push_back(telemetry.performance);
  }
  tally_.add(telemetry);
  for (const MemberReport& report : telemetry.members) collector_->add(report, telemetry.process == 0);
}

void JobRun::hand_on() {
  collector_->hand_on([&](const RoundReport& report) {
    if (over_) return false;
    add_report(report);
    if (stop_.ends(report.k, [&] { return deviation(trace_, report); })) end(at_the_end());
    last_news_ = Clock::now();
    stall_told_ = false;
    return !over_;
  });
}

void JobRun::add_report(const RoundReport& report) {
  trace_.add(report);
  teller_.report(report);
}

// Agents that died are absent from their last report on, and nobody waits for them.
void JobRun::notice_losses() {
  for (const Session::Loss& loss : session_.take_losses()) {
    collector_->depart(loss.agents);
    given_up_.insert(loss.agents.begin(), loss.agents.end());
    observer_.event(job_, trace_.last_round, "loss", loss.text);
    hand_on();
  }
}

void JobRun::notice_stall() {
  if (stall_told_ || std::chrono::duration<double>(Clock::now() - last_news_).count() < kStallSeconds) return;
  stall_told_ = true;
  session_.grant_again();
  const std::string text = session_.who_waits();
  observer_.event(job_, trace_.last_round, "stall", text);
}

void JobRun::tell_remarks() {
  for (const std::string& text : session_.take_remarks()) observer_.event(job_, trace_.last_round, "remark", text);
}

// --- the end ----------------------------------------------------------------------------------------------------------

// The run has failed, and why it did must reach the user: what else fails now is of no interest. The survivors say their last words.
void JobRun::salvage(Ending how) {
  if (!collector_) return;  // it never began
  if (!over_) outcome_.seconds = std::max(elapsed(), 0.0);
  end(how);
  session_.bear_with_losses();
  for (const auto step : {&JobRun::finish, &JobRun::complete_trace, &JobRun::conclude}) {
    try {
      (this->*step)();
    } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch)
    }
  }
}

// Ends the epoch: the agents report their links and are free for the next job.
void JobRun::finish() {
  if (ending_ != Ending::out_of_time) session_.wake_all();  // else it would be chance whether who is asleep still reports
  session_.finish();
  const auto begin = Clock::now();
  const auto patience = [this] {
    if (session_.interrupted()) return kLastWordsOnASignal;
    return is_complete(ending_) ? kLastWords : kLastWordsOfSurvivors;
  };
  while (!session_.processes().all_among(last_words_) && std::chrono::duration<double>(Clock::now() - begin).count() < patience())
    session_.step(collecting());
  trace_.links = tally_.links();
  trace_.network = tally_.network();
  if (const std::uint64_t left_out = collector_->left_out(); left_out > 0)
    observer_.event(job_, trace_.last_round, "remark", counted(left_out, "report") + " left out, as not fitting the run");
  const auto by_process = [](const Performance& a, const Performance& b) { return a.process < b.process; };
  std::sort(trace_.processes.begin(), trace_.processes.end(), by_process);
  std::uint64_t again = 0;
  for (const Performance& process : trace_.processes) again += process.sent_again_bytes;
  if (experiment_.transport.loss > 0.0)
    observer_.event(job_, trace_.last_round, "transport", counted(again, "byte") + " sent again, as packets had been lost or thrown away");
  tell_remarks();
}

// What the last words have completed counts. Real time: who has not come to the end does not keep the others from being recorded.
void JobRun::complete_trace() {
  if (ending_ == Ending::nobody_left) teller_.rest(trace_.last_round);
  if (is_complete(ending_)) return;
  const auto keep = [this](const RoundReport& report) {
    add_report(report);
    return true;
  };
  collector_->hand_on(keep);
  if (ending_ != Ending::out_of_time) return;
  if (trace_.last_round == experiment_.rounds) {
    ending_ = at_the_end();
    return;
  }
  std::vector<AgentId> missing;
  for (const AgentEnd& agent : agents_by_plan(experiment_, experiment_.rounds))
    if (collector_->reached(agent.agent) < agent.asked) missing.push_back(agent.agent);
  collector_->depart(missing);
  collector_->hand_on(keep);
}

void JobRun::conclude() {
  observer_.refused(session_.refusals());
  trace_.converged = stop_.converged();
  outcome_.end = run_end();
  outcome_.trace = std::move(trace_);
  observer_.run_ends(outcome_);
}

Ending JobRun::at_the_end() const {
  return stop_.converged() ? Ending::stop_rule : until_last_left_ ? Ending::nobody_left : Ending::last_round;
}

RunEnd JobRun::run_end() const {
  RunEnd end{ending_, agents_by_plan(experiment_, ending_ == Ending::out_of_time ? experiment_.rounds : trace_.last_round)};
  for (AgentEnd& agent : end.agents) {
    agent.reached = collector_->reached(agent.agent);
    if (is_complete(ending_)) agent.reached = std::min(agent.reached, trace_.last_round);  // who ran ahead did so for nothing
    agent.slept = collector_->slept(agent.agent);
    if (given_up_.contains(agent.agent)) agent.absence = AgentEnd::Absence::given_up;
  }
  if (trace_.state_dimension > 0) end.plant = collector_->plant_reached();
  return end;
}

}  // namespace consort
