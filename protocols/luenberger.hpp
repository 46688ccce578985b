#pragma once
/// Gains of distributed Luenberger observers, x_i' = A x_i + L_i (y_i - C_i x_i) + F_i sum_j w_ij (x_j - x_i), which one agent computes
/// from its own A and C_i alone. Knotek, thesis, (3.9)-(3.16). Observable parts get the gain of a stationary Kalman-Bucy filter, which
/// leaves A_io - L_io C_io stable.

#include "core/types.hpp"

#include <string>
#include <vector>

namespace consort {

struct ObserverGains {
  Matrix L;  ///< injection gain, n x p
  Matrix F;  ///< coupling gain with gamma or c in it, n x n
};

/// (3.9)-(3.12), Kim et al.: in coordinates that split off what C does not see, L = T [L_io; 0] and F = gamma T diag(k M_io, I)^-1 T' with
/// (A_io - L_io C_io)'M_io + M_io (A_io - L_io C_io) = -I. L_io for noise intensities Q (n x n) and R (p x p).
/// C p x n, p = 0: sees nothing. gamma, k > 0. Throws ConfigError on other shapes and where Q leaves A_io - L_io C_io unstable.
ObserverGains kim_gains(const Matrix& A, const Matrix& C, const Matrix& Q, const Matrix& R, double gamma, double k);

/// State groups: the finest partition of the state for which A is block diagonal, as ascending indices, groups by first index.
using StateGroups = std::vector<std::vector<Eigen::Index>>;
StateGroups state_groups(const Matrix& A);
/// The groups that C (p x n) sees: those where an entry is not zero (Assumption 5), one flag per group.
std::vector<bool> seen_groups(const StateGroups& groups, const Matrix& C);
/// "{x1, x2}".
std::string group_text(const std::vector<Eigen::Index>& group);

/// (3.13)-(3.16), Zhang et al.: T_i sorts the state groups into those that C sees and the others; L = T [L_io; 0], L_io for noise
/// intensities Q and R as above; F = T diag(0, c F_j) T' with F_j = R_j^-1 P_j, A_j'P_j + P_j A_j - P_j R_j^-1 P_j + Q_j = 0 for Q_j and
/// R_j the blocks of `coupling_Q` and `coupling_R` (n x n). Throws ConfigError on other shapes and, naming an eigenvalue, if C sees a part
/// only of the groups that it sees.
ObserverGains zhang_gains(const Matrix& A, const Matrix& C, const Matrix& Q, const Matrix& R, double c, const Matrix& coupling_Q,
                          const Matrix& coupling_R);

}  // namespace consort
