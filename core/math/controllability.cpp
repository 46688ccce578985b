#include "core/math/controllability.hpp"

#include "core/errors.hpp"
#include "core/math/schur.hpp"
#include "core/math/shapes.hpp"

#include <algorithm>
#include <cmath>

namespace consort {

namespace {

constexpr double kNegligible = 1e-12;  // relative size of a coupling that counts as none
constexpr double kRounding = 1e-14;    // relative size of an input that counts as none
constexpr double kOnTheAxis = 1.5e-8;  // square root of the rounding error

// Verdict over the part that is not reached: the eigenvalue of largest real part among those that `breaks(value, tolerance)` picks.
template <class Breaks>
Verdict judge(const Matrix& A, const Matrix& rest, const Breaks& breaks) {
  const double tolerance = std::max(kOnTheAxis * rest.norm(), kNegligible * A.norm());
  Verdict verdict;
  for (const std::complex<double> value : eigenvalues_of(rest)) {
    if (breaks(value, tolerance) && (!verdict.offending || value.real() > verdict.offending->real())) verdict.offending = value;
  }
  return verdict;
}

// The columns of B with their units taken out; those that are rounding errors beside the largest, zero.
Matrix unit_columns(Matrix B) {
  const double largest = B.colwise().norm().maxCoeff();
  for (auto column : B.colwise()) {
    const double length = column.norm();
    column *= length > kRounding * largest ? 1.0 / length : 0.0;
  }
  return B;
}

constexpr auto kAny = [](std::complex<double>, double) { return true; };
constexpr auto kDoesNotDecay = [](std::complex<double> value, double tolerance) { return value.real() >= -tolerance; };
constexpr auto kIsOnTheAxis = [](std::complex<double> value, double tolerance) { return std::abs(value.real()) <= tolerance; };

}  // namespace

Split controllable_split(const Matrix& A, const Matrix& B) {
  require_square(A, "controllability: A");
  require_rows(B, A.rows(), "controllability: B");
  const Eigen::Index n = A.rows();
  Split split{Matrix::Identity(n, n), 0, A};
  Matrix turned = A;  // U'AU
  // What the part reached so far drives directly: first the inputs, their units taken out, then the states added last.
  Matrix driven = unit_columns(B);
  double threshold = kNegligible;
  while (split.dimension < n) {
    const Eigen::Index left = n - split.dimension;
    if (!driven.allFinite()) throw ConfigError("controllability: A or B is too large to be turned, its entries overflow");
    const Eigen::JacobiSVD<Matrix> svd(driven, Eigen::ComputeFullU);
    const Eigen::Index added = (svd.singularValues().array() > threshold).count();
    if (added == 0) break;
    const Matrix& W = svd.matrixU();
    split.U.rightCols(left) = (split.U.rightCols(left) * W).eval();
    turned.bottomRows(left) = (W.transpose() * turned.bottomRows(left)).eval();
    turned.rightCols(left) = (turned.rightCols(left) * W).eval();
    driven = turned.block(split.dimension + added, split.dimension, left - added, added);
    split.dimension += added;
    threshold = kNegligible * A.norm();
  }
  split.rest = turned.bottomRightCorner(n - split.dimension, n - split.dimension);
  return split;
}

Split observable_split(const Matrix& A, const Matrix& C) {
  require_square(A, "observability: A");
  require_columns(C, A.rows(), "observability: C");
  Split split = controllable_split(A.transpose(), C.transpose());
  split.rest.transposeInPlace();
  return split;
}

Verdict controllable(const Matrix& A, const Matrix& B) { return judge(A, controllable_split(A, B).rest, kAny); }

Verdict observable(const Matrix& A, const Matrix& C) { return judge(A, observable_split(A, C).rest, kAny); }

Verdict stabilisable(const Matrix& A, const Matrix& B) { return judge(A, controllable_split(A, B).rest, kDoesNotDecay); }

Verdict detectable(const Matrix& A, const Matrix& C) { return judge(A, observable_split(A, C).rest, kDoesNotDecay); }

Verdict observable_on_the_axis(const Matrix& A, const Matrix& C) { return judge(A, observable_split(A, C).rest, kIsOnTheAxis); }

}  // namespace consort
