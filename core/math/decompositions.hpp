#pragma once
/// Decompositions of dense matrices, compiled once: their templates are what a build spends most of its time on. All are Eigen's.
/// Of a matrix that is not finite, those that take a name throw RunError, which says it; the others answer NaN.

#include "core/types.hpp"

#include <string_view>

namespace consort {

/// Of a symmetric matrix, of which the lower triangle is read: eigenvalues, ascending, and orthonormal eigenvectors, as columns.
struct SymmetricEigen {
  Vector values;
  Matrix vectors;
};
SymmetricEigen symmetric_eigen(const Matrix& a);
Vector symmetric_eigenvalues(const Matrix& a);
/// K phi = lambda M phi, K and M symmetric, M > 0; phi'M phi = 1. Throws RunError, which says `what`, if the iteration does not converge.
SymmetricEigen symmetric_eigen(const Matrix& K, const Matrix& M, std::string_view what);

/// Of a square matrix, in no order. Throw RunError, which says `what`, if the iteration does not converge.
struct GeneralEigen {
  Eigen::VectorXcd values;
  Eigen::MatrixXcd vectors;
};
GeneralEigen eigen(const Matrix& a, std::string_view what);
Eigen::VectorXcd eigenvalues(const Matrix& a, std::string_view what);
/// The largest modulus among the eigenvalues of a complex one. (Those of the real matrix [Re a, -Im a; Im a, Re a] are the same and their
/// conjugates; Eigen's complex Schur form would be a second to compile.)
double spectral_radius(const Eigen::MatrixXcd& a, std::string_view what);

/// The largest singular value; 0 of a matrix without entries.
double spectral_norm(const Matrix& a);

/// A^-1, A^-1 B and A^-1 b by LU with partial pivoting; A square. Throw RunError, which says `what`, the size and the condition number,
/// if A is singular within rounding (an estimate of its reciprocal condition number in the 1-norm is no larger than 2^-52) or not finite.
Matrix inverse(const Matrix& A, std::string_view what);
Matrix solve(const Matrix& A, const Matrix& B, std::string_view what);
Vector solve(const Matrix& A, const Vector& b, std::string_view what);

}  // namespace consort
