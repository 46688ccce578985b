#pragma once
/// Metrics of agents that steer a plant and that theory promises a value to (Zamani, Shames, Ugrinovskii 2014).

#include "protocols/predicted_value.hpp"

#include <array>

namespace consort {

/// (24), with stationary gains.
void minimum_energy_value(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);
void minimum_energy_value_names(std::string_view name, const PlannedRun&, MetricNames& out);

/// Scalar states: largest |[x; e] - point of agreement| among the reports of the second half of the run.
void agreement_deviation(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);
void agreement_deviation_name(std::string_view name, const PlannedRun&, MetricNames& out);

/// Its bound over the same rounds, (28) with the corrected (29), where all disturbances are bounded; up to 20 agents.
void agreement_deviation_bound(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);
void agreement_deviation_bound_name(std::string_view name, const PlannedRun&, MetricNames& out);

inline constexpr std::array kMeasuredMetrics{predicted_value(averaged_value, averaged_value_names)};
inline constexpr std::array kMinimumEnergyMetrics{
    predicted_value(minimum_energy_value, minimum_energy_value_names),
    MetricEntry{"agreement_deviation", "minimum-energy consensus: largest distance of [x; e] from agreement, second half of the run",
                agreement_deviation, agreement_deviation_name},
    MetricEntry{"agreement_deviation_bound", "what it stays below (Zamani et al. 2014, (28), (29) corrected), with bounded disturbances",
                agreement_deviation_bound, agreement_deviation_bound_name}};

}  // namespace consort
