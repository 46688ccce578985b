#pragma once
/// Numbers that say how a run went. Pure functions of the trace and of the values the agents started with. Here: what is true of any run,
/// whatever its protocol. A protocol offers others by its entry (protocols/registry.hpp).

#include "core/experiment.hpp"
#include "core/trace.hpp"

#include <functional>
#include <map>
#include <set>
#include <span>
#include <string>

namespace consort {

/// name -> value; vector-valued metrics appear as name[0], name[1], ...
using Metrics = std::map<std::string, double>;
using MetricNames = std::set<std::string>;

/// A number as `name`, several as name[0], name[1], ...
void put(Metrics& out, const std::string& name, const Vector& value);
void put_names(MetricNames& out, std::string_view name, std::size_t size);
/// "rmse.3"
std::string of_agent(std::string_view name, AgentId agent);

/// A run before it begins: what its metrics will be called follows from the experiment and the sizes.
struct PlannedRun {
  const Experiment& experiment;
  const ProtocolChoice& choice;
  const Trace& trace;  ///< without a report: layouts, sizes, what the estimate is of

  /// Takes part at the end of a run that goes through all its rounds.
  [[nodiscard]] bool there_at_end(AgentId agent) const;
  /// Takes part in some round of the second half of such a run.
  [[nodiscard]] bool there_late(AgentId agent) const;
};

struct MetricEntry {
  std::string_view name;
  std::string_view summary;  ///< one line, with the equation's source
  void (*compute)(const Experiment&, Seed run_seed, const ProtocolChoice&, const Trace&, Metrics& out);
  /// What compute() will put into `out` after a whole run: `name`, and what comes with it.
  void (*names)(std::string_view name, const PlannedRun&, MetricNames& out);
  bool of_the_run = false;  ///< of the run, whoever is there at its end
};

/// The names of a metric that is one number of any run.
void its_name(std::string_view name, const PlannedRun&, MetricNames& out);

/// Every metric that is true of any run.
std::span<const MetricEntry> run_metrics();

/// Centralised estimate (Alighanbari, How 2006, eq. (6)) of the initial values: (sum P_i^-1)^-1 sum P_i^-1 x_i; the mean where no P is
/// given. Empty where agents start without an estimate x of their own.
Vector centralised_estimate(const Experiment&, Seed run_seed);

}  // namespace consort
