#pragma once
/// All processes a run has started, here and on other hosts: the same verbs for both.

#include "orchestrator/run/connections.hpp"
#include "orchestrator/run/launch.hpp"
#include "orchestrator/run/run.hpp"
#include "orchestrator/run/spread.hpp"
#include "orchestrator/run/wiring.hpp"

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace consort {

/// Connections to the hosts of a run that one leads to and that have processes; by host, empty where there is none. Their builds fit, and
/// `options.host_addresses` are what they say themselves, and the ports of the run are free there. `remark` is told what is worth knowing
/// of them. Throws RunError that names every host that cannot take part, and why.
using Connections = std::vector<std::unique_ptr<Connection>>;
Connections connect(const Experiment& experiment, RunOptions& options, const Placement& placement,
                    const std::function<void(const std::string&)>& remark);

class Fleet {
 public:
  /// `agent_executable`: consort-agent on this host; consort-plant lies beside it.
  Fleet(std::filesystem::path log_directory, std::filesystem::path agent_executable, Connections& connections)
      : connections_(connections), agent_executable_(std::move(agent_executable)), here_(std::move(log_directory)) {}
  ~Fleet();  ///< ends whoever is left: here as Children does, elsewhere with the connections, which close
  Fleet(const Fleet&) = delete;
  Fleet& operator=(const Fleet&) = delete;

  struct Process {
    std::string name;
    std::size_t host = kHere;
    bool plant = false;
    std::vector<std::string> arguments;  ///< without those that say who starts it
    std::string key;
  };
  void start(const Process& process);
  /// Those that were started since the last call, as soon as their pids are known.
  struct Started {
    std::string name, host;
    pid_t pid = 0;
  };
  std::vector<Started> take_started();
  /// To the one that was started last under this name, if it lives.
  void signal(const std::string& name, int number);
  void wake_all();  ///< SIGCONT to all that live
  std::optional<Death> next_death();
  /// Waits until all have ended by themselves or `seconds` have passed; true if all have.
  bool wait_all(double seconds);

 private:
  [[nodiscard]] std::size_t alive() const;
  Connections& connections_;
  std::filesystem::path agent_executable_;
  Children here_;
  std::map<std::string, std::size_t> host_of_;  // by name
  std::vector<Started> started_here_;
};

}  // namespace consort
