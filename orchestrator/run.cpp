#include "orchestrator/run.hpp"

#include "core/errors.hpp"
#include "idl/wire.hpp"
#include "orchestrator/collector.hpp"
#include "orchestrator/event_teller.hpp"
#include "orchestrator/launch.hpp"
#include "orchestrator/placement.hpp"
#include "orchestrator/session.hpp"

#include <algorithm>
#include <chrono>
#include <set>

namespace consort {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

constexpr double kFirstGrantRounds = 64;  // before the speed is known
constexpr double kGrantSeconds = 0.25;    // half a grant window, in wall-clock time: the report period, and how far a stop rule overshoots
constexpr double kStallSeconds = 5.0;     // silence after which the agents are asked whom they wait for

Round round_up(double rounds, Round multiple) {
  const auto wanted = static_cast<Round>(std::clamp(rounds, 1.0, static_cast<double>(kLargestHalfWindow)));
  return (wanted + multiple - 1) / multiple * multiple;
}

/// States each graph once, then refers to it by number; numbers are reused in turn, so a schedule without end does not pile up.
class GraphNumbers {
 public:
  wire::Segment segment(Round first, const std::shared_ptr<const Graph>& graph) {
    const auto known = std::find(graphs_.begin(), graphs_.end(), graph);
    if (known != graphs_.end()) return {first, static_cast<std::uint32_t>(known - graphs_.begin()), {}};
    const std::uint32_t number = next_++ % kNumbers;
    if (number >= graphs_.size()) graphs_.resize(number + 1);
    graphs_[number] = graph;
    return {first, number, graph->edges()};
  }

 private:
  static constexpr std::uint32_t kNumbers = 64;
  std::vector<std::shared_ptr<const Graph>> graphs_;
  std::uint32_t next_ = 0;
};

/// One job: from the ready agents to its last round.
class JobRun {
 public:
  JobRun(const Experiment& experiment, const Job& job, std::uint32_t epoch, Session& session, RunObserver& observer)
      : experiment_(experiment),
        job_(job),
        epoch_(epoch),
        session_(session),
        observer_(observer),
        schedule_(experiment.schedule(job.seed)),
        interval_(experiment.report_interval()),
        stop_(experiment.rounds, experiment.convergence),
        teller_(experiment, job_, observer) {}

  JobOutcome run() {
    const RunLayouts layouts = session_.layouts();
    trace_ = layouts.empty_trace(experiment_.agents);
    collector_.emplace(experiment_.agents, trace_.dimension, experiment_.rounds, interval_, trace_.state_dimension, experiment_.presence);
    observer_.run_begins(job_, layouts);
    started_ = Clock::now();
    last_news_ = started_;
    grant_from(0);
    while (!over_) {
      session_.step([this](wire::Telemetry&& telemetry) { take(telemetry); });
      if (session_.interrupted()) break;
      notice_losses();
      notice_stall();
      tell_remarks();
    }
    JobOutcome outcome{job_, {}, over_ ? std::chrono::duration<double>(last_news_ - started_).count() : seconds_since(started_)};
    finish();
    tell_remarks();
    trace_.converged = stop_.converged();
    outcome.trace = std::move(trace_);
    return outcome;
  }

 private:
  /// Everybody has reported round `reached`: lets the agents go on, sized by the speed seen so far.
  void grant_from(Round reached) {
    const Round pause = welcome(reached);
    const double speed = reached / std::max(seconds_since(started_), 1e-6);
    const Round half = round_up(reached == 0 ? kFirstGrantRounds : std::min(speed * kGrantSeconds, 4.0 * half_), interval_);
    half_ = half;
    const auto bounded = [&](std::uint64_t k) { return static_cast<Round>(std::min<std::uint64_t>(k, pause)); };
    wire::Grant grant{
        epoch_, std::max(granted_, bounded(std::uint64_t{reached} + 2 * std::uint64_t{half})), bounded(std::uint64_t{reached} + half), {}};
    while (stated_until_ < grant.until) {
      const Schedule::Segment segment = schedule_.segment(stated_until_);
      grant.segments.push_back(graphs_.segment(stated_until_, segment.graph));
      if (segment.last >= experiment_.rounds)
        stated_until_ = experiment_.rounds;
      else
        stated_until_ = segment.last + 1;
    }
    granted_ = grant.until;
    report_at_ = grant.report_at;
    session_.broadcast(grant);
  }

  /// Lets in whoever joins before the next reported round. Returns the round up to which may be granted without anybody else joining: a
  /// reported one, so that everybody's arrival there is heard of, and one before the join, since the report of that needs who joins.
  Round welcome(Round reached) {
    Round next = experiment_.rounds;
    for (const auto& [agent, presence] : experiment_.presence) {
      if (presence.from == 0 || presence.from > experiment_.rounds || presence.from <= joined_) continue;
      next = std::min(next, presence.from);
    }
    if (next == experiment_.rounds) return next;
    const Round pause = (next - 1) - (next - 1) % interval_;
    if (reached < pause) return pause;
    session_.join(next, [this](wire::Telemetry&& telemetry) { collect(telemetry); });
    joined_ = next;
    graphs_ = {};  // who joins has heard of no graph yet
    return welcome(reached);
  }

  void collect(const wire::Telemetry& telemetry) {
    if (telemetry.epoch != epoch_) return;
    if (telemetry.last) {
      last_words_.insert(telemetry.process);
      for (const wire::LinkReport& link : telemetry.links)
        trace_.links.push_back({link.edge, link.delivered, link.lost, link.duplicated, link.reordered, link.superseded});
    }
    for (const wire::MemberReport& report : telemetry.members) collector_->add(report, telemetry.process == 0);
  }

  void take(const wire::Telemetry& telemetry) {
    collect(telemetry);
    hand_on();
  }

  void hand_on() {
    std::optional<Round> reached;
    collector_->hand_on([&](const RoundReport& report) {
      if (over_) return false;
      trace_.add(report);
      teller_.report(report);
      over_ = stop_.ends(report.k, [&] { return deviation(trace_, report); });
      reached = report.k;
      last_news_ = Clock::now();
      stall_told_ = false;
      return !over_;
    });
    if (!over_ && reached && *reached >= report_at_) grant_from(*reached);
  }

  /// Agents that died are absent from their last report on, and nobody waits for them.
  void notice_losses() {
    for (const Session::Loss& loss : session_.take_losses()) {
      collector_->depart(loss.agents);
      observer_.event(job_, trace_.last_round, "loss", loss.text);
      hand_on();
    }
  }

  void notice_stall() {
    if (stall_told_ || seconds_since(last_news_) < kStallSeconds) return;
    stall_told_ = true;
    const std::string text = session_.who_waits();
    observer_.event(job_, trace_.last_round, "stall", text);
  }

  void tell_remarks() {
    for (const std::string& text : session_.take_remarks()) observer_.event(job_, trace_.last_round, "remark", text);
  }

  /// Ends the epoch: the agents report their links and are free for the next job.
  void finish() {
    session_.broadcast(wire::Command{epoch_, wire::Order::finish});
    const auto begin = Clock::now();
    while (!session_.all_among(last_words_) && seconds_since(begin) < (session_.interrupted() ? 1.0 : 30.0))
      session_.step([this](wire::Telemetry&& telemetry) { collect(telemetry); });
    std::sort(trace_.links.begin(), trace_.links.end());
  }

  const Experiment& experiment_;
  Job job_;
  std::uint32_t epoch_;
  Session& session_;
  RunObserver& observer_;
  Schedule schedule_;
  Round interval_;
  StopRule stop_;
  EventTeller teller_;
  Trace trace_;
  std::optional<Collector> collector_;
  GraphNumbers graphs_;
  Round granted_ = 0, stated_until_ = 0, report_at_ = 0, half_ = 0, joined_ = 0;
  std::set<std::uint32_t> last_words_;  // processes that have reported their links: the job is over for them
  Clock::time_point started_, last_news_;
  bool over_ = false, stall_told_ = false;
};

}  // namespace

SessionTimes run_processes(const Experiment& experiment, const RunOptions& options, RunObserver& observer) {
  const auto begin = Clock::now();
  SessionTimes times;
  Session session(experiment, options);
  session.launch(observer);
  for (const Job& job : jobs_of(experiment)) {
    const std::uint32_t epoch = static_cast<std::uint32_t>(job.number) + 1;
    session.assign(job, epoch, observer);
    if (session.interrupted()) break;
    if (job.number == 0) times.startup_seconds = seconds_since(begin);
    const JobOutcome outcome = JobRun(experiment, job, epoch, session, observer).run();
    times.running_seconds += outcome.seconds;
    observer.run_ends(outcome);
    if (session.interrupted()) break;
  }
  session.shut_down();
  return times;
}

}  // namespace consort
