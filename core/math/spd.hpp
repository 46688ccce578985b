#pragma once
/// Inverses of symmetric positive definite matrices (covariances, information matrices) that refuse to return nonsense.

#include "core/types.hpp"

#include <limits>
#include <string_view>

namespace consort {

/// Where a numerical failure happened; only its text is used.
struct Place {
  std::string_view algorithm;
  AgentId agent;
  Round k = 0;
};

/// Throws RunError: names place, matrix, size and condition.
[[noreturn]] void refuse_matrix(const Place& place, std::string_view matrix, const Matrix& value);

/// Inverts matrices of one size through LLT. Holds its workspace, so a loop over messages allocates nothing, whatever the size. Compiled in
/// spd.cpp for the sizes that protocols are compiled for.
template <int N>
class SpdInverse {
 public:
  using Result = Eigen::Matrix<double, N, N>;

  SpdInverse(Eigen::Index n, const Place& place) : place_(place), factor_(n), inverse_(n, n), lower_(n, n) {}

  /// The inverse of `a` (n x n, symmetric), exactly symmetric; valid until the next call. `name` stands for it in messages.
  /// Throws RunError if a pivot of LLT falls below 1e-14 of its diagonal entry (a test that units of the components cannot
  /// fool) or below the smallest normal number.
  template <class Derived>
  const Result& operator()(const Eigen::MatrixBase<Derived>& a, std::string_view name) {
    lower_ = a.derived();
    invert(name);
    return inverse_;
  }

 private:
  /// What is in lower_.
  void invert(std::string_view name);

  Place place_;
  Eigen::LLT<Result> factor_;
  Result inverse_, lower_;
};

/// One number: a reciprocal.
template <>
class SpdInverse<1> {
 public:
  using Result = Eigen::Matrix<double, 1, 1>;

  SpdInverse(Eigen::Index, const Place& place) : place_(place) {}

  /// Throws RunError if `a` is not a positive normal number.
  template <class Derived>
  Result operator()(const Eigen::MatrixBase<Derived>& a, std::string_view name) const {
    const double value = a.derived().coeff(0, 0);
    if (!(value >= std::numeric_limits<double>::min() && value <= std::numeric_limits<double>::max()))
      refuse_matrix(place_, name, Matrix::Constant(1, 1, value));
    return Result(1.0 / value);
  }

 private:
  Place place_;
};

}  // namespace consort
