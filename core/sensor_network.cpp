#include "core/sensor_network.hpp"

#include "core/controllability.hpp"
#include "core/discretise.hpp"
#include "core/errors.hpp"
#include "core/lyapunov.hpp"
#include "core/riccati.hpp"
#include "core/schur.hpp"
#include "core/spd.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace consort {
namespace {

using Indices = std::vector<Eigen::Index>;

Vector symmetric_eigenvalues(const Matrix& a) { return Eigen::SelfAdjointEigenSolver<Matrix>(a, Eigen::EigenvaluesOnly).eigenvalues(); }

/// "3 (components 5, 6)", counted from 1.
std::string group_text(const StateGroups& groups, std::size_t j) {
  std::string out = std::to_string(j + 1) + " (components";
  for (const Eigen::Index c : groups[j]) out += (c == groups[j].front() ? " " : ", ") + std::to_string(c + 1);
  return out + ")";
}

/// Blocks of one agent's size in a matrix of the whole network.
Eigen::Block<Matrix> block_of(Matrix& whole, std::size_t i, std::size_t j, Eigen::Index n) {
  return whole.block(static_cast<Eigen::Index>(i) * n, static_cast<Eigen::Index>(j) * n, n, n);
}

double in_degree(const Graph& graph, AgentId i) {
  double d = 0.0;
  for (const Neighbour& j : graph.in_neighbours(i)) d += j.weight;
  return d;
}

/// Adds S_i sum_j w_ij (e_j - e_i) to the rows of agent i.
void add_coupling(Matrix& whole, const Graph& graph, AgentId i, const Matrix& S) {
  const Eigen::Index n = S.rows();
  for (const Neighbour& j : graph.in_neighbours(i)) block_of(whole, index_of(i), index_of(j.id), n) += j.weight * S;
  block_of(whole, index_of(i), index_of(i), n) -= in_degree(graph, i) * S;
}

[[noreturn]] void refuse_unstable(const std::string& what, const std::string& found) {
  throw ConfigError("the network of observers has no stationary covariance: " + what + " is " + found);
}

}  // namespace

StateGroups state_groups(const Matrix& A) {
  const Eigen::Index n = A.rows();
  check(A.cols() == n, "state_groups: A is square");
  std::vector<bool> placed(static_cast<std::size_t>(n), false);
  StateGroups groups;
  for (Eigen::Index first = 0; first < n; ++first) {
    if (placed[static_cast<std::size_t>(first)]) continue;
    Indices group{first};
    placed[static_cast<std::size_t>(first)] = true;
    for (std::size_t at = 0; at < group.size(); ++at) {  // grows on the way
      const Eigen::Index c = group[at];
      for (Eigen::Index other = first; other < n; ++other) {
        if (placed[static_cast<std::size_t>(other)] || (A(c, other) == 0.0 && A(other, c) == 0.0)) continue;
        placed[static_cast<std::size_t>(other)] = true;
        group.push_back(other);
      }
    }
    std::sort(group.begin(), group.end());
    groups.push_back(std::move(group));
  }
  return groups;
}

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
  constexpr double kRounding = 1e-12;
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
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(F);
  const Vector steps = solver.eigenvalues().unaryExpr([&](double f) { return -std::expm1(-f * d * h) / d; });
  return solver.eigenvectors() * steps.asDiagonal() * solver.eigenvectors().transpose();
}

Matrix error_matrix(const SensorNetwork& network) {
  const Eigen::Index n = network.A.rows();
  const std::size_t agents = network.C.size();
  Matrix out = Matrix::Zero(n * static_cast<Eigen::Index>(agents), n * static_cast<Eigen::Index>(agents));
  for (std::size_t i = 0; i < agents; ++i) {
    block_of(out, i, i, n) += network.A - network.G[i] * network.C[i];
    add_coupling(out, network.graph, agent_at(i), network.F[i]);
  }
  return out;
}

Matrix error_covariance(const SensorNetwork& network) {
  const Matrix A_tot = error_matrix(network);
  const double abscissa = spectral_abscissa(A_tot);
  if (!(abscissa < 0.0)) refuse_unstable("the largest real part of the error matrix's eigenvalues", std::to_string(abscissa));
  // A_tot P + P A_tot' + Omega^ + G Xi G' = 0: one process noise for all, so Omega^ has Omega in every block              (3.73)
  Matrix noise = network.Omega.replicate(A_tot.rows() / network.A.rows(), A_tot.rows() / network.A.rows());
  for (std::size_t i = 0; i < network.C.size(); ++i)
    block_of(noise, i, i, network.A.rows()) += network.G[i] * network.Xi[i] * network.G[i].transpose();
  return continuous_lyapunov(A_tot, 0.5 * (noise + noise.transpose()));
}

Matrix sampled_error_matrix(const SensorNetwork& network, Seconds h) {
  const Eigen::Index n = network.A.rows();
  const std::size_t agents = network.C.size();
  Matrix out = Matrix::Zero(n * static_cast<Eigen::Index>(agents), n * static_cast<Eigen::Index>(agents));
  const Matrix E = matrix_exponential(network.A, h);
  for (std::size_t i = 0; i < agents; ++i) {
    block_of(out, i, i, n) += Matrix::Identity(n, n) - h * network.G[i] * network.C[i];
    const double d = in_degree(network.graph, agent_at(i));
    if (d > 0.0) add_coupling(out, network.graph, agent_at(i), consensus_step(network.F[i], d, h));
    out.middleRows(static_cast<Eigen::Index>(i) * n, n) = (E * out.middleRows(static_cast<Eigen::Index>(i) * n, n)).eval();
  }
  return out;
}

Matrix sampled_error_covariance(const SensorNetwork& network, Seconds h) {
  const Matrix step = sampled_error_matrix(network, h);
  const Discrete plant = discretise(network.A, {}, network.Omega, h);
  // The measurement's error h G_i xi_i, xi_i ~ N(0, Xi_i / h), moves on by exp(A h); the process noise of the step is common.
  Matrix noise = plant.Q.replicate(step.rows() / network.A.rows(), step.rows() / network.A.rows());
  for (std::size_t i = 0; i < network.C.size(); ++i) {
    const Matrix gain = plant.A * network.G[i];
    block_of(noise, i, i, network.A.rows()) += h * gain * network.Xi[i] * gain.transpose();
  }
  return discrete_lyapunov(step, 0.5 * (noise + noise.transpose()));
}

double spectral_radius(const Matrix& A) {
  double largest = 0.0;
  for (const auto& lambda : eigenvalues_of(A)) largest = std::max(largest, std::abs(lambda));
  return largest;
}

Matrix discrete_lyapunov(const Matrix& A, const Matrix& Q) {
  const double radius = spectral_radius(A);
  if (!(radius < 1.0)) refuse_unstable("the spectral radius of a step", std::to_string(radius));
  // X_m = sum of A^k Q A'^k over k < 2^m: X_(m+1) = X_m + A^(2^m) X_m A'^(2^m)  (Smith's doubling)
  Matrix X = Q, power = A;
  for (int doubling = 0; doubling < 60; ++doubling) {
    const Matrix added = power * X * power.transpose();
    X += added;
    if (added.norm() <= std::numeric_limits<double>::epsilon() * X.norm()) break;
    power = (power * power).eval();
  }
  return 0.5 * (X + X.transpose());
}

}  // namespace consort
