#pragma once
/// Networks of observers of one plant, x' = A x + w, y_i = C_i x + v_i (Knotek, thesis, section 3.1): what a measurement says, the steps
/// by which an observer moves in rounds of h seconds, and the error of all observers together at constant gains.
///
/// Rounds (one exchange each): from what is stamped t_k every observer first corrects its estimate z_i, then predicts,
///     z_i <- exp(A h) [ z_i + G_i (u_i - U_i z_i) + S_i sum_j w_ij (z_j - z_i) ].
/// The plant moves by exp(A h) too, so the error z_i - x follows an equation of its own as it does in continuous time, whatever the plant
/// does. Neither correction overshoots, at any h: G_i = (I + h P U)^-1 h P is the Kalman gain for a sample of the measurement's white noise
/// held over h, S_i = (I - exp(-F_i d_i h)) / d_i moves towards in-neighbours that stand still. So stiff gains ask for no short h; for how
/// long a round all of it together is stable, `consort validate` says. First-order accurate in h.

#include "core/network/graph.hpp"

#include <vector>

namespace consort {

/// What y = C x + v says of x, v of covariance (or intensity) R: the vector u = C'R^-1 y and the matrix U = C'R^-1 C. Those of independent
/// measurements add up.
struct Sensor {
  Matrix to_u;  ///< C'R^-1, n x p
  Matrix U;     ///< n x n, exactly symmetric
};
/// C p x n (p = 0: measures nothing), R p x p symmetric positive definite. Throws ConfigError on other shapes.
Sensor sensor(const Matrix& C, const Matrix& R);

/// The correction (I + h P U)^-1 h P (u - U z), n x 1; P, U n x n symmetric positive semidefinite.
Vector corrected_by(const Vector& u, const Matrix& U, const Matrix& P, const Vector& z, Seconds h);

/// S = (I - exp(-F d h)) / d for d > 0; F n x n. Throws RunError if exp(-F d h) overflows.
Matrix coupling_step(const Matrix& F, double d, Seconds h);
/// The same for F = gamma P, P symmetric.
Matrix coupling_step(const Matrix& P, double gamma, double d, Seconds h);

/// Solution of A P + P A' + Q - P U P = 0 with A - P U stable. Throws as filter_riccati, with (A, U) in place of (A, C).
Matrix stationary_covariance(const Matrix& A, const Matrix& U, const Matrix& Q);

/// What one agent puts into (3.7c).
struct CoupledFilter {
  Matrix U, Q;
  double k = 0.0;
};
/// Solutions of A P_i + P_i A' + Q_i - P_i U_i P_i + k_i sum_j w_ij (P_j - P_i) = 0, by agent: stationary points of (3.7c). By sweeps, each
/// solving agent after agent. Throws as stationary_covariance, and RunError if 20 000 sweeps do not bring the change of a sweep below 1e-13
/// of P.
std::vector<Matrix> coupled_covariances(const Matrix& A, const std::vector<CoupledFilter>& filters, const Graph& graph);

/// M = (P^-1 + S)^-1 for the P with P = A M A' + Q, A = exp(A_plant dt): where Algorithm 3.1 ends. Throws RunError if its iteration does
/// not settle in 100 000 rounds.
Matrix stationary_update(const Matrix& A, const Matrix& S, const Matrix& Q);

/// Observers at constant gains: e_i' = (A - K_i C_i) e_i + F_i sum_j w_ij (e_j - e_i), e_i = z_i - x.
struct EstimatorNetwork {
  Matrix A;
  std::vector<Matrix> injection;  ///< K_i C_i by agent, n x n
  std::vector<Matrix> coupling;   ///< F_i by agent, n x n

  /// R with e' = R e, e the errors of agents 1..N one after the other; Nn x Nn.
  [[nodiscard]] Matrix error_matrix(const Graph& graph) const;
  /// E with e(k+1) = E e(k): the same network in rounds of h seconds.
  [[nodiscard]] Matrix sampled_error_matrix(const Graph& graph, Seconds h) const;
};

/// What one agent puts into Algorithm 3.1.
struct IterativeFilter {
  Matrix S, M;
  double epsilon = 1.0;
};
/// E with e(k+1) = E e(k): e_i(k+1) = A [(I - M_i S_i) e_i + epsilon_i M_i sum_j w_ij (e_j - e_i)], A = exp(A_plant dt).
Matrix iterative_error_matrix(const Matrix& A, const std::vector<IterativeFilter>& filters, const Graph& graph);

}  // namespace consort
