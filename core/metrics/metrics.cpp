#include "core/metrics/metrics.hpp"

#include "core/errors.hpp"
#include "core/math/spd.hpp"
#include "core/metrics/estimation.hpp"
#include "core/metrics/realtime.hpp"
#include "core/metrics/state.hpp"
#include "core/metrics_control.hpp"
#include "core/metrics_gains.hpp"
#include "core/metrics_observer.hpp"
#include "core/metrics_sensor_network.hpp"
#include "core/nearest.hpp"
#include "core/stop.hpp"

#include <algorithm>
#include <array>
#include <limits>

namespace consort {
namespace {

/// What the agents agree on at the end (final estimates, or final states where they steer the plant), one column per agent that is there.
Matrix final_values(const Trace& trace) {
  const auto rows = static_cast<Eigen::Index>(trace.agreed_dimension());
  const Eigen::Map<const Matrix> all(trace.agreed_at(trace.rounds.size() - 1).data(), rows, static_cast<Eigen::Index>(trace.agents));
  std::vector<Eigen::Index> present;
  for (Eigen::Index i = 0; i < all.cols(); ++i)
    if (!is_absent(all(0, i))) present.push_back(i);
  return all(Eigen::all, present);
}

/// Estimators do not agree on a value of their own.
bool agrees(const Trace& trace) { return trace.truth == Truth::none; }

void consensus_value(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  if (agrees(trace)) put(out, "consensus_value", final_values(trace).rowwise().mean());
}

void centralised_value(const Experiment& experiment, Seed seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  if (trace.agrees_on_states || !agrees(trace)) return;
  const Vector centralised = centralised_estimate(experiment, seed);
  if (centralised.size() > 0) put(out, "centralised_value", centralised);
}

void bias(const Experiment& experiment, Seed seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  if (trace.agrees_on_states || !agrees(trace)) return;
  const Vector centralised = centralised_estimate(experiment, seed);
  if (centralised.size() > 0) put(out, "bias", final_values(trace).rowwise().mean() - centralised);
}

void final_disagreement(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  if (agrees(trace)) out["disagreement"] = deviation(trace, trace.report(trace.rounds.size() - 1));
}

void spread(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  if (!agrees(trace)) return;
  const Matrix finals = final_values(trace);
  put(out, "spread", finals.rowwise().maxCoeff() - finals.rowwise().minCoeff());
}

void rounds_to_convergence(const Experiment& experiment, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  const double threshold = experiment.convergence.value_or(Convergence{}).within;
  double first = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t report = trace.rounds.size(); report-- > 0 && deviation(trace, trace.report(report)) <= threshold;)
    first = trace.rounds[report];
  out["rounds_to_convergence"] = first;
}

void messages_sent(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  out["messages_sent"] = static_cast<double>(trace.totals.sent);
}
void messages_delivered(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  out["messages_delivered"] = static_cast<double>(trace.totals.delivered);
}
void messages_lost(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  out["messages_lost"] = static_cast<double>(trace.totals.lost);
}
void rounds(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) { out["rounds"] = trace.last_round; }

constexpr std::array kTable{
    MetricEntry{"consensus_value", "mean of the final estimates", consensus_value},
    MetricEntry{"centralised_value", "estimate of one who knows all initial values (Alighanbari, How 2006, (6)); their mean without P",
                centralised_value},
    MetricEntry{"bias", "consensus_value - centralised_value", bias},
    MetricEntry{"disagreement", "largest distance between two agents' final estimates", final_disagreement},
    MetricEntry{"spread", "largest minus smallest final estimate, per component", spread},
    MetricEntry{"rounds_to_convergence",
                "first reported round from which the disagreement (of estimators: the error) stays within the stop rule's (1e-3 without "
                "one); NaN: never. Over several runs the mean of those that converged; rounds_to_convergence.share: their share",
                rounds_to_convergence},
    MetricEntry{"predicted_value", "what theory promises without disturbances (Knotek, thesis, (2.13); Zamani et al. 2014, (24))",
                predicted_value},
    MetricEntry{"leader_error", "largest final distance from the leader, the only agent that never hears anybody", leader_error},
    MetricEntry{"coherence", "sum over agents of squared distances from the mean state, second half of the run (Zamani et al. 2014, (31))",
                coherence},
    MetricEntry{"agreement_deviation", "minimum-energy consensus: largest distance of [x; e] from agreement, second half of the run",
                agreement_deviation},
    MetricEntry{"agreement_deviation_bound", "what it stays below (Zamani et al. 2014, (28), (29) corrected), with bounded disturbances",
                agreement_deviation_bound},
    MetricEntry{
        "consensus_time",
        "s, from when (since the last agent joined) the ranges of all state components add up to the stop rule's disagreement (0.01)",
        consensus_time},
    MetricEntry{"error", "estimators: norm of all agents' final errors; error.<agent>, error.<agent>.<field> of one agent's", final_error},
    MetricEntry{"error_relative", "estimators: that, divided by the norm of what is estimated", relative_error},
    MetricEntry{"error_peak", "estimators: largest error of a component in the second half of the run", error_peak},
    MetricEntry{"rmse", "estimators: root mean square error of a component in the second half of the run; rmse.<agent> of one agent's",
                rmse},
    MetricEntry{"nees",
                "estimators with a covariance P: mean of e^T P^-1 e over agents and the second half (Bar-Shalom, Li, Kirubarajan 2001, "
                "5.4.2); n where P is true. With several runs nees_low, nees_high: 95 % bounds for one independent sample a run (n times "
                "runs degrees of freedom), wide for a mean over agents and time too: outside contradicts P, inside does not prove it",
                nees},
    MetricEntry{"P_trace", "agents with a covariance P or information Y that is recorded: mean of their final trace P_i, or trace Y_i^-1",
                covariance_held},
    MetricEntry{"control_peak", "agents that steer: largest component of a u_i in any reported round", control_effort},
    MetricEntry{"control_rms", "agents that steer: root mean square of |u_i| over agents and reported rounds", control_effort},
    MetricEntry{"gain_min", "smallest final coupling gain among the agents that hear somebody", gain_min},
    MetricEntry{"gain_mean", "mean of those", gain_mean},
    MetricEntry{"gain_max", "largest of those", gain_max},
    MetricEntry{"gain_peak", "largest such gain in any reported round", gain_peak},
    MetricEntry{"observer_error", "final |E| of all estimates of everybody, bar_i too; observer_error_relative: over that of the truth",
                observer_error},
    MetricEntry{"observer_error_peak", "largest |E| in the second half of the run", observer_error_peak},
    MetricEntry{"observer_bound", "what it stays below with others' inputs unknown, (19); observer_bound_stacked: all inputs at once",
                observer_bound},
    MetricEntry{"covariance", "sensor network: variances of each agent's stationary error, P of Knotek, thesis, (3.73)", covariance},
    MetricEntry{"covariance_trace", "sensor network: trace of that P, over all agents", covariance_trace},
    MetricEntry{"covariance_trace_sampled", "sensor network: the same with steps of dt", covariance_trace_sampled},
    MetricEntry{"covariance_trace_observed", "sensor network: that of the state groups each agent sees itself", covariance_trace_observed},
    MetricEntry{"local_covariance", "sensor network: variances of each sensor's own Kalman filter (3.29)", local_covariance},
    MetricEntry{"local_covariance_trace", "sensor network: their sum", local_covariance_trace},
    MetricEntry{"kalman_covariance", "sensor network: variances of one Kalman filter with all sensors", kalman_covariance},
    MetricEntry{"gain_norm", "sensor network: 2-norm of each agent's observer gain G_i", gain_norm},
    MetricEntry{"consensus_norm", "sensor network: 2-norm of gamma M_i^-1, each agent's consensus gain on what it sees", consensus_norm},
    MetricEntry{"error_abscissa", "sensor network: largest real part of an eigenvalue of the error matrix, 1/s", error_abscissa},
    MetricEntry{"error_variance", "sensor network: mean square of each agent's estimation error, second half of the run, and their sum",
                error_variance},
    MetricEntry{"network_sent", "real time: messages that in-neighbours and rounds ask for", network},
    MetricEntry{"network_lost", "real time: those that never came; the link model's losses are apart", network},
    MetricEntry{"network_late", "real time: those that came when their round was over", network},
    MetricEntry{"network_duplicated", "real time: messages that came again", network},
    MetricEntry{"network_reordered", "real time: messages that came after a later one", network},
    MetricEntry{"missed_deadlines", "real time: rounds that a process left out, over all processes", timing},
    MetricEntry{"missed_inputs", "real time: measurements and actuations that had not come in time", timing},
    MetricEntry{"jitter_p50", "real time: s, median lateness of a wake-up, of the process where it is largest", timing},
    MetricEntry{"jitter_p99", "real time: s, its 99th percentile", timing},
    MetricEntry{"jitter_max", "real time: s, the largest lateness", timing},
    MetricEntry{"cpu", "real time: s, processor time of all agents and the plant", timing},
    MetricEntry{"resident_bytes", "real time: resident memory of the largest process", timing},
    MetricEntry{"dds_deadlines_missed", "real time: missed deadlines as DDS counts them", timing},
    MetricEntry{"liveliness_lost", "real time: writers that DDS took for dead", timing},
    MetricEntry{"messages_sent", "messages emitted, one per out-neighbour and round", messages_sent},
    MetricEntry{"messages_delivered", "messages given to the algorithm", messages_delivered},
    MetricEntry{"messages_lost", "messages the links dropped", messages_lost},
    MetricEntry{"rounds", "rounds executed", rounds},
};

}  // namespace

void put(Metrics& out, const std::string& name, const Vector& value) {
  if (value.size() == 1) {
    out[name] = value[0];
    return;
  }
  for (Eigen::Index c = 0; c < value.size(); ++c) out[name + "[" + std::to_string(c) + "]"] = value[c];
}

std::span<const MetricEntry> metric_table() { return kTable; }

namespace {

bool anybody_in(const Trace& trace, std::size_t report) {
  const std::size_t width = trace.agents * trace.agreed_dimension();
  const auto values = trace.agreed_at(report);
  return width == 0 || std::any_of(values.begin(), values.end(), [](double value) { return !is_absent(value); });
}

/// Of the run, whoever is there at its end.
bool is_of_the_run(const MetricEntry& entry) { return entry.compute == network || entry.compute == timing || entry.compute == rounds; }

/// What is measured of agents is no number where nobody is left.
Metrics metrics_of_nobody(const Experiment& experiment, Seed run_seed, const ProtocolChoice& protocol, const Trace& trace) {
  Trace names = trace;  // as long as somebody was there
  while (!names.rounds.empty() && !anybody_in(names, names.rounds.size() - 1)) names.rounds.pop_back();
  names.estimates.resize(names.rounds.size() * names.agents * names.dimension);
  names.states.resize(names.rounds.size() * names.agents * names.state_dimension);
  names.only_names = true;
  Metrics out;
  if (!names.rounds.empty()) out = compute_metrics(experiment, run_seed, protocol, names);
  for (auto& [name, value] : out) {
    const auto entry = std::find_if(kTable.begin(), kTable.end(), [&name = name](const MetricEntry& each) { return each.name == name; });
    const bool counted = name.starts_with("messages_") || (entry != kTable.end() && is_of_the_run(*entry));
    if (!counted) value = std::numeric_limits<double>::quiet_NaN();
  }
  return out;
}

}  // namespace

Metrics compute_metrics(const Experiment& experiment, Seed run_seed, const ProtocolChoice& protocol, const Trace& trace) {
  check(!trace.rounds.empty(), "metrics are computed on a trace with at least one report");
  if (!anybody_in(trace, trace.rounds.size() - 1)) return metrics_of_nobody(experiment, run_seed, protocol, trace);
  Metrics out;
  if (experiment.metrics.empty()) {
    for (const MetricEntry& entry : kTable) entry.compute(experiment, run_seed, protocol, trace, out);
    return out;
  }
  for (const std::string& name : experiment.metrics) {
    const auto entry = std::find_if(kTable.begin(), kTable.end(), [&](const MetricEntry& e) { return e.name == name; });
    if (entry == kTable.end()) {
      std::vector<std::string_view> known;
      for (const MetricEntry& e : kTable) known.push_back(e.name);
      throw ConfigError(unknown_word("metric", name, known));
    }
    entry->compute(experiment, run_seed, protocol, trace, out);
  }
  return out;
}

Vector centralised_estimate(const Experiment& experiment, Seed run_seed) {
  // xbar = (sum_i P_i^-1)^-1 sum_i P_i^-1 x_i, with P_i = I where no P is given                                    (6)
  check(experiment.agents >= 1, "an experiment has agents");
  Matrix information;
  Vector weighted;
  for (std::size_t i = 0; i < experiment.agents; ++i) {
    const AgentId self = agent_at(i);
    const Values initial = experiment.initial_of(self, run_seed);
    if (!initial.has("x")) return {};
    const Vector x = initial.vector("x");
    if (i == 0) {
      information = Matrix::Zero(x.size(), x.size());
      weighted = Vector::Zero(x.size());
    }
    if (x.size() != weighted.size())
      throw ConfigError("agent " + std::to_string(self.value) + ": initial x has another dimension than that of agent 1");
    SpdInverse<Eigen::Dynamic> inverse(x.size(), {"centralised estimate", self, 0});
    const Matrix certainty = inverse(initial.covariance("P", x.size(), 1.0, true), "P_i(0)");
    information += certainty;
    weighted += certainty * x;
  }
  SpdInverse<Eigen::Dynamic> inverse(weighted.size(), {"centralised estimate", agent_at(0), 0});
  return inverse(information, "sum of P_i(0)^-1") * weighted;
}

}  // namespace consort
