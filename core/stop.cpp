#include "core/stop.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <vector>

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
  if (std::any_of(estimates.begin(), estimates.end(), [](double value) { return std::isnan(value); })) {
    std::vector<double> present;
    std::copy_if(estimates.begin(), estimates.end(), std::back_inserter(present), [](double value) { return !is_absent(value); });
    if (present.size() == estimates.size()) return std::numeric_limits<double>::quiet_NaN();
    return disagreement(present, present.size() / dimension, dimension);
  }
  if (dimension == 1) return range_of(estimates);
  double largest = 0.0;
  for (std::size_t i = 1; i < agents; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      largest = std::max(largest, squared_distance(&estimates[i * dimension], &estimates[j * dimension], dimension));
    }
  }
  return std::sqrt(largest);
}

bool StopRule::ends(Round k, std::span<const double> agreed, std::size_t agents, std::size_t dimension) {
  if (convergence_ && !converged_) {
    if (disagreement(agreed, agents, dimension) <= convergence_->disagreement) {
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
