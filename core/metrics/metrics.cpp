#include "core/metrics/metrics.hpp"

#include "core/errors.hpp"
#include "core/math/spd.hpp"
#include "core/metrics/estimation.hpp"
#include "core/metrics/realtime.hpp"
#include "core/metrics/state.hpp"
#include "core/metrics/steering.hpp"
#include "core/stop.hpp"

#include <algorithm>
#include <array>
#include <limits>

namespace consort {
namespace {

// What the agents agree on at the end (final estimates, or final states where they steer the plant), one column per agent that is there.
Matrix final_values(const Trace& trace) {
  const auto rows = static_cast<Eigen::Index>(trace.agreed_dimension());
  const Eigen::Map<const Matrix> all(trace.agreed_at(trace.rounds.size() - 1).data(), rows, static_cast<Eigen::Index>(trace.agents));
  std::vector<Eigen::Index> present;
  for (Eigen::Index i = 0; i < all.cols(); ++i)
    if (!is_absent(all(0, i))) present.push_back(i);
  return all(Eigen::all, present);
}

// Estimators do not agree on a value of their own.
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

void agreed_names(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (agrees(run.trace)) put_names(out, name, run.trace.agreed_dimension());
}
void centralised_names(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (run.trace.agrees_on_states || !agrees(run.trace)) return;
  put_names(out, name, static_cast<std::size_t>(centralised_estimate(run.experiment, run.experiment.seed).size()));
}
void agreement_name(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (agrees(run.trace)) out.emplace(name);
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
    MetricEntry{"consensus_value", "mean of the final estimates", consensus_value, agreed_names},
    MetricEntry{"centralised_value", "estimate of one who knows all initial values (Alighanbari, How 2006, (6)); their mean without P",
                centralised_value, centralised_names},
    MetricEntry{"bias", "consensus_value - centralised_value", bias, centralised_names},
    MetricEntry{"disagreement", "largest distance between two agents' final estimates", final_disagreement, agreement_name},
    MetricEntry{"spread", "largest minus smallest final estimate, per component", spread, agreed_names},
    MetricEntry{"rounds_to_convergence",
                "first reported round from which the disagreement (of estimators: the error) stays within the stop rule's (1e-3 without "
                "one); NaN: never. Over several runs the mean of those that converged; rounds_to_convergence.share: their share",
                rounds_to_convergence, its_name},
    MetricEntry{"leader_error", "largest final distance from the leader, the only agent that never hears anybody", leader_error,
                leader_error_name},
    MetricEntry{"coherence", "sum over agents of squared distances from the mean state, second half of the run (Zamani et al. 2014, (31))",
                coherence, steering_name},
    MetricEntry{
        "consensus_time",
        "s, from when (since the last agent joined) the ranges of all state components add up to the stop rule's disagreement (0.01)",
        consensus_time, steering_name},
    MetricEntry{"error", "estimators: norm of all agents' final errors; error.<agent>, error.<agent>.<field> of one agent's", final_error,
                error_names},
    MetricEntry{"error_relative", "estimators: that, divided by the norm of what is estimated", relative_error, estimators_name},
    MetricEntry{"error_peak", "estimators: largest error of a component in the second half of the run", error_peak, estimators_name},
    MetricEntry{"rmse", "estimators: root mean square error of a component in the second half of the run; rmse.<agent> of one agent's",
                rmse, rmse_names},
    MetricEntry{"nees",
                "estimators with a covariance P: mean of e^T P^-1 e over agents and the second half (Bar-Shalom, Li, Kirubarajan 2001, "
                "5.4.2); n where P is true. With several runs nees_low, nees_high: 95 % bounds for one independent sample a run (n times "
                "runs degrees of freedom), wide for a mean over agents and time too: outside contradicts P, inside does not prove it",
                nees, nees_names},
    MetricEntry{"P_trace", "agents with a covariance P or information Y that is recorded: mean of their final trace P_i, or trace Y_i^-1",
                covariance_held, covariance_name},
    MetricEntry{"control_peak", "agents that steer: largest component of a u_i in any reported round", control_effort, control_names},
    MetricEntry{"control_rms", "agents that steer: root mean square of |u_i| over agents and reported rounds", control_effort,
                control_names},
    MetricEntry{"network_sent", "real time: messages that in-neighbours and rounds ask for", network, network_names, true},
    MetricEntry{"network_lost", "real time: those that never came; the link model's losses are apart", network, network_names, true},
    MetricEntry{"network_late", "real time: those that came when their round was over", network, network_names, true},
    MetricEntry{"network_duplicated", "real time: messages that came again", network, network_names, true},
    MetricEntry{"network_reordered", "real time: messages that came after a later one", network, network_names, true},
    MetricEntry{"missed_deadlines", "real time: rounds that a process left out, over all processes", timing, timing_names, true},
    MetricEntry{"missed_inputs", "real time: measurements and actuations that had not come in time", timing, timing_names, true},
    MetricEntry{"jitter_p50", "real time: s, median lateness of a wake-up, of the process where it is largest", timing, timing_names, true},
    MetricEntry{"jitter_p99", "real time: s, its 99th percentile", timing, timing_names, true},
    MetricEntry{"jitter_max", "real time: s, the largest lateness", timing, timing_names, true},
    MetricEntry{"cpu", "real time: s, processor time of all agents and the plant", timing, timing_names, true},
    MetricEntry{"resident_bytes", "real time: resident memory of the largest process", timing, timing_names, true},
    MetricEntry{"dds_deadlines_missed", "real time: missed deadlines as DDS counts them", timing, timing_names, true},
    MetricEntry{"liveliness_lost", "real time: writers that DDS took for dead", timing, timing_names, true},
    MetricEntry{"messages_sent", "messages emitted, one per out-neighbour and round", messages_sent, its_name, true},
    MetricEntry{"messages_delivered", "messages given to the algorithm", messages_delivered, its_name, true},
    MetricEntry{"messages_lost", "messages the links dropped", messages_lost, its_name, true},
    MetricEntry{"rounds", "rounds executed", rounds, its_name, true},
};

}  // namespace

void put(Metrics& out, const std::string& name, const Vector& value) {
  if (value.size() == 1) {
    out[name] = value[0];
    return;
  }
  for (Eigen::Index c = 0; c < value.size(); ++c) out[name + "[" + std::to_string(c) + "]"] = value[c];
}

void put_names(MetricNames& out, std::string_view name, std::size_t size) {
  if (size == 1) out.emplace(name);
  for (std::size_t c = 0; size > 1 && c < size; ++c) out.insert(std::string(name) + "[" + std::to_string(c) + "]");
}

std::string of_agent(std::string_view name, AgentId agent) { return std::string(name) + "." + std::to_string(agent.value); }

bool PlannedRun::there_at_end(AgentId agent) const {
  Round end = 0;  // the latest round in which anybody is there
  for (const auto& [other, presence] : experiment.presence) end = std::max(end, presence.stays().back().until - 1);
  end = experiment.presence.size() < experiment.agents ? experiment.rounds : std::min(end, experiment.rounds);
  return experiment.presence_of(agent).holds(end);
}

bool PlannedRun::there_late(AgentId agent) const {
  const std::vector<Attendance> stays = experiment.presence_of(agent).stays();
  return std::any_of(stays.begin(), stays.end(), [this](const Attendance& stay) {
    return stay.from <= experiment.rounds && 2 * std::uint64_t{stay.until} > experiment.rounds;
  });
}

void its_name(std::string_view name, const PlannedRun&, MetricNames& out) { out.emplace(name); }

std::span<const MetricEntry> run_metrics() { return kTable; }

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
