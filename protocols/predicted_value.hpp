#pragma once
/// The value that theory promises to a run without disturbances: what more than one family offers of it.

#include "core/metrics/metrics.hpp"

#include <memory>

namespace consort {

/// The graph of the whole run if there is only one, everybody hears of somebody, and there are at most 300 agents.
std::shared_ptr<const Graph> lasting_graph(const Experiment& experiment, Seed run_seed);

// Averaging: w^T x(0), w the left null vector of L (Knotek, thesis, (2.13)).
void averaged_value(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);
void averaged_value_names(std::string_view name, const PlannedRun&, MetricNames& out);

/// The line of a protocol that promises a value.
constexpr MetricEntry predicted_value(decltype(MetricEntry::compute) compute, decltype(MetricEntry::names) names) {
  return {"predicted_value", "what theory promises without disturbances (Knotek, thesis, (2.13); Zamani et al. 2014, (24))", compute,
          names};
}

}  // namespace consort
