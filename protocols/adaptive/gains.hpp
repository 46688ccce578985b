#pragma once
/// What the protocols share that steer linear agents x_i' = A x_i + B u_i whose whole state is measured: who they are, and the gains of
/// linear quadratic control (Knotek, thesis, (4.26)-(4.28)).

#include "core/counted.hpp"
#include "core/math/decompositions.hpp"
#include "core/math/riccati.hpp"
#include "protocols/parameters.hpp"

namespace consort {

/// Coordinates of a position, where y_i = (positions, velocities). Throws ConfigError on a measurement that has no two halves.
inline Eigen::Index positions_measured(std::string_view who, const Setup& setup) {
  if (setup.measurement_size % 2 != 0 || setup.measurement_size == 0)
    throw ConfigError("protocol " + std::string(who) + ": agent " + std::to_string(setup.self.value) + " measures " +
                      counted(setup.measurement_size, "number") + "; allowed: positions and as many velocities (double integrators)");
  return static_cast<Eigen::Index>(setup.measurement_size / 2);
}

inline constexpr std::array kGainParameters{
    ValueDoc{"Q", "covariance n x n (scalar, diagonal or matrix)", "1", "weight Q of the state in the Riccati equation"},
    ValueDoc{"R", "covariance m x m (scalar, diagonal or matrix)", "1", "weight R of the control in the Riccati equation, > 0"}};

/// K = R^-1 B'P, Gamma = K'RK, with A'P + P A + Q - P B R^-1 B'P = 0.                                                (4.26)-(4.28)
struct ConsensusGains {
  Matrix K;                    ///< m x n
  Matrix root;                 ///< m x n, Gamma = root' root
  Matrix P;                    ///< n x n
  double slowest_decay = 0.0;  ///< lambda_min(Q) / lambda_max(P), 1/s
  double largest_P = 0.0;      ///< lambda_max(P)
};

/// The gains for the agent's own dynamics, from parameters Q and R. Throws ConfigError if the agent does not know its A and B, does not
/// measure its whole state and nothing else, or if (A, B) is not stabilisable (naming the eigenvalue).
inline ConsensusGains consensus_gains(std::string_view who, const Values& values, const Setup& setup) {
  const std::string place = "protocol " + std::string(who) + ": agent " + std::to_string(setup.self.value);
  const Matrix *A = setup.model.find("A"), *B = setup.model.find("B"), *C = setup.model.find("C");
  if (A == nullptr || B == nullptr)
    throw ConfigError(
        place +
        ": it needs to know its dynamics A and B; found: a plant that does not tell; allowed: a linear plant model, a part for each agent");
  if (C == nullptr || C->rows() != A->rows() || !C->isIdentity(0.0) || setup.measurement_size != static_cast<std::size_t>(A->rows()))
    throw ConfigError(place + ": it needs y = x, its whole state and nothing else (C the identity, sensing: own)");
  const Matrix Q = values.covariance("Q", A->rows(), 1.0), R = values.covariance("R", B->cols(), 1.0, true);
  const RiccatiSolution solution = continuous_riccati(*A, *B, Q, R);
  const double largest_P = symmetric_eigenvalues(solution.P).maxCoeff();
  // R = T T' with T lower triangular, so Gamma = (T'K)'(T'K).
  const Matrix T = R.llt().matrixL();
  return {solution.K, T.transpose() * solution.K, solution.P, symmetric_eigenvalues(Q).minCoeff() / largest_P, largest_P};
}

}  // namespace consort
