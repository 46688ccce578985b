#include "core/math/discretise.hpp"

#include "core/errors.hpp"
#include "core/math/shapes.hpp"

#include <unsupported/Eigen/MatrixFunctions>

#include <algorithm>
#include <cmath>

namespace consort {

namespace {

void require_step(const Matrix& A, Seconds h) {
  require_square(A, "discretise: A");
  if (!(h > 0.0 && std::isfinite(h))) throw ConfigError("discretise: the step h is " + text_of(h) + " s; allowed: positive and finite");
}

// Row-sum norm of A h, which unlike the Frobenius norm overflows only if a sum does.
double size_of(const Matrix& A, Seconds h) { return (A * h).cwiseAbs().rowwise().sum().maxCoeff(); }

// Power of two of the size of A h (1 if that is zero). The block matrices below get their other blocks scaled to it: the exponential is
// only as accurate as its largest block.
double scale_of(const Matrix& A, Seconds h) {
  const double size = size_of(A, h);
  return size > 0.0 ? std::ldexp(1.0, std::ilogb(size)) : 1.0;
}

Matrix finite(Matrix value, const Matrix& A, Seconds h) {
  if (!value.allFinite() || !std::isfinite(size_of(A, h)))
    throw RunError("discretise: exp(A h) overflows for A (" + shape_of(A) + ") of norm " + text_of(size_of(A, 1.0)) +
                   " and h = " + text_of(h) + " s; take a shorter step");
  return value;
}

// Integral over 0..h of exp(A s) W exp(A's) ds.
Matrix noise_covariance(const Matrix& A, const Matrix& W, Seconds h) {
  const Eigen::Index n = A.rows();
  const double intensity = W.cwiseAbs().maxCoeff();
  if (intensity == 0.0) return Matrix::Zero(n, n);
  const int doublings = std::max(0, 1 + std::ilogb(size_of(A, h)));  // ||A|| step < 1
  const Seconds step = std::ldexp(h, -doublings);
  const double scale = scale_of(A, step);
  Matrix block(2 * n, 2 * n);
  block << -step * A, W * (scale / intensity), Matrix::Zero(n, n), step * A.transpose();
  const Matrix exponential = block.exp();  // [. F; 0 exp(A'step)], and Q = exp(A step) F
  Matrix transition = exponential.bottomRightCorner(n, n).transpose();
  Matrix Q = transition * exponential.topRightCorner(n, n) * (step * intensity / scale);
  for (int i = 0; i < doublings; ++i) {
    Q += (transition * Q * transition.transpose()).eval();
    transition = (transition * transition).eval();
  }
  return 0.5 * (Q + Q.transpose());
}

}  // namespace

Matrix matrix_exponential(const Matrix& A, Seconds h) {
  require_step(A, h);
  return finite((A * h).exp(), A, h);
}

Discrete discretise(const Matrix& A, const Matrix& B, const Matrix& W, Seconds h) {
  require_step(A, h);
  const Eigen::Index n = A.rows();
  if (B.size() > 0) require_rows(B, n, "discretise: B");
  Discrete discrete;
  // exp([A h, c; 0 0]) = [exp(A h), (c/h) integral of exp(A s) ds; 0 1].
  const double scale = scale_of(A, h);
  Matrix block = Matrix::Zero(2 * n, 2 * n);
  block.topLeftCorner(n, n) = A * h;
  block.topRightCorner(n, n).diagonal().setConstant(scale);
  const Matrix exponential = finite(block.exp(), A, h);
  discrete.A = exponential.topLeftCorner(n, n);
  discrete.B = B.size() > 0 ? Matrix(exponential.topRightCorner(n, n) * (h / scale * B)) : Matrix(n, 0);
  if (W.size() > 0) discrete.Q = finite(noise_covariance(A, require_symmetric(W, n, "discretise: W", Definiteness::semidefinite), h), A, h);
  return discrete;
}

}  // namespace consort
