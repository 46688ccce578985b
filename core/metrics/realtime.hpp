#pragma once
/// Metrics of runs on the wall clock: what the network did to the messages, and how the processes kept time.

#include "core/metrics/metrics.hpp"

namespace consort {

/// Messages over all links, by their round numbers, apart from what the link model drops: network_sent (as many as in-neighbours and
/// rounds ask for), network_lost (never came), network_late (came when the round was over), network_duplicated, network_reordered. Nothing
/// in other modes.
void network(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

/// missed_deadlines: rounds left out, over all processes; missed_inputs: measurements and actuations that had not come. jitter_p50,
/// jitter_p99, jitter_max, s: of the process where it is largest. cpu, s: of all; resident_bytes: of the largest. dds_deadlines_missed and
/// liveliness_lost: as DDS counts them. Nothing in other modes.
void timing(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

// Their names; each of the two gives all of its own.
void network_names(std::string_view name, const PlannedRun&, MetricNames& out);
void timing_names(std::string_view name, const PlannedRun&, MetricNames& out);

}  // namespace consort
