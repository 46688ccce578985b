#include "core/metrics/steering.hpp"

#include <algorithm>
#include <limits>
#include <optional>

namespace consort {
namespace {

// The only agent that never hears anybody, where others may follow it.
std::optional<AgentId> leader_of(const Experiment& experiment, Seed seed) {
  if (experiment.agents < 2) return std::nullopt;
  const auto support = experiment.schedule(seed).support(experiment.rounds);
  std::optional<AgentId> leader;
  for (std::size_t i = 0; i < experiment.agents; ++i) {
    if (support->in_degree(agent_at(i)) > 0) continue;
    if (leader) return std::nullopt;
    leader = agent_at(i);
  }
  return leader;
}

double sum_of_ranges(const Trace& trace, std::size_t report) {
  const auto rows = static_cast<Eigen::Index>(trace.agreed_dimension());
  const Eigen::Map<const Matrix> values(trace.agreed_at(report).data(), rows, static_cast<Eigen::Index>(trace.agents));
  double sum = 0.0;
  for (Eigen::Index c = 0; c < rows; ++c) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const double value : values.row(c)) {
      if (is_absent(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
    sum += std::max(0.0, high - low);
  }
  return sum;
}

}  // namespace

void distance_from_leader(const Experiment& experiment, Seed seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  const auto leader = leader_of(experiment, seed);
  if (!leader) return;
  const auto first = static_cast<Eigen::Index>(index_of(*leader));
  const Eigen::Map<const Matrix> end(trace.agreed_at(trace.rounds.size() - 1).data(), static_cast<Eigen::Index>(trace.agreed_dimension()),
                                     static_cast<Eigen::Index>(trace.agents));
  double largest = 0.0;
  for (Eigen::Index i = 0; i < end.cols(); ++i)
    if (!is_absent(end(0, i))) largest = std::max(largest, (end.col(i) - end.col(first)).norm());
  out["leader_error"] = largest;
}
void distance_from_leader_name(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (leader_of(run.experiment, run.experiment.seed)) out.emplace(name);
}

void leader_error(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace& trace, Metrics& out) {
  if (trace.agrees_on_states) distance_from_leader(experiment, seed, choice, trace, out);
}
void leader_error_name(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (run.trace.agrees_on_states) distance_from_leader_name(name, run, out);
}

void coherence(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  if (!trace.agrees_on_states) return;
  double sum = 0.0;
  const std::size_t half = trace.rounds.size() / 2;
  for (std::size_t report = half; report < trace.rounds.size(); ++report) {
    const Eigen::Map<const Matrix> all(trace.agreed_at(report).data(), static_cast<Eigen::Index>(trace.agreed_dimension()),
                                       static_cast<Eigen::Index>(trace.agents));
    std::vector<Eigen::Index> present;
    for (Eigen::Index i = 0; i < all.cols(); ++i)
      if (!is_absent(all(0, i))) present.push_back(i);
    const Matrix states = all(Eigen::all, present);
    if (states.cols() > 0) sum += (states.colwise() - states.rowwise().mean()).squaredNorm();
  }
  out["coherence"] = sum / static_cast<double>(trace.rounds.size() - half);
}

void consensus_time(const Experiment& experiment, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  if (!trace.agrees_on_states) return;
  const double threshold = experiment.convergence ? experiment.convergence->within : 0.01;
  Round complete = 0;  // the round from which everybody is there
  for (const auto& [agent, presence] : experiment.presence) complete = std::max(complete, presence.stays().back().from);
  double first = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t report = trace.rounds.size(); report-- > 0 && trace.rounds[report] >= complete;) {
    if (sum_of_ranges(trace, report) > threshold) break;
    first = (trace.rounds[report] - complete) * experiment.dt;
  }
  out["consensus_time"] = first;
}

void steering_name(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (run.trace.agrees_on_states) out.emplace(name);
}

}  // namespace consort
