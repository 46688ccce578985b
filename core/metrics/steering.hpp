#pragma once
/// Metrics of agents that steer a plant and agree on its states. Lines of the table in metrics.cpp; nothing where agents do not steer.

#include "core/metrics/metrics.hpp"

namespace consort {

/// Largest final distance of an agent from the leader, if exactly one agent never hears anybody.
void leader_error(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);
void leader_error_name(std::string_view name, const PlannedRun&, MetricNames& out);
// The same whatever the agents agree on.
void distance_from_leader(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);
void distance_from_leader_name(std::string_view name, const PlannedRun&, MetricNames& out);

/// Zamani et al. 2014, (31): sum over the agents of the squared distance of their states from the mean state, averaged over the reported
/// rounds of the second half of the run.
void coherence(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

/// consensus_time, s: the first reported time from which the ranges (largest minus smallest over the agents, a leader among them) of all
/// components add up to at most the stop rule's disagreement (0.01 without one); after the last agent has joined, counted from then. NaN:
/// never.
void consensus_time(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

void steering_name(std::string_view name, const PlannedRun&, MetricNames& out);

}  // namespace consort
