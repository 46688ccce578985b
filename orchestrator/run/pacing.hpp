#pragma once
/// Real time: what is due when so much time has passed since round 0 began, whatever round the agents are in. Pure: the clock is told.

#include "core/experiment.hpp"
#include "core/messages.hpp"

#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace consort {

class Pacing {
 public:
  /// Somebody's process begins a stay of its own: it is started a little before.
  struct Call {
    AgentId agent;
    Round from = 0;
    bool first = false;  ///< it has not been called before; else its process is started again if it does not run
  };

  /// `start_ns`: wall clock of round 0, on which all processes agree. `last_reports`: for so long (s) after the last round, reports under
  /// way are waited for. `experiment` must outlive this.
  Pacing(const Experiment& experiment, Seed seed, std::uint32_t epoch, std::uint64_t start_ns, double last_reports);

  /// The graphs of the rounds to come, well before they begin.
  std::optional<Grant> graphs(double elapsed);
  /// Kills and stops whose time has come, each once, in order.
  std::vector<Fault> faults(double elapsed);
  std::vector<Call> calls(double elapsed);
  /// The last round is over, and everybody has had the time to report it.
  [[nodiscard]] bool is_over(double elapsed) const { return elapsed > experiment_.rounds * experiment_.dt + last_reports_; }

 private:
  const Experiment& experiment_;
  std::uint32_t epoch_;
  std::uint64_t start_ns_;
  double last_reports_;
  Schedule schedule_;
  Round granted_ = 0;
  std::size_t next_fault_ = 0;
  std::set<std::pair<Round, AgentId>> called_;
};

}  // namespace consort
