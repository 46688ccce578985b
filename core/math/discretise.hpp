#pragma once
/// Exact discretisation of linear systems with inputs held over a step.

#include "core/types.hpp"

namespace consort {

/// exp(A h). A n x n, h > 0 in s. Throws ConfigError on other arguments, RunError if the result overflows.
Matrix matrix_exponential(const Matrix& A, Seconds h);

/// x(k+1) = A x(k) + B u(k) + w(k), w ~ N(0, Q): dx = (A x + B u) dt + dw seen at multiples of h, u held in between.
struct Discrete {
  Matrix A;  ///< exp(A h), n x n
  Matrix B;  ///< integral over 0..h of exp(A s) ds B, n x m
  Matrix Q;  ///< integral over 0..h of exp(A s) W exp(A's) ds, n x n, exactly symmetric; empty if W is
};

/// A n x n; B n x m, or empty without inputs (then n x 0); W n x n, the symmetric positive semidefinite intensity of continuous white noise
/// (unit of x squared per s), or empty without noise; h > 0 in s. Throws ConfigError on other arguments, RunError if exp(A h) overflows.
/// Q by Van Loan 1978 over a step short enough for its exponential of -A, then doubled: so it stays accurate, and positive, for stiff A.
Discrete discretise(const Matrix& A, const Matrix& B, const Matrix& W, Seconds h);

}  // namespace consort
