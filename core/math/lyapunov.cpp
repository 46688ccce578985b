#include "core/math/lyapunov.hpp"

#include "core/errors.hpp"
#include "core/math/schur.hpp"
#include "core/math/shapes.hpp"

#include <limits>

namespace consort {

namespace {

constexpr double kLargestError = 1e-3;

struct Pair {
  std::complex<double> first, second;
  [[nodiscard]] double distance() const { return std::abs(first + second); }
};

// The two eigenvalues (may be one twice) whose sum is closest to zero.
Pair closest_to_opposite(const std::vector<std::complex<double>>& eigenvalues) {
  Pair closest{eigenvalues.front(), eigenvalues.front()};
  for (std::size_t i = 0; i < eigenvalues.size(); ++i) {
    for (std::size_t j = i; j < eigenvalues.size(); ++j) {
      const Pair pair{eigenvalues[i], eigenvalues[j]};
      if (pair.distance() < closest.distance()) closest = pair;
    }
  }
  return closest;
}

[[noreturn]] void refuse(const Pair& pair) {
  throw ConfigError("continuous_lyapunov: the eigenvalues " + text_of(pair.first) + " and " + text_of(pair.second) +
                    " of A sum to zero within rounding; allowed: no two opposite eigenvalues (a stable A has none)");
}

}  // namespace

Matrix continuous_lyapunov(const Matrix& A, const Matrix& Q) {
  require_square(A, "continuous_lyapunov: A");
  const Matrix constant = require_symmetric(Q, A.rows(), "continuous_lyapunov: Q", Definiteness::any);
  const RealSchur schur = real_schur(A);
  const double rounding = std::numeric_limits<double>::epsilon() * A.norm();
  const Pair closest = closest_to_opposite(schur.eigenvalues);
  if (closest.distance() <= 10.0 * rounding) refuse(closest);
  // A = U T U', Y = U'XU:  T Y + Y T' = -U'QU.
  const Matrix Y = solve_quasi_triangular(schur.T, -(schur.U.transpose() * constant * schur.U));
  const Matrix X = schur.U * Y * schur.U.transpose();
  // The relative error of X is about rounding / sep(A, -A'), and sep <= ||Q|| / ||X||.
  if (!X.allFinite() || rounding * X.norm() > kLargestError * constant.norm()) refuse(closest);
  return 0.5 * (X + X.transpose());
}

}  // namespace consort
