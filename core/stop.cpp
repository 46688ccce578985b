#include "core/stop.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <vector>

namespace consort {

namespace {

// On the line the largest distance is the range; no pairs are needed.
double range_of(std::span<const double> values) {
  const auto [smallest, largest] = std::minmax_element(values.begin(), values.end());
  return *largest - *smallest;
}

double squared_distance(const double* a, const double* b, std::size_t dimension) {
  double sum = 0.0;
  for (std::size_t c = 0; c < dimension; ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
  return sum;
}

// Calls use(j, offset) for every agent j whose part agent i estimates, with the place of that estimate among the numbers of i.
template <class Use>
void for_each_slot(const Trace& trace, std::size_t i, Use&& use) {
  if (trace.truth == Truth::state) use(i, std::size_t{0});
  for (std::size_t j = 0; trace.truth == Truth::everybody && j < trace.agents; ++j) use(j, j * trace.state_dimension);
}

}  // namespace

double squared_error(std::span<const double> estimate, std::span<const double> state) {
  double sum = 0.0;
  for (std::size_t c = 0; c < state.size(); ++c) {
    if (is_absent(state[c])) continue;
    const double error = is_absent(estimate[c]) ? state[c] : estimate[c] - state[c];
    sum += error * error;
  }
  return sum;
}

double disagreement(std::span<const double> estimates, std::size_t agents, std::size_t dimension) {
  check(estimates.size() == agents * dimension, "disagreement needs agents x dimension estimates");
  if (agents == 0 || dimension == 0) return 0.0;
  // A comparison with a number that is not one is false, and would hide it.
  if (std::any_of(estimates.begin(), estimates.end(), [](double value) { return std::isnan(value); })) {
    std::vector<double> present;
    std::copy_if(estimates.begin(), estimates.end(), std::back_inserter(present), [](double value) { return !is_absent(value); });
    if (present.empty() || present.size() == estimates.size()) return std::numeric_limits<double>::quiet_NaN();
    return disagreement(present, present.size() / dimension, dimension);
  }
  if (agents < 2) return 0.0;
  if (dimension == 1) return range_of(estimates);
  double largest = 0.0;
  for (std::size_t i = 1; i < agents; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      largest = std::max(largest, squared_distance(&estimates[i * dimension], &estimates[j * dimension], dimension));
    }
  }
  return std::sqrt(largest);
}

double estimation_error(const Trace& trace, const RoundReport& report) {
  const auto state_of = [&](std::size_t j) { return report.states.subspan(j * trace.state_dimension, trace.state_dimension); };
  double sum = 0.0;
  bool anybody = false;
  for (std::size_t i = 0; i < trace.agents; ++i) {
    if (is_absent(state_of(i).front())) continue;  // the agent is not there
    anybody = true;
    for_each_slot(trace, i, [&](std::size_t j, std::size_t offset) {
      sum += squared_error(report.estimates.subspan(i * trace.dimension + offset, trace.state_dimension), state_of(j));
    });
  }
  return anybody ? std::sqrt(sum) : std::numeric_limits<double>::quiet_NaN();
}

double deviation(const Trace& trace, const RoundReport& report) {
  return trace.truth == Truth::none ? disagreement(trace.agreed(report), trace.agents, trace.agreed_dimension())
                                    : estimation_error(trace, report);
}

bool StopRule::ends(Round k, const std::function<double()>& deviation) {
  if (convergence_ && !converged_) {
    if (deviation() <= convergence_->within) {
      if (!below_since_) below_since_ = k;
      // The first report below counts as one round.
      converged_ = std::uint64_t{k} - *below_since_ + 1 >= convergence_->for_rounds;
    } else {
      below_since_.reset();
    }
  }
  return converged_ || k >= rounds_;
}

}  // namespace consort
