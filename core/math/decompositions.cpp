#include "core/math/decompositions.hpp"

#include "core/errors.hpp"
#include "core/math/shapes.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

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

Eigen::PartialPivLU<Matrix> invertible(const Matrix& A, std::string_view what) {
  const auto named = [&] { return std::string(what) + " (" + shape_of(A) + ") is "; };
  if (!A.allFinite()) throw RunError(named() + "not finite");
  Eigen::PartialPivLU<Matrix> factor(A);
  if (const double reciprocal = factor.rcond(); !(reciprocal > std::numeric_limits<double>::epsilon()))
    throw RunError(named() + "singular within rounding, condition number " + text_of(1.0 / reciprocal));
  return factor;
}

}  // namespace

SymmetricEigen symmetric_eigen(const Matrix& a) {
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(a);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Vector symmetric_eigenvalues(const Matrix& a) { return Eigen::SelfAdjointEigenSolver<Matrix>(a, Eigen::EigenvaluesOnly).eigenvalues(); }

SymmetricEigen symmetric_eigen(const Matrix& K, const Matrix& M, std::string_view what) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix> solver(K, M);
  require_success(solver, what, K.rows());
  return {solver.eigenvalues(), solver.eigenvectors()};
}

GeneralEigen eigen(const Matrix& a, std::string_view what) {
  const Eigen::EigenSolver<Matrix> solver(a);
  require_success(solver, what, a.rows());
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::VectorXcd eigenvalues(const Matrix& a, std::string_view what) {
  const Eigen::EigenSolver<Matrix> solver(a, false);
  require_success(solver, what, a.rows());
  return solver.eigenvalues();
}

Eigen::VectorXcd eigenvalues(const Eigen::MatrixXcd& a, std::string_view what) {
  const Eigen::ComplexEigenSolver<Eigen::MatrixXcd> solver(a, false);
  require_success(solver, what, a.rows());
  return solver.eigenvalues();
}

Vector singular_values(const Matrix& a) { return Eigen::JacobiSVD<Matrix>(a).singularValues(); }
Vector singular_values(const Eigen::MatrixXcd& a) { return Eigen::JacobiSVD<Eigen::MatrixXcd>(a).singularValues(); }

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
