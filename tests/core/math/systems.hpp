#pragma once
/// Random linear systems and slow, simple second implementations for the tests of the matrix equations.

#include "core/errors.hpp"
#include "core/math/decompositions.hpp"
#include "core/random.hpp"
#include "core/types.hpp"

#include <string>

namespace consort::cases {

inline Matrix random_matrix(Stream& stream, Eigen::Index rows, Eigen::Index cols) {
  return Matrix::NullaryExpr(rows, cols, [&] { return stream.normal(); });
}

inline Eigen::Index random_size(Stream& stream, std::uint64_t largest) { return 1 + static_cast<Eigen::Index>(stream.below(largest)); }

/// Orthogonal, n x n.
inline Matrix random_rotation(Stream& stream, Eigen::Index n) {
  const Matrix a = random_matrix(stream, n, n);
  return symmetric_eigen(a + a.transpose()).vectors;
}

/// Symmetric positive semidefinite of the given rank.
inline Matrix random_semidefinite(Stream& stream, Eigen::Index n, Eigen::Index rank) {
  const Matrix half = random_matrix(stream, rank, n);
  return half.transpose() * half;
}

inline Matrix kronecker(const Matrix& a, const Matrix& b) {
  Matrix product(a.rows() * b.rows(), a.cols() * b.cols());
  for (Eigen::Index i = 0; i < a.rows(); ++i)
    for (Eigen::Index j = 0; j < a.cols(); ++j) product.block(i * b.rows(), j * b.cols(), b.rows(), b.cols()) = a(i, j) * b;
  return product;
}

/// X -> A X + X A' as an n^2 x n^2 matrix.
inline Matrix lyapunov_operator(const Matrix& A) {
  const Matrix identity = Matrix::Identity(A.rows(), A.rows());
  return kronecker(identity, A) + kronecker(A, identity);
}

/// X with A X + X A' + Q = 0, as n^2 linear equations.
inline Matrix lyapunov_by_kronecker(const Matrix& A, const Matrix& Q) {
  const Vector x = solve(lyapunov_operator(A), Vector(-Q.reshaped()), "the operator");
  return x.reshaped(A.rows(), A.rows());
}

/// How much the equation above may magnify rounding.
inline double lyapunov_condition(const Matrix& A) {
  const Vector values = Eigen::JacobiSVD<Matrix>(lyapunov_operator(A)).singularValues();
  return values(0) / values(values.size() - 1);
}

/// Largest entry of a - b, over the largest of b.
inline double relative_error(const Matrix& a, const Matrix& b) { return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff(); }

inline Matrix double_integrator() { return (Matrix(2, 2) << 0, 1, 0, 0).finished(); }
inline Matrix oscillator(double omega) { return (Matrix(2, 2) << 0, omega, -omega, 0).finished(); }

/// The text of the error of kind `Error` that `action` throws.
template <class Error = ConfigError, class Action>
std::string complaint(Action action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing was thrown";
}

}  // namespace consort::cases
