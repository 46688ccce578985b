#pragma once
/// Every metric there is: those of any run, and what the protocols offer by their entries.

#include "core/metrics/metrics.hpp"

#include <span>
#include <vector>

namespace consort {

/// All of them, by name once each, in the order `consort list metrics` prints them.
std::span<const MetricEntry> metric_table();

/// The metrics named in the experiment (all that apply if it names none). Throws ConfigError on a name that is none.
Metrics compute_metrics(const Experiment&, Seed run_seed, const ProtocolChoice&, const Trace&);

/// What compute_metrics() will call its numbers after a whole run, of all metrics whatever the experiment names. `empty`: its trace,
/// without a report.
MetricNames names_of_metrics(const Experiment&, const ProtocolChoice&, const Trace& empty);

}  // namespace consort
