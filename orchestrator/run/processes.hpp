#pragma once
/// The processes of a run: who is expected, has said hello, is ready, waits for whom, is gone. Pure; who may be one of them is the
/// Roster's business.

#include "idl/wire.hpp"
#include "orchestrator/run/placement.hpp"
#include "orchestrator/run/run.hpp"

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace consort {

struct ProcessState {
  std::string name;                                 ///< for a person: agent-3
  std::vector<AgentId> agents;                      ///< that it hosts, ascending; none: the plant
  bool external = false;                            ///< started by hand
  std::size_t host = static_cast<std::size_t>(-1);  ///< kHere, or the index of another
  Attendance presence = {};                         ///< when somebody of it takes part
  bool leaves = false;                              ///< it ends by itself in the course of the run
  bool started = false;                             ///< or expected, where it is external
  bool found = false;                               ///< it has said hello
  bool dying = false;                               ///< its death is wanted
  std::string where = {};                           ///< process and host, for a person
  std::uint32_t ready_epoch = 0;
  Round ready_until = 0;                      ///< in that epoch: rounds below may be granted
  std::optional<wire::Presence> status = {};  ///< answer to the newest status command

  [[nodiscard]] bool is_plant() const { return agents.empty(); }
  [[nodiscard]] std::uint32_t id() const { return is_plant() ? 0 : agents.front().value; }  ///< as telemetry names it
};

class Processes {
 public:
  using Which = std::function<bool(const ProcessState&)>;

  /// Those of the placement, in its order, and then the plant, if there is one.
  Processes(const Experiment& experiment, const Placement& placement, const RunOptions& options);

  [[nodiscard]] std::size_t size() const { return states_.size(); }
  ProcessState& operator[](std::size_t process) { return states_[process]; }
  const ProcessState& operator[](std::size_t process) const { return states_[process]; }
  [[nodiscard]] auto begin() { return states_.begin(); }
  [[nodiscard]] auto end() { return states_.end(); }
  [[nodiscard]] std::size_t index_of_name(const std::string& name) const;

  [[nodiscard]] std::size_t count(const Which& which) const;
  /// Their names, for a person; empty: none.
  [[nodiscard]] std::string names(const Which& which) const;
  [[nodiscard]] std::size_t running() const {
    return count([](const ProcessState& state) { return state.started; });
  }
  /// Agents of the processes that are running.
  [[nodiscard]] std::size_t agents_running() const;

  /// Takes note of what a process says of itself.
  void hears(std::size_t process, wire::Presence&& presence);
  /// The process is not there any more.
  void is_gone(std::size_t process);
  /// It is given up for the rest of the job.
  void give_up(std::size_t process);
  /// Agents given up in this job, ascending.
  [[nodiscard]] const std::vector<AgentId>& given_up() const { return given_up_; }
  [[nodiscard]] bool is_given_up(std::size_t process) const;
  /// Another job begins, with everybody.
  void begin_job() { given_up_.clear(); }

  /// Who begins a later stay in that round, by the agent that names the process. From then on nobody is ready for more before it has met
  /// them.
  [[nodiscard]] std::vector<AgentId> back_in(Round round) const;
  void ready_at_most(Round round);

  /// Are all that are running now among these (by id)?
  [[nodiscard]] bool all_among(const std::set<std::uint32_t>& ids) const;
  /// The least of what is said of those that are running now (by id); of whom nothing is said, 0.
  [[nodiscard]] Round least(const std::map<std::uint32_t, Round>& rounds) const;

  void forget_status();
  /// What the answers to the newest status command say, for a person.
  [[nodiscard]] std::string who_waits() const;

 private:
  std::vector<ProcessState> states_;
  std::vector<AgentId> given_up_;
};

}  // namespace consort
