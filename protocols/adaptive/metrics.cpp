#include "protocols/adaptive/metrics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace consort {
namespace {

// Where a recorded number lies among an agent's; of the first of `names` that is recorded.
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

// Whether each agent may ever hear somebody: the gain of one that does not (a leader) means nothing.
std::vector<char> hearing(const Experiment& experiment, Seed seed) {
  const auto support = experiment.schedule(seed).support(experiment.rounds);
  std::vector<char> hears;
  for (std::size_t i = 0; i < experiment.agents; ++i) hears.push_back(support->in_degree(agent_at(i)) > 0 ? 1 : 0);
  return hears;
}

// One recorded number of the agents that hear somebody and are there.
std::vector<double> gains_at(const Trace& trace, std::size_t report, std::size_t place, const std::vector<char>& hears) {
  std::vector<double> gains;
  for (std::size_t i = 0; i < trace.agents; ++i) {
    const double gain = trace.at(report, agent_at(i))[place];
    if (hears[i] != 0 && !is_absent(gain)) gains.push_back(gain);
  }
  return gains;
}

// Final values of the number that `names` say; empty where it is not recorded.
std::vector<double> final_gains(const Experiment& experiment, Seed seed, const Trace& trace,
                                std::initializer_list<std::string_view> names) {
  const auto place = place_of(trace.estimate_layout, names);
  if (!place) return {};
  return gains_at(trace, trace.rounds.size() - 1, *place, hearing(experiment, seed));
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

void gain_name(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (!place_of(run.trace.estimate_layout, {"c_min", "c"})) return;
  const std::vector<char> hears = hearing(run.experiment, run.experiment.seed);
  for (std::size_t i = 0; i < hears.size(); ++i)
    if (hears[i] != 0 && run.there_at_end(agent_at(i))) out.emplace(name);
}

}  // namespace consort
