#pragma once
/// The continuous Lyapunov equation.

#include "core/types.hpp"

namespace consort {

/// X with A X + X A' + Q = 0, exactly symmetric; A, Q, X n x n, Q symmetric. If A is stable, X is the stationary covariance of
/// dx = A x dt + dw with noise of intensity Q. Through the real Schur form of A (Bartels, Stewart 1972; LAPACK dtrsyl).
/// Throws ConfigError on other shapes, an entry that is not finite, an asymmetric Q, and if two eigenvalues of A sum to zero (it names
/// them): exactly, up to rounding, or so nearly that X would have fewer than three correct digits.
Matrix continuous_lyapunov(const Matrix& A, const Matrix& Q);

}  // namespace consort
