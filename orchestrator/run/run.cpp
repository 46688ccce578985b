#include "orchestrator/run/run.hpp"

#include "core/counted.hpp"
#include "core/errors.hpp"
#include "idl/trust.hpp"
#include "idl/wire.hpp"
#include "orchestrator/run/collector.hpp"
#include "orchestrator/run/event_teller.hpp"
#include "orchestrator/run/launch.hpp"
#include "orchestrator/run/link_tally.hpp"
#include "orchestrator/run/placement.hpp"
#include "orchestrator/run/session.hpp"
#include "rounds/last_round.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <set>

namespace consort {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

constexpr double kFirstGrantRounds = 64;  // before the speed is known
constexpr double kGrantSeconds = 0.25;    // half a grant window, in wall-clock time: the report period, and how far a stop rule overshoots
// Real time:
constexpr double kStartDelay = 0.3;   // s: the first grant reaches everybody before round 0 begins
constexpr double kToldAhead = 2.0;    // s: how far ahead the graphs are told
constexpr double kJoinLead = 1.0;     // s: a process is started so long before its first round,
constexpr double kAfterDeath = 0.05;  // s: but after the end of the one before it
constexpr std::size_t kMostGraphs = 4096;
constexpr double kStallSeconds = 5.0;  // silence after which the agents are asked whom they wait for
// For how long the agents' last words are waited for,
constexpr double kLastWords = 30.0;            // s
constexpr double kLastWordsOfSurvivors = 3.0;  // s; where somebody has not come to the end,
constexpr double kLastWordsOnASignal = 1.0;    // s; and where the user waits

Round round_up(double rounds, Round multiple) {
  const auto wanted = static_cast<Round>(std::clamp(rounds, 1.0, static_cast<double>(wire::kLargestHalfWindow)));
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
  /// `until_last_left`: the experiment is cut where nobody is left.
  JobRun(const Experiment& experiment, const RunOptions& options, bool until_last_left, const Job& job, std::uint32_t epoch,
         Session& session, RunObserver& observer)
      : experiment_(experiment),
        last_reports_seconds_(options.last_reports_seconds),
        until_last_left_(until_last_left),
        job_(job),
        epoch_(epoch),
        session_(session),
        observer_(observer),
        schedule_(experiment.schedule(job.seed)),
        interval_(experiment.report_interval()),
        stop_(experiment.rounds, experiment.convergence),
        teller_(experiment, job_, observer),
        outcome_{job, {}, 0.0} {}

  /// Throws what ended the run, after handing the observer what was known by then.
  void run() {
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
  [[nodiscard]] double seconds() const { return outcome_.seconds; }

 private:
  void run_rounds() {
    const RunLayouts layouts = session_.layouts();
    trace_ = layouts.empty_trace(experiment_.agents);
    collector_.emplace(experiment_.agents, trace_.dimension, experiment_.rounds, interval_, trace_.state_dimension, experiment_.presence,
                       trace_.recorded_dimension);
    observer_.run_begins(job_, layouts);
    started_ = Clock::now();
    last_news_ = started_;
    if (realtime())
      set_clock();
    else
      grant_from(0);
    while (!over_) {
      session_.step([this](wire::Telemetry&& telemetry) { take(telemetry); });
      if (session_.interrupted()) {
        end(Ending::signal);
        break;
      }
      notice_losses();
      if (realtime())
        keep_pace();
      else
        go_on();
      notice_stall();
      tell_remarks();
    }
    const bool reported = ending_ != Ending::signal && ending_ != Ending::out_of_time;
    outcome_.seconds = reported ? std::chrono::duration<double>(last_news_ - started_).count() : seconds_since(started_);
  }

  void end(Ending how) {
    if (!over_) ending_ = how;
    over_ = true;
  }

  /// The run has failed, and why it did must reach the user: what else fails now is of no interest. The survivors say their last words.
  void salvage(Ending how) {
    if (!collector_) return;  // it never began
    if (!over_) outcome_.seconds = std::max(seconds_since(started_), 0.0);
    end(how);
    session_.bear_with_losses();
    for (const auto step : {&JobRun::finish, &JobRun::complete_trace, &JobRun::conclude}) {
      try {
        (this->*step)();
      } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch)
      }
    }
  }

  void conclude() {
    observer_.refused(session_.refusals());
    trace_.converged = stop_.converged();
    outcome_.end = run_end();
    outcome_.trace = std::move(trace_);
    observer_.run_ends(outcome_);
  }

  /// What the last words have completed counts. Real time: who has not come to the end does not keep the others from being recorded.
  void complete_trace() {
    if (ending_ == Ending::nobody_left) teller_.rest(trace_.last_round);
    if (is_complete(ending_)) return;
    const auto keep = [this](const RoundReport& report) {
      keep_report(report);
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

  [[nodiscard]] Ending at_the_end() const {
    return stop_.converged() ? Ending::stop_rule : until_last_left_ ? Ending::nobody_left : Ending::last_round;
  }

  [[nodiscard]] RunEnd run_end() const {
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

  [[nodiscard]] bool realtime() const { return experiment_.mode == Mode::realtime; }

  /// Real time: round 0 begins in a moment, everywhere at once.
  void set_clock() {
    const auto soon = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(kStartDelay));
    started_ = last_news_ = Clock::now() + soon;
    start_ns_ = static_cast<std::uint64_t>(
        std::chrono::duration_cast<std::chrono::nanoseconds>((std::chrono::system_clock::now() + soon).time_since_epoch()).count());
    keep_pace();
  }

  /// Real time: tells the graphs of the rounds to come, lets happen what is due, and ends the run when its time is up and everybody has
  /// reported, or has had the time to.
  void keep_pace() {
    const double elapsed = seconds_since(started_), rounds = elapsed / experiment_.dt;
    const Round now = rounds <= 0.0 ? 0 : static_cast<Round>(std::min(rounds, static_cast<double>(experiment_.rounds)));
    const auto ahead = [&](double seconds) {
      return static_cast<Round>(std::min(now + std::ceil(seconds / experiment_.dt) + 1.0, static_cast<double>(experiment_.rounds)));
    };
    if (granted_ < ahead(kToldAhead / 2.0)) tell_graphs(now, ahead(kToldAhead));
    meet_faults(elapsed);
    if (elapsed > experiment_.rounds * experiment_.dt + last_reports_seconds_) end(Ending::out_of_time);
  }

  void tell_graphs(Round first, Round until) {
    graphs_ = {};  // who comes later has heard of no graph yet
    wire::Grant grant{epoch_, until, 0, {}, start_ns_};
    for (Round k = first; k < until;) {
      const Schedule::Segment segment = schedule_.segment(k);
      grant.segments.push_back({k, static_cast<std::uint32_t>(grant.segments.size() % kMostGraphs), segment.graph->edges()});
      if (segment.last >= until) break;
      k = segment.last + 1;
    }
    granted_ = until;
    session_.broadcast(grant);
  }

  /// Real time: what is due happens when it is, whatever round the agents are in. Whoever joins is started a little before.
  void meet_faults(double elapsed) {
    const auto keep = [this](wire::Telemetry&& telemetry) { collect(telemetry); };
    for (; next_fault_ < experiment_.faults.size(); ++next_fault_) {
      const Fault& fault = experiment_.faults[next_fault_];
      if (elapsed < fault.round * experiment_.dt) break;
      if (fault.kind == Fault::Kind::stop) session_.stop(fault.agent, time_until_proceed(fault));
      if (fault.kind != Fault::Kind::kill) continue;
      session_.kill(fault.agent, keep);
      collector_->depart(std::array{fault.agent});
      hand_on();
    }
    for (const auto& [agent, presence] : experiment_.presence)
      for (const Attendance& stay : presence.stays()) {
        const Round before = stay_before(presence, stay);
        const double start = std::max(stay.from * experiment_.dt - kJoinLead, before * experiment_.dt + kAfterDeath);
        if (stay.from == 0 || elapsed < start || elapsed >= stay.until * experiment_.dt) continue;
        if (called_.insert({stay.from, agent}).second) {
          forget(agent);
          session_.call(stay.from);
        } else
          session_.start_for(agent, stay.from);
      }
  }

  static Round stay_before(const Attendance& presence, const Attendance& stay) {
    Round end = 0;
    for (const Attendance& other : presence.stays())
      if (other.until <= stay.from) end = other.until;
    return end;
  }

  /// Everybody has come as far as round `reached`: lets them go on, sized by the speed seen so far.
  void grant_from(Round reached) {
    Round pause = next_pause();
    for (; reached >= pause && pause < experiment_.rounds; pause = next_pause()) {
      happen(pause);
      if (over_ || session_.interrupted()) return;
    }
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
    grant.whole = grant.report_at == pause &&
                  std::any_of(experiment_.faults.begin(), experiment_.faults.end(),
                              [pause](const Fault& fault) { return fault.kind == Fault::Kind::kill && fault.round == pause; });
    granted_ = grant.until;
    report_at_ = grant.report_at;
    session_.broadcast(grant);
  }

  /// The next round before which somebody's process comes, or something happens to one: nobody is granted more until it has happened.
  Round next_pause() const {
    Round next = experiment_.rounds;
    const auto consider = [&](Round round) {
      if (round > paused_ && round < next) next = round;
    };
    for (const auto& [agent, presence] : experiment_.presence)
      for (const Attendance& stay : presence.stays()) consider(stay.from);
    for (const Fault& fault : experiment_.faults)
      if (fault.kind != Fault::Kind::proceed) consider(fault.round);
    return next;
  }

  /// Everybody stands before round `round`.
  void happen(Round round) {
    paused_ = round;
    const auto keep = [this](wire::Telemetry&& telemetry) { collect(telemetry); };
    for (const Fault& fault : experiment_.faults) {
      if (fault.round != round) continue;
      if (fault.kind == Fault::Kind::kill) {
        session_.kill(fault.agent, keep);
      } else if (fault.kind == Fault::Kind::stop) {
        session_.stop(fault.agent, time_until_proceed(fault));
      }
    }
    const auto joins = [round](const auto& item) {
      const std::vector<Attendance> stays = item.second.stays();
      return std::any_of(stays.begin(), stays.end(), [round](const Attendance& stay) { return stay.from == round; });
    };
    if (std::none_of(experiment_.presence.begin(), experiment_.presence.end(), joins)) return;
    for (const auto& [agent, presence] : experiment_.presence)
      if (std::any_of(presence.again.begin(), presence.again.end(), [round](const Attendance& stay) { return stay.from == round; }))
        forget(agent);
    session_.join(round, keep);
    graphs_ = {};  // who joins has heard of no graph yet
    last_news_ = Clock::now();
  }

  /// In lockstep nobody can reach the round of a `continue` before it: the process sleeps for as long as the rounds in between stand for.
  Seconds time_until_proceed(const Fault& stop) const {
    const auto proceed = std::find_if(experiment_.faults.begin(), experiment_.faults.end(), [&](const Fault& fault) {
      return fault.kind == Fault::Kind::proceed && fault.agent == stop.agent && fault.round > stop.round;
    });
    check(proceed != experiment_.faults.end(), "every stop has its continue");
    return (proceed->round - stop.round) * experiment_.dt;
  }

  /// Who comes back has not come anywhere yet, and not said its last word. What it had told of its links counts; it counts from nothing.
  void forget(AgentId agent) {
    reached_.erase(agent.value);
    last_words_.erase(agent.value);
    tally_.conclude(agent.value);
  }

  void collect(const wire::Telemetry& telemetry) {
    if (telemetry.epoch != epoch_) return;
    Round& reached = reached_[telemetry.process];
    reached = std::max(reached, telemetry.round);
    if (telemetry.last) {
      last_words_.insert(telemetry.process);
      reached = Attendance{}.until;
      trace_.processes.push_back(telemetry.performance);
    }
    tally_.take(telemetry);
    for (const wire::MemberReport& report : telemetry.members) collector_->add(report, telemetry.process == 0);
  }

  void take(const wire::Telemetry& telemetry) {
    collect(telemetry);
    hand_on();
  }

  void hand_on() {
    collector_->hand_on([&](const RoundReport& report) {
      if (over_) return false;
      keep_report(report);
      if (stop_.ends(report.k, [&] { return deviation(trace_, report); })) end(at_the_end());
      last_news_ = Clock::now();
      stall_told_ = false;
      return !over_;
    });
  }

  void keep_report(const RoundReport& report) {
    trace_.add(report);
    teller_.report(report);
  }

  /// Everybody has come to the point where the newest grant asked for a report: time for the next one.
  void go_on() {
    if (over_ || report_at_ >= experiment_.rounds) return;
    const Round reached = std::min(session_.least(reached_), granted_);
    if (reached >= report_at_) grant_from(reached);
  }

  /// Agents that died are absent from their last report on, and nobody waits for them.
  void notice_losses() {
    for (const Session::Loss& loss : session_.take_losses()) {
      collector_->depart(loss.agents);
      given_up_.insert(loss.agents.begin(), loss.agents.end());
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
    if (ending_ != Ending::out_of_time) session_.wake_all();  // else it would be chance whether who is asleep still reports
    session_.broadcast(wire::Command{epoch_, wire::Order::finish});
    const auto begin = Clock::now();
    const auto patience = [this] {
      if (session_.interrupted()) return kLastWordsOnASignal;
      return is_complete(ending_) ? kLastWords : kLastWordsOfSurvivors;
    };
    while (!session_.all_among(last_words_) && seconds_since(begin) < patience())
      session_.step([this](wire::Telemetry&& telemetry) { collect(telemetry); });
    trace_.links = tally_.links();
    trace_.network = tally_.network();
    if (const std::uint64_t left_out = collector_->left_out(); left_out > 0)
      observer_.event(job_, trace_.last_round, "remark", counted(left_out, "report") + " left out, as not fitting the run");
    const auto by_process = [](const Performance& a, const Performance& b) { return a.process < b.process; };
    std::sort(trace_.processes.begin(), trace_.processes.end(), by_process);
    std::uint64_t again = 0;
    for (const Performance& process : trace_.processes) again += process.sent_again_bytes;
    if (experiment_.transport.loss > 0.0)
      observer_.event(job_, trace_.last_round, "transport",
                      counted(again, "byte") + " sent again, as packets had been lost or thrown away");
    tell_remarks();
  }

  const Experiment& experiment_;
  double last_reports_seconds_;
  bool until_last_left_;
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
  Round granted_ = 0, stated_until_ = 0, report_at_ = 0, half_ = 0, paused_ = 0;
  std::map<std::uint32_t, Round> reached_;  // by process
  LinkTally tally_;
  std::set<std::uint32_t> last_words_;  // processes that have reported their links: the job is over for them
  Clock::time_point started_, last_news_;
  std::uint64_t start_ns_ = 0;  // real time: wall clock of round 0
  std::size_t next_fault_ = 0;
  std::set<std::pair<Round, AgentId>> called_;  // who has been started for a later stay
  std::set<AgentId> given_up_;
  bool over_ = false, stall_told_ = false;
  Ending ending_ = Ending::last_round;  // once it is over
  JobOutcome outcome_;
};

}  // namespace

bool RunOptions::by_hand(std::span<const AgentId> hosted) const {
  return std::any_of(hosted.begin(), hosted.end(),
                     [&](AgentId agent) { return std::find(external.begin(), external.end(), agent) != external.end(); });
}

std::string run_key() {
  static_assert(std::string_view(kRunKeyVariable) == wire::RunKey::kVariable);
  const auto given = wire::RunKey::secret_of_environment();
  return given ? *given : wire::RunKey::random_secret();
}

SessionTimes run_processes(const Experiment& asked, const RunOptions& options, RunObserver& observer) {
  const auto begin = Clock::now();
  Experiment experiment = asked;
  experiment.rounds = last_round(asked);
  experiment.report_every = asked.report_interval();
  const bool until_last_left = experiment.rounds < asked.rounds;
  SessionTimes times;
  Session session(experiment, options);
  try {
    session.launch(observer);
    for (const Job& job : jobs_of(experiment)) {
      const std::uint32_t epoch = static_cast<std::uint32_t>(job.number) + 1;
      session.assign(job, epoch, observer);
      if (session.interrupted()) break;
      if (job.number == 0) times.startup_seconds = seconds_since(begin);
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
