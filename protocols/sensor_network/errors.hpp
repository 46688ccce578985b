#pragma once
/// What the estimation errors of a whole network of observers (protocols/sensor_network/design.hpp) do: for those who look at it from
/// outside.
///
///     e_i' = (A - G_i C_i) e_i + F_i sum_j w_ij (e_j - e_i) + G_i xi_i - w                                                  (3.24)
///     A_tot P + P A_tot' + Omega^ + G Xi G' = 0                                                              (3.73), stationary
///
/// Source: Knotek, thesis, section 3.4.1. (3.68) and (3.73) as printed permute each agent's error by its own T_i, but then couple errors of
/// different agents without permuting one into the other's order; here everything is in the original ordering of the state. The blocks of
/// Omega^ are all Omega, also those off the diagonal, for the process noise is common.

#include "core/network/graph.hpp"

#include <vector>

namespace consort {

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

/// The groups of agents that reach each other and hear nobody else, by their first agent: one of them is the irreducible leader group of
/// Assumption 10 if the graph has a spanning tree.
std::vector<std::vector<AgentId>> leader_groups(const Graph& graph);

/// What gamma must exceed by (3.83) and (3.84), with one leader group; 0: any gamma does.
struct GammaBounds {
  double leaders = 0.0, followers = 0.0;
  double balance = 1.0;  ///< w_min / w_max of the leaders' left null vector
};
GammaBounds gamma_bounds(const Matrix& A, const Graph& graph, const std::vector<AgentId>& leaders);

/// X with A X A' + Q = X. A, Q n x n, Q symmetric positive semidefinite. Throws ConfigError if the spectral radius of A is not below one.
Matrix discrete_lyapunov(const Matrix& A, const Matrix& Q);

}  // namespace consort
