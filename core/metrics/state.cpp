#include "core/metrics/state.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace consort {

void covariance_held(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  auto place = trace.place_of("P");
  const bool information = !place;
  if (information) place = trace.place_of("Y");
  if (!place || place->field.rows != place->field.cols) return;
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

}  // namespace consort
