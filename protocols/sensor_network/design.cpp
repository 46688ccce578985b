#include "protocols/sensor_network/design.hpp"

#include "core/counted.hpp"
#include "core/errors.hpp"
#include "core/math/controllability.hpp"
#include "core/math/decompositions.hpp"
#include "core/math/riccati.hpp"
#include "core/math/shapes.hpp"
#include "core/math/spd.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

namespace consort {
namespace {

using Indices = std::vector<Eigen::Index>;

constexpr double kRounding = 1e-12;  // of ||A||: a growth below it is none

// "3 (components 5, 6)", counted from 1.
std::string group_text(const StateGroups& groups, std::size_t j) {
  std::string out = std::to_string(j + 1) + " (" + noun(groups[j].size(), "component");
  for (const Eigen::Index c : groups[j]) out += (c == groups[j].front() ? " " : ", ") + std::to_string(c + 1);
  return out + ")";
}

// 1.1 times (3.83) for the worst graph: see the protocol.
double worst_gamma(const Matrix& A, std::size_t agents, double balance) {
  const double growth = symmetric_eigenvalues(A + A.transpose()).maxCoeff();
  if (growth <= kRounding * A.norm() || agents < 2) return 1.0;
  return 1.1 * growth / (2.0 * balance * (1.0 - std::cos(std::numbers::pi / static_cast<double>(agents))));
}

}  // namespace

LocalObserver local_observer(AgentId self, const Matrix& A, const StateGroups& groups, const Matrix& C, const Matrix& Q, const Matrix& R) {
  const std::string who = "sensor network observer: agent " + std::to_string(self.value);
  LocalObserver out;
  out.G = Matrix::Zero(A.rows(), C.rows());
  out.decay = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < groups.size(); ++j) {
    const Matrix C_ij = C(Eigen::all, groups[j]);
    out.observes.push_back(C_ij.isZero(0.0) ? 0 : 1);
    if (out.observes.back() == 0) continue;
    if (const auto seen = observable(A(groups[j], groups[j]), C_ij); !seen)
      throw ConfigError(who + ": found that its C sees state group " + group_text(groups, j) +
                        " only in part; allowed: a group is observable or its entries of C are zero (Assumption 8)");
    out.observable.insert(out.observable.end(), groups[j].begin(), groups[j].end());
  }
  std::sort(out.observable.begin(), out.observable.end());
  if (out.observable.empty()) return out;
  const auto& o = out.observable;
  const Matrix C_io = C(Eigen::all, o), Q_io = Q(o, o);
  try {
    const RiccatiSolution solution = filter_riccati(A(o, o), C_io, Q_io, R);
    out.M_inverse = solution.P;
    out.G(o, Eigen::all) = solution.K;
  } catch (const ConfigError& error) {
    throw ConfigError(who + ": (3.29): " + error.what());
  }
  SpdInverse<Eigen::Dynamic> inverse(out.M_inverse.rows(), {"sensor network observer", self});
  const Matrix M = inverse(out.M_inverse, "M_i^-1");
  out.decay = symmetric_eigenvalues(M * Q_io * M).minCoeff();
  return out;
}

Vector inverse_alpha_bounds(const LocalObserver& observer, const Matrix& A, const StateGroups& groups, std::size_t agents, double balance) {
  Vector out = Vector::Zero(static_cast<Eigen::Index>(groups.size()));
  for (std::size_t j = 0; j < groups.size(); ++j) {
    if (observer.observes[j] == 0) continue;
    const Matrix A_j = A(groups[j], groups[j]);
    const double growth = symmetric_eigenvalues(A_j + A_j.transpose()).maxCoeff();
    // 1 / alpha_ij^max = w_max (p - 1) lambda_max(A_j + A_j') / (w_min lambda_min(M_i Q_i M_i))                            (3.85)
    if (growth > kRounding * A_j.norm())
      out[static_cast<Eigen::Index>(j)] = static_cast<double>(agents - 1) * growth / (balance * observer.decay);
  }
  return out;
}

Matrix consensus_gain(const LocalObserver& observer, const StateGroups& groups, double gamma, const Vector& inverse_alpha) {
  Eigen::Index n = 0;
  for (const Indices& group : groups) n += static_cast<Eigen::Index>(group.size());
  Matrix F = Matrix::Zero(n, n);
  if (!observer.observable.empty()) F(observer.observable, observer.observable) = gamma * observer.M_inverse;
  for (std::size_t j = 0; j < groups.size(); ++j) {
    if (observer.observes[j] != 0) continue;
    for (const Eigen::Index c : groups[j]) F(c, c) = gamma * inverse_alpha[static_cast<Eigen::Index>(j)];
  }
  return F;
}

Matrix consensus_step(const Matrix& F, double d, Seconds h) {
  const SymmetricEigen eigen = symmetric_eigen(F);
  const Vector steps = eigen.values.unaryExpr([&](double f) { return -std::expm1(-f * d * h) / d; });
  return eigen.vectors * steps.asDiagonal() * eigen.vectors.transpose();
}

SensorTuning sensor_tuning(AgentId self, const Values& parameters, const Matrix& A, std::size_t groups, std::size_t agents) {
  const auto require = [&](bool good, const std::string& name, double found, const std::string& allowed) {
    if (!good)
      throw ConfigError("sensor network observer: agent " + std::to_string(self.value) + ": found " + name + " = " + text_of(found) +
                        "; allowed: " + allowed);
  };
  SensorTuning out;
  for (const auto& [name, value] : {std::pair{"beta", &out.beta}, std::pair{"balance", &out.balance}}) {
    *value = parameters.scalar(name, 1.0);
    require(*value > 0.0 && *value <= 1.0, name, *value, "above 0, up to 1");
  }
  out.gamma = parameters.has("gamma") ? parameters.scalar("gamma") : worst_gamma(A, agents, out.balance);
  require(out.gamma > 0.0, "gamma", out.gamma, "above 0");
  if (parameters.has("alpha")) {
    const Vector alpha = parameters.vector("alpha");
    const auto l = static_cast<Eigen::Index>(groups);
    const auto length = static_cast<double>(alpha.size());
    require(alpha.size() == 1 || alpha.size() == l, "the length of alpha", length, "1, or one per state group, " + std::to_string(l));
    require(alpha.minCoeff() > 0.0, "alpha", alpha.minCoeff(), "above 0");
    out.alpha = alpha.size() == l ? alpha : Vector::Constant(l, alpha[0]);
  }
  const double rounds = parameters.scalar("flooding_rounds", static_cast<double>(agents));
  require(rounds >= 1.0 && rounds <= 1e6 && rounds == std::floor(rounds), "flooding_rounds", rounds, "a whole number from 1 to 1000000");
  out.flooding_rounds = static_cast<Round>(rounds);
  return out;
}

Vector alpha_of(const Vector& largest_inverse, double beta) {
  return largest_inverse.unaryExpr([&](double inverse) { return inverse > beta ? beta / inverse : 1.0; });
}

}  // namespace consort
