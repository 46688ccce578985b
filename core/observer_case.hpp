#pragma once
/// From an experiment to the whole observed system that theory speaks of: the agents that are there, with their matrices and gains.

#include "core/acyclic_sensing.hpp"
#include "core/experiment.hpp"
#include "core/observer_design.hpp"

#include <string>
#include <vector>

namespace consort {

/// What the agents of a plant model made of matrices know (A, B, C; A_2, C_2, ...; relative, absolute), by agent: models `linear` and
/// `integrator`; empty for any other. The plant itself tells the same, where one is at hand.
std::vector<Values> known_matrices(const Experiment& experiment, Seed run_seed);

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

/// `choice` is distributed_observer, cooperative_localization (which gets the matrices that DAGC leaves it) or acyclic_sensing (no system).
/// `knowledge` by agent. Throws ConfigError on parameters that do not fit.
ObservedCase observed_case(const Experiment& experiment, const ProtocolChoice& choice, const std::vector<Values>& knowledge,
                           const Graph& communication, Round k);

/// The graph of some agents, renumbered in order. `members` ascending.
Graph part_of(const Graph& graph, const std::vector<AgentId>& members);

}  // namespace consort
