#pragma once
/// Metrics of runs whose agents adapt coupling gains: what the gains came to, and when the agents agreed.

#include "core/metrics/metrics.hpp"

namespace consort {

/// gain_min, gain_mean, gain_max: final gains over the agents that hear somebody; gain_peak: the largest in any reported round. Of the
/// recorded numbers "c" (or "c_min", "c_mean", "c_max", where an agent has several gains); nothing where there are none.
void gain_min(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);
void gain_mean(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);
void gain_max(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);
void gain_peak(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

/// consensus_time, s: the first reported time from which the ranges (largest minus smallest over the agents, a leader among them) of all
/// components add up to at most the stop rule's disagreement (0.01 without one); after the last agent has joined, counted from then. NaN:
/// never.
void consensus_time(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

}  // namespace consort
