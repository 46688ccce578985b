#pragma once
/// Metrics of agents that estimate everybody (Huang et al. 2025). Lines of the table in metrics.cpp.

#include "core/metrics/metrics.hpp"

namespace consort {

/// |E| of (8) at the end: all hat_j^(i) and all bar_i minus the truth, stacked, over those that are estimated; and
/// `observer_error_relative`: that, over the norm of the truth stacked alike. Scale-free where the plant itself is unstable.
void observer_error(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

/// Largest |E| among the reports of the second half of the run: the ultimate error.
void observer_error_peak(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

/// What (19) says that the ultimate error stays below with inputs of others unknown, kappa |B| ubar / eta, as printed: ubar the largest
/// amplitude of an input. As `observer_bound_stacked`: with all unknown inputs at once, kappa |D u| / eta, which is what the proof gives.
/// For constant graphs with everybody there throughout, plant models `linear` and `integrator`, up to 100 error components.
void observer_bound(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

}  // namespace consort
