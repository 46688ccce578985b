#include "protocols/luenberger.hpp"

#include "core/errors.hpp"
#include "core/math/controllability.hpp"
#include "core/math/lyapunov.hpp"
#include "core/math/riccati.hpp"
#include "core/math/shapes.hpp"

#include <algorithm>
#include <string>

namespace consort {

ObserverGains kim_gains(const Matrix& A, const Matrix& C, const Matrix& Q, const Matrix& R, double gamma, double k) {
  const Eigen::Index n = A.rows();
  ObserverGains gains{Matrix::Zero(n, C.rows()), gamma * Matrix::Identity(n, n)};
  if (C.rows() == 0) return gains;
  const Split split = observable_split(A, C);
  const Eigen::Index seen = split.dimension;
  if (seen == 0) return gains;
  const Matrix T = split.U.leftCols(seen);  // n x seen, orthonormal columns
  const Matrix A_o = T.transpose() * A * T, C_o = C * T;
  const Matrix L_o = filter_riccati(A_o, C_o, T.transpose() * Q * T, R).K;
  // (A_o - L_o C_o)' M + M (A_o - L_o C_o) = -I                                                                                (3.12)
  const Matrix M = continuous_lyapunov((A_o - L_o * C_o).transpose(), Matrix::Identity(seen, seen));
  const Matrix inverse = M.llt().solve(Matrix::Identity(seen, seen));
  gains.L = T * L_o;
  gains.F += gamma * T * (0.5 / k * (inverse + inverse.transpose()) - Matrix::Identity(seen, seen)) * T.transpose();
  return gains;
}

StateGroups state_groups(const Matrix& A) {
  require_square(A, "state groups: A");
  const Eigen::Index n = A.rows();
  StateGroups groups;
  std::vector<bool> placed(static_cast<std::size_t>(n), false);
  for (Eigen::Index first = 0; first < n; ++first) {
    if (placed[static_cast<std::size_t>(first)]) continue;
    std::vector<Eigen::Index> group{first};
    placed[static_cast<std::size_t>(first)] = true;
    for (std::size_t at = 0; at < group.size(); ++at)
      for (Eigen::Index other = 0; other < n; ++other)
        if (!placed[static_cast<std::size_t>(other)] && (A(group[at], other) != 0.0 || A(other, group[at]) != 0.0)) {
          placed[static_cast<std::size_t>(other)] = true;
          group.push_back(other);
        }
    std::sort(group.begin(), group.end());
    groups.push_back(std::move(group));
  }
  return groups;
}

std::vector<bool> seen_groups(const StateGroups& groups, const Matrix& C) {
  std::vector<bool> seen;
  for (const auto& group : groups) seen.push_back(C.rows() > 0 && !Matrix(C(Eigen::all, group)).isZero(0.0));
  return seen;
}

std::string group_text(const std::vector<Eigen::Index>& group) {
  std::string text;
  for (const Eigen::Index component : group) text += (text.empty() ? "x" : ", x") + std::to_string(component + 1);
  return "{" + text + "}";
}

ObserverGains zhang_gains(const Matrix& A, const Matrix& C, const Matrix& Q, const Matrix& R, double c, const Matrix& coupling_Q,
                          const Matrix& coupling_R) {
  const Eigen::Index n = A.rows();
  ObserverGains gains{Matrix::Zero(n, C.rows()), Matrix::Zero(n, n)};
  const StateGroups groups = state_groups(A);
  const std::vector<bool> seen = seen_groups(groups, C);
  std::vector<Eigen::Index> observed;
  std::string names;
  for (std::size_t j = 0; j < groups.size(); ++j) {
    const auto& group = groups[j];
    if (seen[j]) {
      observed.insert(observed.end(), group.begin(), group.end());
      names += (names.empty() ? "" : " ") + group_text(group);
      continue;
    }
    const auto size = static_cast<Eigen::Index>(group.size());
    // F_j = R_j^-1 P_j,  A_j'P_j + P_j A_j - P_j R_j^-1 P_j + Q_j = 0                                                            (3.16)
    gains.F(group, group) = c * lqr_gain(A(group, group), Matrix::Identity(size, size), coupling_Q(group, group), coupling_R(group, group));
  }
  if (observed.empty()) return gains;
  const Matrix A_o = A(observed, observed), C_o = C(Eigen::all, observed);
  if (const Verdict verdict = observable(A_o, C_o); !verdict)
    throw ConfigError("C sees the state groups " + names + " in part only: the mode with eigenvalue " + text_of(*verdict.offending) +
                      " is not observable; allowed: groups that are seen whole or not at all (Assumption 5)");
  gains.L(observed, Eigen::all) = filter_riccati(A_o, C_o, Q(observed, observed), R).K;
  return gains;
}

}  // namespace consort
