#pragma once
/// Metrics of agents that steer a plant, or that theory promises a value to. Lines of the table in metrics.cpp.

#include "core/metrics/metrics.hpp"

namespace consort {

/// The value theory promises to the disturbance-free run: local voting and measured consensus w^T x(0) (Knotek, thesis, (2.13));
/// minimum-energy consensus with stationary gains (24) of Zamani et al. 2014. For other protocols, graphs that switch or have no spanning
/// tree, and more than 300 agents: nothing.
void predicted_value(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

/// Agents that steer a plant, and local voting: largest final distance of an agent from the leader, if exactly one agent never hears
/// anybody.
void leader_error(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

/// Zamani et al. 2014, (31): sum over the agents of the squared distance of their states from the mean state, averaged over the reported
/// rounds of the second half of the run. For agents that steer a plant.
void coherence(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

/// Minimum-energy consensus, scalar states: largest |[x; e] - point of agreement| among the reports of the second half of the run.
void agreement_deviation(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

/// Its bound over the same rounds, Zamani et al. 2014, (28) with the corrected (29), where all disturbances are bounded; up to 20 agents.
void agreement_deviation_bound(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

}  // namespace consort
