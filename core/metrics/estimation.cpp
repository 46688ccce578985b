#include "core/metrics/estimation.hpp"

#include "core/math/spd.hpp"
#include "core/stop.hpp"

#include <boost/math/distributions/chi_squared.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace consort {
namespace {

constexpr std::size_t kNamedAgents = 50;

// What one agent estimates of one part, and that part.
struct Slot {
  std::size_t part;  // index of the agent whose part it is
  std::span<const double> estimate, state;
};

// Every part that agent i has to estimate in one report; none if it is not there.
std::vector<Slot> slots_of(const Trace& trace, const RoundReport& report, std::size_t i) {
  const std::size_t width = trace.state_dimension;
  const auto state_of = [&](std::size_t j) { return report.states.subspan(j * width, width); };
  std::vector<Slot> slots;
  if (trace.truth == Truth::none || is_absent(state_of(i).front())) return slots;
  const std::span<const double> estimate = report.estimates.subspan(i * trace.dimension, trace.dimension);
  if (trace.truth == Truth::state) return {{i, estimate.first(width), state_of(i)}};
  for (std::size_t j = 0; j < trace.agents; ++j) slots.push_back({j, estimate.subspan(j * width, width), state_of(j)});
  return slots;
}

// Calls use(component, error, truth) for every number that is there to be estimated.
template <class Use>
void for_each_error(const Slot& slot, Use&& use) {
  for (std::size_t c = 0; c < slot.state.size(); ++c) {
    if (is_absent(slot.state[c])) continue;
    use(c, is_absent(slot.estimate[c]) ? -slot.state[c] : slot.estimate[c] - slot.state[c], slot.state[c]);
  }
}

// The reports of the second half of the run.
template <class Use>
void for_each_late_report(const Trace& trace, Use&& use) {
  for (std::size_t r = 0; r < trace.rounds.size(); ++r)
    if (2 * std::uint64_t{trace.rounds[r]} >= trace.last_round) use(trace.report(r));
}

RoundReport last_report(const Trace& trace) { return trace.report(trace.rounds.size() - 1); }

// Where in an estimate of the plant's state its covariance P begins.
std::optional<std::size_t> covariance_at(const Trace& trace) {
  if (trace.truth != Truth::state) return std::nullopt;
  const std::size_t n = trace.state_dimension;
  std::size_t at = 0;
  for (const Field& field : trace.estimate_layout.fields) {
    if (field.name == "P" && field.rows == n && field.cols == n) return at;
    at += field.size();
  }
  return std::nullopt;
}

// Errors of agent i per field of the plant's state.
void errors_by_field(const Trace& trace, const Slot& slot, std::size_t i, Metrics& out) {
  std::size_t at = 0;
  for (const Field& field : trace.state_layout.fields) {
    double sum = 0.0;
    for_each_error(slot, [&](std::size_t c, double error, double) { sum += c >= at && c < at + field.size() ? error * error : 0.0; });
    out[of_agent("error", agent_at(i)) + "." + field.name] = std::sqrt(sum);
    at += field.size();
  }
}

}  // namespace

void final_error(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  if (trace.truth == Truth::none) return;
  const RoundReport report = last_report(trace);
  out["error"] = estimation_error(trace, report);
  for (std::size_t i = 0; i < std::min(trace.agents, kNamedAgents); ++i) {
    const auto slots = slots_of(trace, report, i);
    if (slots.empty()) continue;
    double sum = 0.0;
    for (const Slot& slot : slots) for_each_error(slot, [&](std::size_t, double error, double) { sum += error * error; });
    out[of_agent("error", agent_at(i))] = std::sqrt(sum);
    if (trace.truth == Truth::state && trace.state_layout.fields.size() > 1) errors_by_field(trace, slots.front(), i, out);
  }
}

void relative_error(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  if (trace.truth == Truth::none) return;
  const RoundReport report = last_report(trace);
  double errors = 0.0, truths = 0.0;
  for (std::size_t i = 0; i < trace.agents; ++i) {
    for (const Slot& slot : slots_of(trace, report, i)) {
      for_each_error(slot, [&](std::size_t, double error, double truth) {
        errors += error * error;
        truths += truth * truth;
      });
    }
  }
  out["error_relative"] = std::sqrt(errors / truths);
}

void error_peak(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  if (trace.truth == Truth::none) return;
  double peak = 0.0;
  for_each_late_report(trace, [&](const RoundReport& report) {
    for (std::size_t i = 0; i < trace.agents; ++i)
      for (const Slot& slot : slots_of(trace, report, i))
        for_each_error(slot, [&](std::size_t, double error, double) { peak = std::max(peak, std::abs(error)); });
  });
  out["error_peak"] = peak;
}

void rmse(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  if (trace.truth == Truth::none) return;
  std::vector<double> sums(trace.agents), counts(trace.agents);
  for_each_late_report(trace, [&](const RoundReport& report) {
    for (std::size_t i = 0; i < trace.agents; ++i) {
      for (const Slot& slot : slots_of(trace, report, i)) {
        for_each_error(slot, [&](std::size_t, double error, double) {
          sums[i] += error * error;
          counts[i] += 1.0;
        });
      }
    }
  });
  double sum = 0.0, count = 0.0;
  for (std::size_t i = 0; i < trace.agents; ++i) {
    sum += sums[i];
    count += counts[i];
    if (i < kNamedAgents && counts[i] > 0.0) out[of_agent("rmse", agent_at(i))] = std::sqrt(sums[i] / counts[i]);
  }
  out["rmse"] = std::sqrt(sum / count);
}

void estimators_name(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (run.trace.truth != Truth::none) out.emplace(name);
}

void error_names(std::string_view name, const PlannedRun& run, MetricNames& out) {
  estimators_name(name, run, out);
  if (run.trace.truth == Truth::none) return;
  const auto& fields = run.trace.state_layout.fields;
  for (std::size_t i = 0; i < std::min(run.trace.agents, kNamedAgents); ++i) {
    if (!run.there_at_end(agent_at(i))) continue;
    const std::string own = of_agent(name, agent_at(i));
    out.insert(own);
    if (run.trace.truth == Truth::state && fields.size() > 1)
      for (const Field& field : fields) out.insert(own + "." + field.name);
  }
}

void rmse_names(std::string_view name, const PlannedRun& run, MetricNames& out) {
  estimators_name(name, run, out);
  for (std::size_t i = 0; run.trace.truth != Truth::none && i < std::min(run.trace.agents, kNamedAgents); ++i)
    if (run.there_late(agent_at(i))) out.insert(of_agent(name, agent_at(i)));
}

void nees_names(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (!covariance_at(run.trace)) return;
  out.emplace(name);
  if (run.experiment.runs < 2) return;
  for (const char* bound : {"_low", "_high"}) out.insert(std::string(name) + bound);
}

void nees(const Experiment& experiment, Seed, const ProtocolChoice& protocol, const Trace& trace, Metrics& out) {
  const auto at = covariance_at(trace);
  if (!at) return;
  const std::size_t n = trace.state_dimension;
  const auto size = static_cast<Eigen::Index>(n);
  const std::string whose = "nees of " + protocol.name;
  constexpr double kLeastVariance = 1e-290;  // without process noise P may vanish
  double sum = 0.0, count = 0.0;
  for_each_late_report(trace, [&](const RoundReport& report) {
    for (std::size_t i = 0; i < trace.agents; ++i) {
      const auto slots = slots_of(trace, report, i);
      if (slots.empty()) continue;
      Vector error = Vector::Zero(size);
      for_each_error(slots.front(), [&](std::size_t c, double value, double) { error[static_cast<Eigen::Index>(c)] = value; });
      const Matrix claimed = Eigen::Map<const Matrix>(report.estimates.data() + i * trace.dimension + *at, size, size);
      if (const double least = claimed.diagonal().minCoeff(); least >= 0.0 && least < kLeastVariance) {
        sum = std::numeric_limits<double>::quiet_NaN();  // what is left of P says nothing
        continue;
      }
      const Eigen::LLT<Matrix> factor(claimed);
      if (factor.info() != Eigen::Success) refuse_matrix({whose, agent_at(i), report.k}, "P", claimed);
      // e^T P^-1 e
      sum += factor.matrixL().solve(error).squaredNorm();
      count += 1.0;
    }
  });
  out["nees"] = sum / count;
  if (experiment.runs < 2) return;  // bounds for one sample say next to nothing
  const double runs = static_cast<double>(experiment.runs);
  const boost::math::chi_squared distribution(static_cast<double>(n) * runs);
  out["nees_low"] = boost::math::quantile(distribution, 0.025) / runs;
  out["nees_high"] = boost::math::quantile(distribution, 0.975) / runs;
}

}  // namespace consort
