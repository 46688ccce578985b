#pragma once
/// The normalised estimation error squared of one estimate, and where it should lie (Bar-Shalom, Li, Kirubarajan 2001, 5.4.2). Pure.

#include <cstddef>
#include <span>
#include <utility>

namespace consort {

/// e^T P^-1 e; `error` has n numbers, `covariance` n x n, column-major. NaN where P is not positive definite or a variance has vanished
/// (below 1e-290).
double nees(std::span<const double> error, std::span<const double> covariance);

/// The 2.5 % and the 97.5 % quantile of what a single sample is distributed by, chi-square with n degrees of freedom.
std::pair<double, double> nees_band(std::size_t n);

}  // namespace consort
