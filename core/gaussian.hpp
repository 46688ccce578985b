#pragma once
/// Zero-mean normal vectors of a given covariance.

#include "core/random.hpp"
#include "core/types.hpp"

#include <span>

namespace consort {

class Gaussian {
 public:
  Gaussian() = default;  ///< adds nothing
  /// `covariance`: n x n, symmetric positive semidefinite (not checked: see expand_covariance()).
  explicit Gaussian(const Matrix& covariance);
  [[nodiscard]] bool zero() const { return deviations_.size() == 0 && factor_.size() == 0; }
  /// Adds one draw of N(0, covariance); `vector` has n entries. Nothing is drawn if the covariance is zero.
  void add(Stream stream, std::span<double> vector) const;

 private:
  Vector deviations_;  // diagonal covariance: its square root
  Matrix factor_;      // any other covariance: F with F F^T = covariance
};

}  // namespace consort
