#pragma once
/// Metrics of agents that adapt coupling gains: what the gains came to.

#include "core/metrics/metrics.hpp"

#include <array>

namespace consort {

// Of the recorded numbers "c" (or "c_min", "c_mean", "c_max", where an agent has several gains), over the agents that hear somebody.
void gain_min(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);
void gain_mean(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);
void gain_max(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);
void gain_peak(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);
void gain_name(std::string_view name, const PlannedRun&, MetricNames& out);

inline constexpr std::array kGainMetrics{
    MetricEntry{"gain_min", "smallest final coupling gain among the agents that hear somebody", gain_min, gain_name},
    MetricEntry{"gain_mean", "mean of those", gain_mean, gain_name}, MetricEntry{"gain_max", "largest of those", gain_max, gain_name},
    MetricEntry{"gain_peak", "largest such gain in any reported round", gain_peak, gain_name}};

}  // namespace consort
