#include "core/stop.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace consort {

namespace {

/// On the line the largest distance is the range; no pairs are needed.
double range_of(std::span<const double> values) {
  const auto [smallest, largest] = std::minmax_element(values.begin(), values.end());
  return *largest - *smallest;
}

double squared_distance(const double* a, const double* b, std::size_t dimension) {
  double sum = 0.0;
  for (std::size_t c = 0; c < dimension; ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
  return sum;
}

}  // namespace

double disagreement(std::span<const double> estimates, std::size_t agents, std::size_t dimension) {
  check(estimates.size() == agents * dimension, "disagreement needs agents x dimension estimates");
  if (agents < 2 || dimension == 0) return 0.0;
  // A comparison with a number that is not one is false, and would hide it.
  if (std::any_of(estimates.begin(), estimates.end(), [](double value) { return std::isnan(value); }))
    return std::numeric_limits<double>::quiet_NaN();
  if (dimension == 1) return range_of(estimates);
  double largest = 0.0;
  for (std::size_t i = 1; i < agents; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      largest = std::max(largest, squared_distance(&estimates[i * dimension], &estimates[j * dimension], dimension));
    }
  }
  return std::sqrt(largest);
}

bool StopRule::ends(const RoundReport& report, std::size_t agents, std::size_t dimension) {
  if (convergence_ && !converged_) {
    if (disagreement(report.estimates, agents, dimension) <= convergence_->disagreement) {
      if (!below_since_) below_since_ = report.k;
      // The first report below counts as one round.
      converged_ = std::uint64_t{report.k} - *below_since_ + 1 >= convergence_->for_rounds;
    } else {
      below_since_.reset();
    }
  }
  return converged_ || report.k >= rounds_;
}

}  // namespace consort
