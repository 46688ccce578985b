#include "core/metrics/state.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace consort {

namespace {

// What an agent records of its certainty: a covariance P or an information Y.
std::optional<Trace::Place> certainty(const Trace& trace) {
  auto place = trace.place_of("P");
  if (!place) place = trace.place_of("Y");
  return place && place->field.rows == place->field.cols ? place : std::nullopt;
}

}  // namespace

void covariance_held(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  const auto place = certainty(trace);
  if (!place) return;
  const bool information = place->field.name == "Y";
  const auto n = static_cast<Eigen::Index>(place->field.rows);
  double sum = 0.0, count = 0.0;
  for (std::size_t i = 0; i < trace.agents; ++i) {
    const auto numbers = trace.numbers(*place, trace.rounds.size() - 1, agent_at(i));
    if (std::any_of(numbers.begin(), numbers.end(), is_absent)) continue;
    const Eigen::Map<const Matrix> held(numbers.data(), n, n);
    count += 1.0;
    if (!information) {
      sum += held.trace();
      continue;
    }
    const Eigen::LLT<Matrix> factor(held);
    const bool good = factor.info() == Eigen::Success;
    sum += good ? factor.solve(Matrix::Identity(n, n)).trace() : std::numeric_limits<double>::quiet_NaN();
  }
  if (count > 0.0) out["P_trace"] = sum / count;
}

void control_effort(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  const auto place = trace.place_of("u");
  if (!place) return;
  double peak = 0.0, squares = 0.0, count = 0.0;
  for (std::size_t report = 0; report < trace.rounds.size(); ++report) {
    if (trace.rounds[report] == 0) continue;  // nobody has steered yet
    for (std::size_t i = 0; i < trace.agents; ++i) {
      const auto u = trace.numbers(*place, report, agent_at(i));
      if (std::all_of(u.begin(), u.end(), is_absent)) continue;
      for (const double value : u) {
        if (is_absent(value)) continue;  // this agent's u is shorter than another's
        peak = std::max(peak, std::abs(value));
        squares += value * value;
      }
      count += 1.0;
    }
  }
  out["control_peak"] = peak;
  out["control_rms"] = count > 0.0 ? std::sqrt(squares / count) : 0.0;
}

void covariance_name(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (certainty(run.trace)) out.emplace(name);
}

void control_names(std::string_view, const PlannedRun& run, MetricNames& out) {
  if (run.trace.place_of("u")) out.insert({"control_peak", "control_rms"});
}

}  // namespace consort
