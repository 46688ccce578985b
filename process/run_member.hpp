#pragma once
/// How a process lives in its runs, whatever it does there: work on receive threads under one lock, a main thread that waits for something
/// to do, what it says of itself, commands of the orchestrator, and its disappearance. Agents and plant say what is theirs in it.

#include "idl/wire.hpp"
#include "process/pacer.hpp"
#include "process/patience.hpp"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace consort {

/// How a process comes into its run.
struct Arrival {
  bool launched = false;  ///< by an orchestrator on this host, which waits for it and whose death is noticed by other means than DDS
  double wait = 60.0;     ///< s; who is not launched gives up when it has met nobody by then; 0: never
  std::string sought = "its run";  ///< what it looks for, for a person
  double log_every = 10.0;         ///< s; who is not launched says so often that it has met nobody yet
};

class RunMember {
 public:
  RunMember(const RunMember&) = delete;
  RunMember& operator=(const RunMember&) = delete;
  virtual ~RunMember() = default;
  /// Serves run after run until the orchestrator says shutdown. Throws RunError if the orchestrator disappears or the physics diverges,
  /// ConfigError or RunError if an assignment cannot be carried out (the orchestrator has been told by then). Once.
  void run();
  /// Ends run() from a signal handler's thread. `orphaned`: because the orchestrator is gone.
  void interrupt(bool orphaned);

 protected:
  using Lock = std::unique_lock<std::mutex>;
  static constexpr std::uint32_t kGreeting = 0;  ///< epoch of a greeting; those of runs count from 1

  /// `process`: its name among the processes. `agents`: those it hosts, ascending.
  RunMember(const wire::Participant& participant, Arrival arrival, std::uint32_t process, std::vector<AgentId> agents);

  // --- what agents and plant do each in their way; called under the lock, of a run that has begun unless it says otherwise
  // ----------------

  /// A complete assignment is here: begins the run of epoch_. Main thread.
  virtual void begin_run(Lock& lock) = 0;
  /// Leave to run has come.
  virtual void grant(const Grant& grant) = 0;
  /// The clock says so.
  virtual void beat(std::size_t phase, Round k) = 0;
  /// These agents are gone.
  virtual void depart(std::span<const AgentId> agents) = 0;
  /// These agents take part again from that round on, and want to be met.
  virtual void come_back(std::span<const AgentId> agents, Round round) = 0;
  [[nodiscard]] virtual bool report_due() const = 0;
  /// Its reports, and what goes with them; false: there is nothing to tell.
  virtual bool fill(wire::Telemetry& telemetry) = 0;
  /// What nobody has been told yet, when nobody is left to be told.
  virtual std::vector<MemberReport> held_reports() = 0;
  /// Up to which round it has met whom it has to, as far as it knows, or 0, and then why. Before a run, too.
  [[nodiscard]] virtual Round met_until() const = 0;
  [[nodiscard]] virtual std::string unmet() const = 0;
  /// A greeting can arrive, and may be needed again.
  [[nodiscard]] virtual bool may_greet() const = 0;
  [[nodiscard]] virtual bool greeting_needed() const = 0;
  virtual void greet() = 0;
  /// Says in which round it is, and what it waits for.
  virtual void describe(wire::Presence& presence) const = 0;
  /// Lockstep: asks those it hears for what it lacks; false if it lacks nothing that could come.
  virtual bool ask() = 0;
  /// Counts what comes that it can use, and the rounds: while this stands still, so does everything.
  [[nodiscard]] virtual std::uint64_t heard() const = 0;
  /// Counts what came once more after it had been asked for.
  [[nodiscard]] virtual std::uint64_t came_twice() const = 0;
  /// What else the main thread has to do; false: and then it has left the run.
  [[nodiscard]] virtual bool more_to_do() const { return false; }
  virtual bool do_more(Lock&) { return true; }
  [[nodiscard]] virtual wire::ReaderEvents reader_events() const = 0;
  [[nodiscard]] virtual std::uint64_t sent_again_bytes() const = 0;
  [[nodiscard]] virtual std::uint64_t missed_inputs() const = 0;

  // --- what they have in common
  // -----------------------------------------------------------------------------------------------------------

  /// Runs under the lock, until run() has ended; a failure is kept for the main thread.
  template <class Work>
  void guarded(Work&& work) {
    const Lock lock(mutex_);
    if (ended_) return;  // what it would use is being taken down
    try {
      work();
    } catch (...) {  // must not cross DDS's C code: the main thread rethrows it
      if (!failure_) failure_ = std::current_exception();
      wake_.notify_one();
    }
  }

  /// Of a run that is over or has begun.
  [[nodiscard]] bool outdated(std::uint32_t epoch) const { return epoch < newest_epoch_ || epoch == epoch_; }
  /// A part of an assignment that is not outdated has come: with the last one, a run can begin.
  template <class Part>
  void add_part(std::map<std::uint32_t, Part>& parts, Part&& part) {
    if (part.epoch > newest_epoch_) parts.clear();
    newest_epoch_ = part.epoch;
    const std::uint32_t count = part.parts;
    parts[part.part] = std::forward<Part>(part);
    assigned_ = parts.size() == count;
    if (assigned_) wake_.notify_one();
  }
  /// Is this of the run that goes on here?
  [[nodiscard]] bool current(std::uint32_t epoch) const { return epoch == epoch_ && !finish_; }
  /// Somebody new has been found: greet everybody, and again soon.
  void greet_anew();
  /// Has asked for something on a receive thread; the rounds go on, if it was waiting for that.
  void has_asked() { patience_.asks(now()); }
  void has_gone_on() {
    if (patience_.asked() > 0) patience_.goes_on(now());
  }
  /// Everybody who is there has come as far as this, as the newest grant says; or the run is over.
  [[nodiscard]] bool everybody_reached(Round k) const { return finish_ || reached_ >= k; }
  /// Unless it goes already.
  void start_clock(const Grant& grant, Seconds dt, Round first, Round last, std::vector<Seconds> phases);
  void send_reports(Lock& lock, bool last);
  /// The last report of the run, once.
  void send_last_report(Lock& lock);
  /// For Presence.
  [[nodiscard]] std::optional<double> liveliness_lease() const {
    return arrival_.launched ? std::nullopt : std::optional(wire::kSignOfLifeLease);
  }

  std::mutex mutex_;  // guards everything below, and what the derived class says it guards
  std::condition_variable wake_;
  const std::uint32_t process_;
  const std::vector<AgentId> agents_;
  std::optional<std::uint32_t> epoch_;       // of the run being served; none before the first
  std::optional<wire::Command> lost_early_;  // `departed`, of a run that has not begun here
  std::optional<Grant> granted_early_;       // of such a run
  std::optional<Delivery> delivery_;         // of the run, in real time
  Round reached_ = 0;                        // of the newest grant
  Round ready_until_ = 0;                    // what the newest `ready` of this epoch said; 0: none yet
  wire::Participant participant_;
  wire::Writer<wire::Telemetry> telemetry_;

 private:
  void on_grant(Grant&& grant);
  void on_command(const wire::Command& command);
  void on_orchestrator(std::size_t writers);
  [[nodiscard]] bool join_run(Lock& lock);
  [[noreturn]] void lose_orchestrator() const;
  [[nodiscard]] std::string objection_to_orchestrators() const;
  void serve(Lock& lock);
  [[nodiscard]] bool has_work() const;
  void wait_for_work(Lock& lock);
  void ask_if_stuck();
  [[nodiscard]] static Patience::Duration now() { return std::chrono::steady_clock::now().time_since_epoch(); }
  void start_run(Lock& lock);
  void say(Lock& lock, wire::State state, const std::string& note = {});
  [[nodiscard]] Performance performance() const;

  const Arrival arrival_;
  std::string host_;
  std::exception_ptr failure_;
  std::uint32_t newest_epoch_ = 0;
  bool assigned_ = false;  // a complete assignment waits
  bool greeted_ = false;   // everybody found so far has been greeted
  std::chrono::milliseconds greet_again_;
  Patience::Duration greeted_at_{};
  Patience patience_;
  std::uint64_t seen_heard_ = 0, seen_twice_ = 0;
  bool finish_ = false, finished_ = false, status_asked_ = false, shutdown_ = false, interrupted_ = false, orphaned_ = false,
       orchestrator_lost_ = false, ended_ = false, welcomed_ = false;
  std::size_t orchestrator_writers_ = 0;
  std::string refusal_;  // the run's reason not to want this process

  wire::Writer<wire::Presence> presence_;
  std::optional<wire::Reader<Grant>> grants_;  // while run() goes on, as they call the derived class
  std::optional<wire::Reader<wire::Command>> commands_;
  wire::ReaderEvents events_before_;  // before the clock started: nothing was due then
  std::optional<Pacer> pacer_;        // never destroyed under the lock: it calls back
};

}  // namespace consort
