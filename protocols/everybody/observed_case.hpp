#pragma once
/// From an experiment to the whole observed system that theory speaks of: the agents that are there, with their matrices and gains.

#include "core/experiment.hpp"
#include "protocols/everybody/observer_design.hpp"

#include <string>
#include <vector>

namespace consort {

/// What the agents of this family do with what they measure.
enum class ObserverTask {
  observe,   ///< everybody estimates everybody from outputs
  settle,    ///< the agents settle by DAGC who uses which relative measurement, and no more
  localise,  ///< both, the measurements being relative
};

/// The agents that are there in one round, renumbered 1, 2, ... in `system`.
struct ObservedCase {
  std::vector<AgentId> members;  ///< ascending
  ObservedSystem system;
  std::vector<InputLaw> inputs;     ///< by member
  std::vector<double> mu;           ///< by member; `system` has the smallest
  bool inputs_known = true;         ///< by everybody
  std::vector<std::size_t> layers;  ///< by member, of DAGC; empty without relative sensing; members.size(): no absolute position in reach
  std::vector<Edge> uses;           ///< of DAGC, in original numbers: `to` uses the edge with `from`
};

/// Who localises gets the matrices that DAGC leaves it; there is no system where agents only settle. `knowledge` by agent: what the plant
/// lets it know. Throws ConfigError on parameters that do not fit.
ObservedCase observed_case(ObserverTask task, const Experiment& experiment, const ProtocolChoice& choice,
                           const std::vector<Values>& knowledge, const Graph& communication, Round k);

}  // namespace consort
