#pragma once
/// A network of observers of one linear system, each with its own sensor or none, and what its estimation errors do.
///
///     z' = A z + w,   y_i = C_i z + xi_i,   w ~ Omega, xi_i ~ Xi_i (intensities)                                   (3.19), (3.20)
///     zhat_i' = A zhat_i + G_i (y_i - C_i zhat_i) + F_i sum_j w_ij (zhat_j - zhat_i)                                       (3.22)
///     G_i = T_i' [M_i^-1 C_io' U_i^-1; 0],    F_i = gamma T_i' blkdiag(M_i^-1, I / alpha_j) T_i                     (3.28), (3.31)
///     M_i^-1 A_io' + A_io M_i^-1 + Q_io - M_i^-1 C_io' U_i^-1 C_io M_i^-1 = 0                                              (3.29)
///
/// Source: Knotek, thesis, chapter 3; by Algorithm 3.2 Q_i = Omega_io and U_i = Xi_i. Everything is in the original ordering of the state:
/// (3.68) and (3.73) as printed permute each agent's error by its own T_i, but then couple errors of different agents without
/// permuting one into the other's order.

#include "core/graph.hpp"
#include "core/types.hpp"

#include <vector>

namespace consort {

/// State groups: the components of each, ascending; groups by their first component. Together they are 0..n-1.
using StateGroups = std::vector<std::vector<Eigen::Index>>;

/// The finest groups that A (n x n) does not couple: its blocks, after a permutation.
StateGroups state_groups(const Matrix& A);

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

/// The whole network.
struct SensorNetwork {
  Matrix A, Omega;            ///< n x n
  std::vector<Matrix> C, Xi;  ///< by agent: p_i x n, p_i x p_i
  std::vector<Matrix> G, F;   ///< by agent: n x p_i, n x n
  Graph graph;
};

/// (3.72) in the original ordering, N n x N n: diag(A - G_i C_i) - diag(F_i)(L (x) I).
Matrix error_matrix(const SensorNetwork& network);
/// P of (3.73), stationary, N n x N n. Throws ConfigError if the error matrix is not stable.
Matrix error_covariance(const SensorNetwork& network);

/// The same observers stepped by h: e(k + 1) = exp(A h) ((I - h G_i C_i) e_i + S_i sum_j w_ij (e_j - e_i)).
Matrix sampled_error_matrix(const SensorNetwork& network, Seconds h);
/// Stationary covariance of e(k), with measurement noise N(0, Xi_i / h). Throws ConfigError if the sampled error matrix is not stable.
Matrix sampled_error_covariance(const SensorNetwork& network, Seconds h);

/// Largest modulus of an eigenvalue of a square matrix.
double spectral_radius(const Matrix& A);

/// X with A X A' + Q = X. A, Q n x n, Q symmetric positive semidefinite. Throws ConfigError if the spectral radius of A is not below one.
Matrix discrete_lyapunov(const Matrix& A, const Matrix& Q);

}  // namespace consort
