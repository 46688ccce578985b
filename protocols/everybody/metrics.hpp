#pragma once
/// Metrics of agents that estimate everybody (Huang et al. 2025).

#include "core/metrics/metrics.hpp"
#include "protocols/everybody/observed_case.hpp"

#include <array>

namespace consort {

/// |E| of (8) at the end: all hat_j^(i) and all bar_i minus the truth, stacked, over those that are estimated; and
/// `observer_error_relative`: that, over the norm of the truth stacked alike. Scale-free where the plant itself is unstable.
void observer_error(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);
void observer_error_names(std::string_view name, const PlannedRun&, MetricNames& out);

/// Largest |E| among the reports of the second half of the run: the ultimate error.
void observer_error_peak(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

/// What (19) says that the ultimate error stays below with inputs of others unknown, kappa |B| ubar / eta, as printed: ubar the largest
/// amplitude of an input. As `observer_bound_stacked`: with all unknown inputs at once, kappa |D u| / eta, which is what the proof gives.
/// For constant graphs with everybody there throughout, plants that tell A, B and C, up to 100 error components.
template <ObserverTask task>
void observer_bound(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);
template <ObserverTask task>
void observer_bound_names(std::string_view name, const PlannedRun&, MetricNames& out);

template <ObserverTask task>
inline constexpr std::array kObserverMetrics{
    MetricEntry{"observer_error", "final |E| of all estimates of everybody, bar_i too; observer_error_relative: over that of the truth",
                observer_error, observer_error_names},
    MetricEntry{"observer_error_peak", "largest |E| in the second half of the run", observer_error_peak, its_name},
    MetricEntry{"observer_bound", "what it stays below with others' inputs unknown, (19); observer_bound_stacked: all inputs at once",
                observer_bound<task>, observer_bound_names<task>}};

}  // namespace consort
