#pragma once
/// Continuous algebraic Riccati equations, through the stable invariant subspace of the Hamiltonian matrix (Laub 1979) with LAPACK's
/// ordered Schur form (docs/decisions/0016). The gains of linear quadratic control and of the stationary Kalman-Bucy filter.

#include "core/types.hpp"

namespace consort {

/// The stabilising solution.
struct RiccatiSolution {
  Matrix P;               ///< n x n, exactly symmetric, positive semidefinite
  Matrix K;               ///< the gain: R^-1 B'P (m x n) for control, P C'R^-1 (n x p) for the filter
  double abscissa = 0.0;  ///< largest real part among the eigenvalues of A - B K, or A - K C; negative
  double residual = 0.0;  ///< Frobenius norm of what the equation leaves, over the sum of the norms of its terms
};

/// P with A'P + P A - P B R^-1 B'P + Q = 0 and A - B R^-1 B'P stable. A, Q n x n, B n x m, R m x m; Q symmetric positive semidefinite,
/// R symmetric positive definite.
/// Throws ConfigError on other matrices, if (A, B) is not stabilisable, and if Q does not see an eigenvalue of A on the imaginary axis; it
/// names the condition and the eigenvalue. Throws RunError if rounding leaves no usable solution (residual above 1e-8).
RiccatiSolution continuous_riccati(const Matrix& A, const Matrix& B, const Matrix& Q, const Matrix& R);

/// Its dual: P with A P + P A' - P C'R^-1 C P + Q = 0 and A - P C'R^-1 C stable, the stationary error covariance of the Kalman-Bucy
/// filter for process noise of intensity Q and measurement noise of intensity R. A, Q n x n, C p x n, R p x p.
/// Throws as above, with (A, C) detectable in place of stabilisable, and Q exciting every eigenvalue on the axis.
RiccatiSolution filter_riccati(const Matrix& A, const Matrix& C, const Matrix& Q, const Matrix& R);

/// K = R^-1 B'P (m x n): u = -K x minimises the integral of x'Q x + u'R u along x' = A x + B u. Throws as continuous_riccati.
Matrix lqr_gain(const Matrix& A, const Matrix& B, const Matrix& Q, const Matrix& R);

}  // namespace consort
