#pragma once
/// How a run ended, and whether it came as far as was asked of it.

#include "core/experiment.hpp"

#include <optional>
#include <string>
#include <vector>

namespace consort {

enum class Ending : std::uint8_t {
  last_round,   ///< everybody who was to be there reported it
  stop_rule,    ///< held
  nobody_left,  ///< the last agent has left or been killed, and none will come: there is no round to run any more
  out_of_time,  ///< real time: the clock passed the last round, and somebody had not reported it
  deadline,
  signal,
  failure
};
std::string_view name_of(Ending ending);
/// As it was asked to.
constexpr bool is_complete(Ending ending) {
  return ending == Ending::last_round || ending == Ending::stop_rule || ending == Ending::nobody_left;
}

/// How far one agent came.
struct AgentEnd {
  /// Why it was not there at the end.
  enum class Absence : std::uint8_t {
    none,      ///< it was to be
    awaited,   ///< by plan, it joins later than the run came
    left,      ///< by plan
    killed,    ///< by plan
    given_up,  ///< it died unplanned, in a run that goes on without it
  };
  AgentId agent;
  Round reached = 0;  ///< the last round it has reported
  Round asked = 0;    ///< the last round it was to report: the run's, or the one in which it leaves for good
  Absence absence = Absence::none;
  std::uint64_t slept = 0;  ///< real time: rounds it was there for and left out
};
std::string_view name_of(AgentEnd::Absence absence);

/// The file has the agent's process killed in that round.
bool killed_in(const Experiment& experiment, AgentId agent, Round round);
/// The agents of a run that came to round `last`, everybody as far as the file lets it.
std::vector<AgentEnd> agents_by_plan(const Experiment& experiment, Round last);
/// Over several runs: how far each came in the worst of them, and what it slept in all.
void merge(std::vector<AgentEnd>& all, const std::vector<AgentEnd>& run);

/// What a driver knows when one run is over.
struct RunEnd {
  Ending ending = Ending::last_round;
  std::vector<AgentEnd> agents = {};
  std::optional<Round> plant = {};  ///< the last round the plant's process has reported; nullopt: no such process
};

struct Completeness {
  bool complete = true;
  std::vector<std::uint32_t> missing = {};  ///< agents that did not come as far as they were to, ascending; 0 before them: the plant
  std::string words = {};                   ///< why it is not complete; empty if it is
};
/// `reached` of `asked` rounds are in the trace. A run is complete if it came to its end: the last round, its stop rule, or nobody left.
Completeness completeness(const RunEnd& end, Round reached, Round asked);

/// "1-3, 7"
std::string listed(const std::vector<std::uint32_t>& ids);
/// Agents with the same figures, as one, in the order of the first of each.
std::vector<std::pair<std::vector<std::uint32_t>, AgentEnd>> alike(const std::vector<AgentEnd>& agents);
/// One line for each group of agents that were absent at the end, or slept; at most a few.
std::vector<std::string> told(const std::vector<AgentEnd>& agents);

}  // namespace consort
