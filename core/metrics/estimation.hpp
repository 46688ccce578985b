#pragma once
/// Metrics of agents that estimate the state of a plant. Lines of the table in metrics.cpp. They say nothing of other protocols.

#include "core/metrics/metrics.hpp"

namespace consort {

/// `error`: norm of all agents' final errors, stacked; `error.<agent>`: of one agent's; `error.<agent>.<field>`: of what one agent
/// estimates of one named group of the plant's state (a mode of a beam, say), where every agent estimates one and the same kind of part and
/// the plant names more than one group. Up to 50 agents one by one.
void final_error(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

/// `error` divided by the norm of what is estimated, for plants that grow.
void relative_error(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

/// Largest absolute value of one component of any agent's error among the reports of the second half of the run.
void error_peak(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

/// Root of the mean square of all components of all agents' errors, over the reports of the second half; `rmse.<agent>` of one agent's.
void rmse(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

/// Normalised estimation error squared e^T P^-1 e (Bar-Shalom, Li, Kirubarajan 2001, 5.4.2), mean over agents and the reports of the second
/// half, where an estimate has a field P; n if P is what the error's covariance is. `nees_low`, `nees_high`, with several runs: where 95 of
/// 100 means over as many independent samples as the experiment has runs lie then, chi-square with n times runs degrees of freedom. The
/// averages over agents and time are of samples that depend on each other; they only narrow the mean, so the bounds are wide for it: a
/// mean outside contradicts P, one inside does not prove it.
/// No number where a variance has vanished (below 1e-290), as it does without process noise.
/// Throws RunError naming agent, round, size and condition where P is not positive definite.
void nees(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

// Their names.
void estimators_name(std::string_view name, const PlannedRun&, MetricNames& out);
void error_names(std::string_view name, const PlannedRun&, MetricNames& out);
void rmse_names(std::string_view name, const PlannedRun&, MetricNames& out);
void nees_names(std::string_view name, const PlannedRun&, MetricNames& out);

}  // namespace consort
