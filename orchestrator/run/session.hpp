#pragma once
/// The processes of one `consort run` and the orchestrator's end of the wire: launched once, given one run after the other, ended together.

#include "idl/wire.hpp"
#include "orchestrator/run/hub.hpp"
#include "orchestrator/run/launch.hpp"
#include "orchestrator/run/placement.hpp"
#include "orchestrator/run/roster.hpp"
#include "orchestrator/run/run.hpp"
#include "rounds/simulate.hpp"

#include <dds/dds.hpp>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <variant>

namespace consort {

class Session {
 public:
  Session(const Experiment& experiment, const RunOptions& options);
  ~Session();

  /// Starts the processes that are there from the first round on, the plant among them, and waits until each has said hello.
  void launch(RunObserver& observer);
  /// Starts the processes that begin to take part in round `first` or before, also those that come back, and waits until everybody is
  /// ready for that round.
  void join(Round first, const std::function<void(wire::Telemetry&&)>& on_telemetry);
  /// The same without waiting for anybody.
  void call(Round first);
  /// Starts the agent's process for its stay in round k, if it does not run, for example since the one before was still ending. Who died
  /// unplanned stays dead.
  void start_for(AgentId agent, Round k);
  /// Kills an agent's process and waits until it has ended.
  void kill(AgentId agent, const std::function<void(wire::Telemetry&&)>& on_telemetry);
  /// Stops an agent's process for so long.
  void stop(AgentId agent, Seconds duration);
  /// The run has failed: from now on no death, and no deadline, is another failure.
  void bear_with_losses() { failed_ = true; }
  /// Lets every stopped process go on at once.
  void wake_all() { wake_stopped(true); }
  /// Hands out the assignments of one job and waits until every process has met its neighbours.
  void assign(const Job& job, std::uint32_t epoch, RunObserver& observer);
  /// Waits a moment for news and handles it. Throws RunError when a process died or failed, TimeoutError when the deadline has passed.
  void step(const std::function<void(wire::Telemetry&&)>& on_telemetry);
  /// Asks every process whom it waits for; a text for a person.
  std::string who_waits();
  /// Agents that have died since the last call, in a run that goes on without them (`on_agent_loss: continue`), with a text for a person.
  struct Loss {
    std::vector<AgentId> agents;
    std::string text;
  };
  std::vector<Loss> take_losses() { return std::exchange(losses_, {}); }
  /// What is worth keeping but ends no run: strangers, samples that were refused. Each is told once.
  std::vector<std::string> take_remarks();
  /// All samples refused so far, by whoever takes part, as far as has been reported; by writer, topic and reason.
  [[nodiscard]] const std::vector<Refusal>& refusals() const { return refusals_; }
  /// Ends the processes politely.
  void shut_down();

  [[nodiscard]] bool interrupted() const { return options_.interrupt && options_.interrupt->load() != 0; }
  /// Processes started so far (or expected, where somebody starts them by hand); the plant is one.
  [[nodiscard]] std::size_t processes() const;
  /// Are all processes that are running now among these (by lowest agent id; 0: the plant)?
  [[nodiscard]] bool all_among(const std::set<std::uint32_t>& names) const;
  /// The least of what is said of the processes that are running now (by lowest agent id; 0: the plant); of whom nothing is said, 0.
  [[nodiscard]] Round least(const std::map<std::uint32_t, Round>& rounds) const;
  [[nodiscard]] RunLayouts layouts() const;
  void broadcast(const wire::Grant& grant);
  void broadcast(const wire::Command& command);

 private:
  struct Liveliness {
    std::string sender;
    bool alive;
  };
  using News = std::variant<wire::Presence, wire::Layouts, wire::Telemetry, Liveliness>;
  struct ProcessState {
    std::string name;
    bool external = false;
    Attendance presence;
    bool dying = false;    // its death is wanted
    bool started = false;  // or expected, where it is external
    bool found = false;
    std::optional<std::chrono::steady_clock::time_point> silent_since;  // where it is external
    std::string where;                                                  // process and host, for a person
    std::uint32_t ready_epoch = 0;
    Round ready_until = 0;                 // in that epoch: rounds below may be granted
    std::optional<wire::Presence> status;  // answer to the newest status command
  };

  void open_hubs();
  void open_multicast_hub(const Hub::Callbacks& callbacks);
  void take_private_ports();
  void open_neighbour_hubs(const Hub::Callbacks& callbacks);
  [[nodiscard]] std::size_t hub_of(std::size_t process) const;
  [[nodiscard]] std::uint16_t port(std::size_t slot) const;  // of hub `slot`, then of process `slot - hubs`
  [[nodiscard]] std::vector<std::string> arguments_of(std::size_t process, Round now) const;
  [[nodiscard]] bool has_plant() const { return experiment_.plant.has_value(); }
  [[nodiscard]] std::size_t plant() const { return placement_.processes.size(); }  // its index among the processes
  [[nodiscard]] std::size_t slots() const { return placement_.processes.size() + (has_plant() ? 1 : 0); }
  void start(std::size_t process, Round now = 0);
  void start_present(Round k);
  [[nodiscard]] bool is_lost(std::size_t process) const;
  /// As the agents are told it in round `now`.
  [[nodiscard]] std::vector<wire::Assignment> assignments(std::size_t hub, Round now) const;
  [[nodiscard]] std::vector<wire::PlantAssignment> plant_assignments(const Job& job, std::uint32_t epoch) const;
  [[nodiscard]] wire::Delivery delivery() const;
  [[nodiscard]] wire::Member member_of(AgentId agent, Round now) const;
  [[nodiscard]] bool killed_in(AgentId agent, Round round) const;
  void push(News&& news);
  void handle(wire::Presence&& presence);
  /// The process of who wrote it, if that one takes part; it is answered.
  [[nodiscard]] std::optional<std::size_t> admit(const wire::Presence& presence);
  void warn_of_sources(const wire::Presence& presence);
  void answer(const wire::Command& command);
  void tell_remarks(RunObserver& observer);
  void tell_awaited(RunObserver& observer) const;
  void note(std::vector<Refusal> refusals);
  void watch_children();
  void watch_external();
  void wake_stopped(bool all);
  void lose(std::size_t process, const std::string& text);
  [[nodiscard]] bool leaves(std::size_t process) const;
  [[nodiscard]] bool may_lose(std::size_t process) const;
  [[noreturn]] void time_out();
  [[nodiscard]] std::string names(const std::function<bool(const ProcessState&)>& which) const;
  [[nodiscard]] std::size_t count(const std::function<bool(const ProcessState&)>& which) const;

  const Experiment& experiment_;
  RunOptions options_;
  Placement placement_;
  std::chrono::steady_clock::time_point deadline_;
  std::optional<PortBlock> ports_;
  bool private_ports_ = false;             // multicast discovery on ports of this run alone
  std::optional<DomainShare> shared_;      // else: with whom it shares those of the domain
  std::optional<SoleRun> sole_;            // else: others of its name are kept out
  dds::configuration::Settings settings_;  // common to the orchestrator's hubs
  std::uint32_t domain_number_ = 0;
  std::map<std::uint32_t, std::size_t> process_by_name_;  // lowest agent id -> index
  std::vector<ProcessState> states_;
  std::optional<Roster> roster_;
  std::uint32_t epoch_ = 0;
  Job job_;
  std::map<AgentId, wire::Layouts> layouts_;
  std::optional<AgentMaker> maker_;  // of the job that is assigned
  const ProtocolEntry* protocol_ = nullptr;
  std::vector<std::vector<Told>> told_;  // by agent: whose announcements reach it; empty where nobody announces anything
  bool steers_ = false;                  // the job's agents steer the plant
  struct Stopped {
    std::string process;
    std::chrono::steady_clock::time_point until;
  };
  std::vector<Stopped> stopped_;
  bool leaving_ = false, failed_ = false;
  bool granted_ = false;       // rounds of the job have been granted
  std::vector<AgentId> gone_;  // lost in this job, ascending
  std::vector<Loss> losses_;
  std::vector<std::string> remarks_, early_remarks_;  // early: told before the first round, and again if it never comes to that
  std::vector<Refusal> refusals_;
  std::set<std::pair<std::string, std::string>> other_sources_;  // commit and host, told once

  std::mutex mutex_;  // guards news_
  std::condition_variable arrived_;
  std::deque<News> news_;

  std::vector<std::unique_ptr<Hub>> hubs_;
  std::optional<Children> children_;  // last: ends first
};

}  // namespace consort
