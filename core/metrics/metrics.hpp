#pragma once
/// Numbers that say how a run went. Pure functions of the trace and of the values the agents started with.

#include "core/experiment.hpp"
#include "core/trace.hpp"

#include <functional>
#include <map>
#include <string>

namespace consort {

/// name -> value; vector-valued metrics appear as name[0], name[1], ...
using Metrics = std::map<std::string, double>;

/// A number as `name`, several as name[0], name[1], ...
void put(Metrics& out, const std::string& name, const Vector& value);

struct MetricEntry {
  std::string_view name;
  std::string_view summary;  ///< one line, with the equation's source
  void (*compute)(const Experiment&, Seed run_seed, const ProtocolChoice&, const Trace&, Metrics& out);
};

/// Every metric there is, in the order `consort list metrics` prints them.
std::span<const MetricEntry> metric_table();

/// The metrics named in the experiment (all that apply if it names none).
Metrics compute_metrics(const Experiment&, Seed run_seed, const ProtocolChoice&, const Trace&);

/// Centralised estimate (Alighanbari, How 2006, eq. (6)) of the initial values: (sum P_i^-1)^-1 sum P_i^-1 x_i; the mean where no P is
/// given. Empty where agents start without an estimate x of their own.
Vector centralised_estimate(const Experiment&, Seed run_seed);

}  // namespace consort
