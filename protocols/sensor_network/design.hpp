#pragma once
/// How an agent designs its part of a network of observers of one linear system, each with its own sensor or none.
///
///     z' = A z + w,   y_i = C_i z + xi_i,   w ~ Omega, xi_i ~ Xi_i (intensities)                                   (3.19), (3.20)
///     zhat_i' = A zhat_i + G_i (y_i - C_i zhat_i) + F_i sum_j w_ij (zhat_j - zhat_i)                                       (3.22)
///     G_i = T_i' [M_i^-1 C_io' U_i^-1; 0],    F_i = gamma T_i' blkdiag(M_i^-1, I / alpha_j) T_i                     (3.28), (3.31)
///     M_i^-1 A_io' + A_io M_i^-1 + Q_io - M_i^-1 C_io' U_i^-1 C_io M_i^-1 = 0                                              (3.29)
///
/// Source: Knotek, thesis, chapter 3; by Algorithm 3.2 Q_i = Omega_io and U_i = Xi_i. Everything is in the original ordering of the state.

#include "core/values.hpp"
#include "protocols/luenberger.hpp"

#include <vector>

namespace consort {

/// What one agent designs from its own sensor.
struct LocalObserver {
  std::vector<char> observes;            ///< by group: C_ij is not zero (Assumption 8)
  std::vector<Eigen::Index> observable;  ///< components of the observed groups, ascending
  Matrix M_inverse;                      ///< M_i^-1 (n_io x n_io): covariance of the local Kalman filter
  Matrix G;                              ///< G_i, n x p; n x 0 without a sensor
  double decay = 0.0;                    ///< lambda_min(M_i Q_i M_i) of (3.85); infinite without a sensor
};

/// A, Q n x n, C p x n (p = 0: no sensor), R p x p. Q, the intensity of the process noise, and R must be positive definite.
/// Throws ConfigError naming the agent where a group it sees is not observable from it (Assumption 8), or (3.29) has no solution, and
/// RunError where M_i^-1 cannot be inverted (name, size, condition).
LocalObserver local_observer(AgentId self, const Matrix& A, const StateGroups& groups, const Matrix& C, const Matrix& Q, const Matrix& R);

/// 1 / alpha_ij^max by group, (3.85) with p = `agents` and w_min / w_max = `balance`: 0 where i does not observe the group or (3.85) is
/// no bound, because lambda_max(A_j + A_j') is not positive.
Vector inverse_alpha_bounds(const LocalObserver& observer, const Matrix& A, const StateGroups& groups, std::size_t agents, double balance);

/// F_i (n x n, symmetric), with 1 / alpha_j by group; those of observed groups do not matter.
Matrix consensus_gain(const LocalObserver& observer, const StateGroups& groups, double gamma, const Vector& inverse_alpha);

/// S_i = (I - exp(-F_i d_i h)) / d_i: the consensus part over a step h with the neighbours' estimates moving alongside. d_i > 0.
Matrix consensus_step(const Matrix& F, double d, Seconds h);

/// What all agents agree on beforehand, beside their noises.
struct SensorTuning {
  double gamma = 1.0, beta = 1.0, balance = 1.0;
  Vector alpha;  ///< by group; empty: Algorithm 3.2
  Round flooding_rounds = 1;
};

/// From parameters of the protocol sensor_network_observer (which says what they mean), for a plant A with so many state groups and at
/// most `agents` agents. Throws ConfigError naming agent, parameter, what was found and what is allowed.
SensorTuning sensor_tuning(AgentId self, const Values& parameters, const Matrix& A, std::size_t groups, std::size_t agents);

/// alpha_j of (3.86) from the largest 1 / alpha_ij^max of all agents, by group.
Vector alpha_of(const Vector& largest_inverse, double beta);

}  // namespace consort
