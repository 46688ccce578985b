#pragma once
/// The processes of one `consort run` and the orchestrator's end of the wire: launched once, given one run after the other, ended together.

#include "orchestrator/run/assignments.hpp"
#include "orchestrator/run/fleet.hpp"
#include "orchestrator/run/hubs.hpp"
#include "orchestrator/run/news.hpp"
#include "orchestrator/run/processes.hpp"
#include "orchestrator/run/remarks.hpp"
#include "orchestrator/run/roster.hpp"
#include "orchestrator/run/run.hpp"

#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <variant>

namespace consort {

class Session {
 public:
  using OnTelemetry = std::function<void(wire::Telemetry&&)>;

  /// `experiment` must outlive this.
  Session(const Experiment& experiment, const RunOptions& options);
  ~Session();

  /// Starts the processes that are there from the first round on, the plant among them, and waits until each has said hello.
  void launch(RunObserver& observer);
  /// Starts the processes that begin to take part in round `first` or before, also those that come back, and waits until everybody is
  /// ready for that round.
  void join(Round first, const OnTelemetry& on_telemetry);
  /// The same without waiting for anybody.
  void call(Round first);
  /// Starts the agent's process for its stay in round k, if it does not run, for example since the one before was still ending. Who died
  /// unplanned stays dead.
  void start_for(AgentId agent, Round k);
  /// Kills an agent's process and waits until it has ended.
  void kill(AgentId agent, const OnTelemetry& on_telemetry);
  /// Stops an agent's process for so long.
  void stop(AgentId agent, Seconds duration);
  /// The run has failed: from now on no death, and no deadline, is another failure.
  void bear_with_losses() { failed_ = true; }
  /// Lets every stopped process go on at once.
  void wake_all() { wake_stopped(true); }
  /// Hands out the assignments of one job and waits until every process has met its neighbours.
  void assign(const Job& job, std::uint32_t epoch, RunObserver& observer);
  /// Waits a moment for news and handles it. Throws RunError when a process died or failed, TimeoutError when the deadline has passed.
  void step(const OnTelemetry& on_telemetry);
  /// Asks every process whom it waits for; a text for a person.
  std::string who_waits();
  /// Agents that have died since the last call, in a run that goes on without them (`on_agent_loss: continue`), with a text for a person.
  struct Loss {
    std::vector<AgentId> agents;
    std::string text;
  };
  std::vector<Loss> take_losses() { return std::exchange(losses_, {}); }
  /// What is worth keeping but ends no run. Each is told once.
  std::vector<std::string> take_remarks();
  /// All samples refused so far, by whoever takes part, as far as has been reported; by writer, topic and reason.
  [[nodiscard]] const std::vector<Refusal>& refusals() const { return remarks_.refusals(); }
  /// Ends the processes politely.
  void shut_down();

  [[nodiscard]] bool interrupted() const { return options_.interrupt && options_.interrupt->load() != 0; }
  [[nodiscard]] const Processes& processes() const { return processes_; }
  /// Throws RunError if an agent has others than the rest.
  [[nodiscard]] const Trace& outline() const;
  void grant(const Grant& grant);
  /// Says the newest grant once more: whoever has it is not disturbed.
  void grant_again();
  /// Ends the job: the agents report their links and are free for the next one.
  void finish() { hubs_.broadcast(wire::Command{epoch_, wire::Order::finish}); }

 private:
  struct Liveliness {
    std::string sender;
    bool alive;
  };
  using Word = std::variant<wire::Presence, Layouts, wire::Telemetry, Liveliness>;
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] Hub::Callbacks callbacks();
  [[nodiscard]] std::vector<std::string> arguments_of(std::size_t process, Round now) const;
  void start(std::size_t process, Round now = 0);
  void start_present(Round k);
  void start_first();
  void note_started();
  void handle(wire::Presence&& presence);
  /// The process of who wrote it, if that one takes part; it is answered.
  [[nodiscard]] std::optional<std::size_t> admit(const wire::Presence& presence);
  void answer(const wire::Command& command);
  void tell_remarks(RunObserver& observer);
  void tell_awaited(RunObserver& observer) const;
  void watch_children();
  void watch_external();
  void wake_stopped(bool all);
  void is_gone(std::size_t process, Roster::Departure how);
  void lose(std::size_t process, const std::string& text);
  void broadcast_given_up();
  [[nodiscard]] bool may_lose(std::size_t process) const;
  [[noreturn]] void time_out();

  const Experiment& experiment_;
  RunOptions options_;
  Placement placement_;
  Clock::time_point deadline_;
  Processes processes_;
  Roster roster_;
  Remarks remarks_;
  std::vector<std::string> early_remarks_;           // told before the first round, and again if it never comes to that
  std::map<std::size_t, Clock::time_point> silent_;  // who is not launched from here, and since when nothing is heard of it
  std::map<std::size_t, std::pair<Clock::time_point, std::string>> early_;  // launched processes that left unasked: since when, in words
  struct Stopped {
    std::string process;
    Clock::time_point until;
  };
  std::vector<Stopped> stopped_;
  std::uint32_t epoch_ = 0;
  std::optional<Assignments> assignments_;  // of the job
  std::map<AgentId, Layouts> layouts_;
  bool leaving_ = false, failed_ = false;
  bool granted_ = false;  // rounds of the job have been granted
  Grant newest_grant_;
  std::vector<Loss> losses_;
  News<Word> news_;
  Connections connections_;  // before DDS has its addresses
  Hubs hubs_;
  std::optional<Fleet> fleet_;  // last: ends first
};

}  // namespace consort
