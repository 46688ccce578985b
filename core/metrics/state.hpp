#pragma once
/// Metrics of what agents record beside their estimates. Lines of the table in metrics.cpp. Nothing where it is not recorded.

#include "core/metrics/metrics.hpp"

namespace consort {

/// P_trace: mean over the agents of the final trace P_i, how unsure they say they are; where an agent holds information Y_i instead, of
/// trace Y_i^-1 (NaN where Y_i has no inverse).
void covariance_held(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

/// control_peak: largest |u| of a component in any reported round. control_rms: root of the mean of |u_i|^2 over agents and reported rounds
/// after the first.
void control_effort(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

// Their names.
void covariance_name(std::string_view name, const PlannedRun&, MetricNames& out);
void control_names(std::string_view name, const PlannedRun&, MetricNames& out);

}  // namespace consort
