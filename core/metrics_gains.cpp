#include "core/metrics_gains.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace consort {
namespace {

/// Where a recorded number lies among an agent's; of the first of `names` that is recorded.
std::optional<std::size_t> place_of(const Layout& layout, std::initializer_list<std::string_view> names) {
  for (const std::string_view name : names) {
    std::size_t at = 0;
    for (const Field& field : layout.fields) {
      if (field.name == name && field.size() == 1) return at;
      at += field.size();
    }
  }
  return std::nullopt;
}

/// Whether each agent may ever hear somebody: the gain of one that does not (a leader) means nothing.
std::vector<char> hearing(const Experiment& experiment, Seed seed) {
  const Graph support = experiment.schedule(seed).support(experiment.rounds);
  std::vector<char> hears;
  for (std::size_t i = 0; i < experiment.agents; ++i) hears.push_back(support.in_degree(agent_at(i)) > 0 ? 1 : 0);
  return hears;
}

/// One recorded number of the agents that hear somebody and are there.
std::vector<double> gains_at(const Trace& trace, std::size_t report, std::size_t place, const std::vector<char>& hears) {
  std::vector<double> gains;
  for (std::size_t i = 0; i < trace.agents; ++i) {
    const double gain = trace.at(report, agent_at(i))[place];
    if (hears[i] != 0 && !is_absent(gain)) gains.push_back(gain);
  }
  return gains;
}

/// Final values of the number that `names` say; empty where it is not recorded.
std::vector<double> final_gains(const Experiment& experiment, Seed seed, const Trace& trace,
                                std::initializer_list<std::string_view> names) {
  const auto place = place_of(trace.estimate_layout, names);
  if (!place) return {};
  return gains_at(trace, trace.rounds.size() - 1, *place, hearing(experiment, seed));
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

void gain_min(const Experiment& experiment, Seed seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  const auto gains = final_gains(experiment, seed, trace, {"c_min", "c"});
  if (!gains.empty()) out["gain_min"] = *std::min_element(gains.begin(), gains.end());
}

void gain_mean(const Experiment& experiment, Seed seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  const auto gains = final_gains(experiment, seed, trace, {"c_mean", "c"});
  if (gains.empty()) return;
  out["gain_mean"] = Eigen::Map<const Vector>(gains.data(), static_cast<Eigen::Index>(gains.size())).mean();
}

void gain_max(const Experiment& experiment, Seed seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  const auto gains = final_gains(experiment, seed, trace, {"c_max", "c"});
  if (!gains.empty()) out["gain_max"] = *std::max_element(gains.begin(), gains.end());
}

void gain_peak(const Experiment& experiment, Seed seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  const auto place = place_of(trace.estimate_layout, {"c_max", "c"});
  if (!place) return;
  const std::vector<char> hears = hearing(experiment, seed);
  double peak = -std::numeric_limits<double>::infinity();
  for (std::size_t report = 0; report < trace.rounds.size(); ++report)
    for (const double gain : gains_at(trace, report, *place, hears)) peak = std::max(peak, gain);
  if (std::isfinite(peak)) out["gain_peak"] = peak;
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

}  // namespace consort
