#pragma once
/// What several numbers come to: mean, how well it is known, and how they lie.

#include <cstddef>
#include <span>

namespace consort {

/// NaN where there are too few numbers.
struct Spread {
  std::size_t count = 0;
  double mean, deviation;             ///< sample standard deviation
  double low, high;                   ///< 95 % confidence interval of the mean, by Student's t
  double q05, q25, median, q75, q95;  ///< between two numbers: on the line that joins them
};

Spread spread_of(std::span<const double> numbers);

/// The t that Student's distribution with `freedom` degrees of freedom exceeds, to either side together, with probability 0.05.
double student_t95(std::size_t freedom);

}  // namespace consort
