#pragma once
/// One job of a session: from the ready agents to its last round, and what it leaves behind.

#include "core/stop.hpp"
#include "orchestrator/run/collector.hpp"
#include "orchestrator/run/event_teller.hpp"
#include "orchestrator/run/granting.hpp"
#include "orchestrator/run/link_tally.hpp"
#include "orchestrator/run/pacing.hpp"
#include "orchestrator/run/session.hpp"

#include <chrono>
#include <map>
#include <optional>
#include <set>

namespace consort {

class JobRun {
 public:
  /// `until_last_left`: the experiment is cut where nobody is left. All but `job` must outlive this.
  JobRun(const Experiment& experiment, const RunOptions& options, bool until_last_left, const Job& job, std::uint32_t epoch,
         Session& session, RunObserver& observer);

  /// Throws what ended the run, after handing the observer what was known by then.
  void run();
  [[nodiscard]] double seconds() const { return outcome_.seconds; }

 private:
  using Clock = std::chrono::steady_clock;

  void run_rounds();
  void begin();
  void end(Ending how);
  void salvage(Ending how);
  void finish();
  void complete_trace();
  void conclude();
  [[nodiscard]] Ending at_the_end() const;
  [[nodiscard]] RunEnd run_end() const;

  [[nodiscard]] bool realtime() const { return experiment_.mode == Mode::realtime; }
  [[nodiscard]] double elapsed() const { return std::chrono::duration<double>(Clock::now() - started_).count(); }
  void pace();
  void grant_from(Round reached);
  void grant_more();
  void happen(const Granting::Pause& pause);
  void strike(const Fault& fault);
  void forget(AgentId agent);

  void collect(const wire::Telemetry& telemetry);
  [[nodiscard]] Session::OnTelemetry collecting() {
    return [this](wire::Telemetry&& telemetry) { collect(telemetry); };
  }
  void hand_on();
  void add_report(const RoundReport& report);
  void notice_losses();
  void notice_stall();
  void tell_remarks();

  const Experiment& experiment_;
  const RunOptions& options_;
  bool until_last_left_;
  Job job_;
  std::uint32_t epoch_;
  Session& session_;
  RunObserver& observer_;
  StopRule stop_;
  EventTeller teller_;
  Granting granting_;
  std::optional<Pacing> pacing_;  // real time
  Trace trace_;
  std::optional<Collector> collector_;
  std::map<std::uint32_t, Round> reached_;  // by process
  LinkTally tally_;
  std::set<std::uint32_t> last_words_;  // processes that have reported their links: the job is over for them
  Clock::time_point started_, last_news_;
  std::set<AgentId> given_up_;
  bool over_ = false, stall_told_ = false;
  Ending ending_ = Ending::last_round;  // once it is over
  JobOutcome outcome_;
};

}  // namespace consort
