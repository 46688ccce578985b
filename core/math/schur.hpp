#pragma once
/// The real Schur form, which the matrix equations of this room are solved through, and what is read off it. LAPACK does the work
/// (docs/decisions/0016).

#include "core/types.hpp"

#include <complex>
#include <vector>

namespace consort {

/// A = U T U' with U orthogonal and T upper quasi-triangular (1 x 1 blocks, and 2 x 2 blocks for complex pairs); both n x n.
struct RealSchur {
  Matrix U, T;
  std::vector<std::complex<double>> eigenvalues;  ///< in the order of the diagonal of T
};

/// The Schur form of A (n x n) in whatever order the iteration finds. Throws RunError if that does not converge.
RealSchur real_schur(const Matrix& A);

/// The same with the eigenvalues of negative real part first, so that the leading columns of U span the stable invariant subspace
/// of A. Where rounding blurs the two groups (an eigenvalue on the imaginary axis), `eigenvalues` shows it: look before you use U.
RealSchur stable_first_schur(const Matrix& A);

/// Powers of two d such that diag(d)^-1 A diag(d) has rows and columns of comparable size.
Vector balancing(const Matrix& A);

/// Y with T Y + Y T' = F, T upper quasi-triangular as in RealSchur; all n x n. Meaningful only if no two eigenvalues of T sum to zero.
Matrix solve_quasi_triangular(const Matrix& T, Matrix F);

/// Eigenvalues of A (n x n, may be 0 x 0); complex ones as adjacent conjugate pairs. Throws RunError if the iteration does not converge.
std::vector<std::complex<double>> eigenvalues_of(const Matrix& A);

/// Largest real part of an eigenvalue of A (n >= 1): negative if and only if x' = A x decays.
double spectral_abscissa(const Matrix& A);

/// Largest modulus of an eigenvalue of A (0 without any): below one if and only if x(k + 1) = A x(k) decays.
double spectral_radius(const Matrix& A);

}  // namespace consort
