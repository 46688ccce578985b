#pragma once
/// The differential Riccati equation of the Kalman-Bucy filter, moved over a step of any length without an error of integration.

#include "core/types.hpp"

namespace consort {

/// P' = A P + P A' + Q - P U P with A, Q, U (n x n) held over h seconds; Q (process noise, (unit of x)^2 / s) and U = C'R^-1 C symmetric
/// positive semidefinite. Its solution is P(h) = q + F P(0) (I + s P(0))^-1 F' with constant F, q, s, found from the exponential of the
/// Hamiltonian matrix over a short step and then doubled (Anderson 1978): nothing grows, whatever h and however stiff the equation, P stays
/// positive semidefinite, may be singular, and what is stationary for the equation is stationary for the step.
class RiccatiStep {
 public:
  RiccatiStep() = default;
  /// Throws ConfigError on other shapes, entries that are not finite, and an h that is not positive.
  RiccatiStep(const Matrix& A, const Matrix& U, const Matrix& Q, Seconds h);

  /// P(h) from P(0), both n x n and exactly symmetric.
  [[nodiscard]] Matrix operator()(const Matrix& P) const;

 private:
  Matrix transition_, information_, noise_;  // F, s, q
};

}  // namespace consort
