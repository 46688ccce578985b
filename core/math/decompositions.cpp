#include "core/math/decompositions.hpp"

#include "core/errors.hpp"
#include "core/math/shapes.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace consort {
namespace {

template <class Solver>
void require_success(const Solver& solver, std::string_view what, Eigen::Index n) {
  if (solver.info() != Eigen::Success)
    throw RunError("the eigenvalues of " + std::string(what) + ", " + std::to_string(n) + " x " + std::to_string(n) + ", did not converge");
}

// Of numbers that are not finite, Eigen's iterations read beside the matrix or hand out memory that nobody wrote.
template <class AnyMatrix>
const AnyMatrix& finite(const AnyMatrix& A, std::string_view what) {
  if (!A.allFinite()) throw RunError(std::string(what) + " (" + shape_of(A.real()) + ") is not finite");
  return A;
}

constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();
Vector undefined(Eigen::Index n) { return Vector::Constant(n, kUndefined); }

Eigen::PartialPivLU<Matrix> invertible(const Matrix& A, std::string_view what) {
  Eigen::PartialPivLU<Matrix> factor(finite(A, what));
  if (const double reciprocal = factor.rcond(); !(reciprocal > std::numeric_limits<double>::epsilon()))
    throw RunError(std::string(what) + " (" + shape_of(A) + ") is singular within rounding, condition number " + text_of(1.0 / reciprocal));
  return factor;
}

}  // namespace

SymmetricEigen symmetric_eigen(const Matrix& a) {
  if (!a.allFinite()) return {undefined(a.rows()), Matrix::Constant(a.rows(), a.cols(), kUndefined)};
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(a);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Vector symmetric_eigenvalues(const Matrix& a) {
  if (!a.allFinite()) return undefined(a.rows());
  return Eigen::SelfAdjointEigenSolver<Matrix>(a, Eigen::EigenvaluesOnly).eigenvalues();
}

SymmetricEigen symmetric_eigen(const Matrix& K, const Matrix& M, std::string_view what) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix> solver(finite(K, what), finite(M, what));
  require_success(solver, what, K.rows());
  return {solver.eigenvalues(), solver.eigenvectors()};
}

GeneralEigen eigen(const Matrix& a, std::string_view what) {
  const Eigen::EigenSolver<Matrix> solver(finite(a, what));
  require_success(solver, what, a.rows());
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::VectorXcd eigenvalues(const Matrix& a, std::string_view what) {
  const Eigen::EigenSolver<Matrix> solver(finite(a, what), false);
  require_success(solver, what, a.rows());
  return solver.eigenvalues();
}

double spectral_radius(const Eigen::MatrixXcd& a, std::string_view what) {
  if (a.size() == 0) return 0.0;
  Matrix real(2 * a.rows(), 2 * a.cols());
  real << finite(a, what).real(), -a.imag(), a.imag(), a.real();
  return eigenvalues(real, what).cwiseAbs().maxCoeff();
}

double spectral_norm(const Matrix& a) {
  if (a.size() == 0) return 0.0;
  return std::sqrt(std::max(0.0, symmetric_eigenvalues(a.transpose() * a)[a.cols() - 1]));
}

Matrix inverse(const Matrix& A, std::string_view what) { return invertible(A, what).inverse(); }
Matrix solve(const Matrix& A, const Matrix& B, std::string_view what) {
  if (B.size() == 0) return B;  // Eigen would look at its first number
  return invertible(A, what).solve(B);
}
Vector solve(const Matrix& A, const Vector& b, std::string_view what) { return invertible(A, what).solve(b); }

}  // namespace consort
