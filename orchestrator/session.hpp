#pragma once
/// The processes of one `consort run` and the orchestrator's end of the wire: launched once, given one run after the other, ended together.

#include "idl/wire.hpp"
#include "orchestrator/launch.hpp"
#include "orchestrator/placement.hpp"
#include "orchestrator/run.hpp"

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

  /// Starts the agent processes and waits until each has said hello.
  void launch(RunObserver& observer);
  /// Hands out the assignments of one job and waits until every process has met its neighbours.
  void assign(const Job& job, std::uint32_t epoch, RunObserver& observer);
  /// Waits a moment for news and handles it. Throws RunError when a process died or failed, TimeoutError when the deadline has passed.
  void step(const std::function<void(wire::Telemetry&&)>& on_telemetry);
  /// Asks every process whom it waits for; a text for a person.
  std::string who_waits();
  /// Ends the processes politely.
  void shut_down();

  [[nodiscard]] bool interrupted() const { return options_.interrupt && options_.interrupt->load() != 0; }
  [[nodiscard]] std::size_t processes() const { return placement_.processes.size(); }
  [[nodiscard]] wire::Layouts layouts() const;
  wire::Writer<wire::Grant>& grants() { return *grants_; }
  wire::Writer<wire::Command>& commands() { return *commands_; }

 private:
  using News = std::variant<wire::Presence, wire::Layouts, wire::Telemetry>;
  struct ProcessState {
    std::string name;
    bool external = false;
    bool found = false;
    std::uint32_t ready_epoch = 0;
    std::optional<wire::Presence> status;  // answer to the newest status command
  };

  void open_domain();
  void create_endpoints();
  [[nodiscard]] std::vector<std::string> agent_arguments(std::size_t process) const;
  [[nodiscard]] bool is_external(const ProcessPlan& process) const;
  [[nodiscard]] std::vector<wire::Assignment> assignments(const Job& job, std::uint32_t epoch) const;
  void push(News&& news);
  void handle(wire::Presence&& presence);
  void watch_children();
  [[noreturn]] void time_out();
  [[nodiscard]] std::string names(const std::function<bool(const ProcessState&)>& which) const;
  [[nodiscard]] std::size_t count(const std::function<bool(const ProcessState&)>& which) const;

  const Experiment& experiment_;
  RunOptions options_;
  Placement placement_;
  std::chrono::steady_clock::time_point deadline_;
  std::optional<PortBlock> ports_;
  dds::configuration::Settings settings_;  // the orchestrator's own
  std::uint32_t domain_number_ = 0;
  std::map<std::uint32_t, std::size_t> process_by_name_;  // lowest agent id -> index
  std::vector<ProcessState> states_;
  std::uint32_t epoch_ = 0;
  std::map<AgentId, wire::Layouts> layouts_;
  bool leaving_ = false;

  std::mutex mutex_;  // guards news_
  std::condition_variable arrived_;
  std::deque<News> news_;

  std::optional<dds::domain::Domain> domain_;
  std::optional<dds::domain::DomainParticipant> participant_;
  std::optional<wire::Writer<wire::Assignment>> assignments_;
  std::optional<wire::Writer<wire::Grant>> grants_;
  std::optional<wire::Writer<wire::Command>> commands_;
  std::optional<wire::Reader<wire::Presence>> presence_;
  std::optional<wire::Reader<wire::Layouts>> layout_reader_;
  std::optional<wire::Reader<wire::Telemetry>> telemetry_;
  std::optional<Children> children_;  // last: ends first
};

}  // namespace consort
