#include "protocols/sensor_network/errors.hpp"

#include "core/errors.hpp"
#include "core/math/decompositions.hpp"
#include "core/math/discretise.hpp"
#include "core/math/lyapunov.hpp"
#include "core/math/schur.hpp"
#include "core/number_text.hpp"
#include "protocols/sensor_network/design.hpp"

#include <algorithm>
#include <limits>
#include <string>

namespace consort {
namespace {

// Blocks of one agent's size in a matrix of the whole network.
Eigen::Block<Matrix> block_of(Matrix& whole, std::size_t i, std::size_t j, Eigen::Index n) {
  return whole.block(static_cast<Eigen::Index>(i) * n, static_cast<Eigen::Index>(j) * n, n, n);
}

double in_degree(const Graph& graph, AgentId i) {
  double d = 0.0;
  for (const Neighbour& j : graph.in_neighbours(i)) d += j.weight;
  return d;
}

// Adds S_i sum_j w_ij (e_j - e_i) to the rows of agent i.
void add_coupling(Matrix& whole, const Graph& graph, AgentId i, const Matrix& S) {
  const Eigen::Index n = S.rows();
  for (const Neighbour& j : graph.in_neighbours(i)) block_of(whole, index_of(i), index_of(j.id), n) += j.weight * S;
  block_of(whole, index_of(i), index_of(i), n) -= in_degree(graph, i) * S;
}

// By agent: whether it reaches `to` (itself included).
std::vector<char> ancestors(const Graph& graph, AgentId to) {
  std::vector<char> reached(graph.agents(), 0);
  std::vector<AgentId> queue{to};
  reached[index_of(to)] = 1;
  while (!queue.empty()) {
    const AgentId at = queue.back();
    queue.pop_back();
    for (const Neighbour& j : graph.in_neighbours(at)) {
      if (reached[index_of(j.id)] != 0) continue;
      reached[index_of(j.id)] = 1;
      queue.push_back(j.id);
    }
  }
  return reached;
}

Vector symmetric_part_spectrum(const Matrix& a) { return symmetric_eigenvalues(a + a.transpose()); }

[[noreturn]] void refuse_unstable(const std::string& what, const std::string& found) {
  throw ConfigError("the network of observers has no stationary covariance: " + what + " is " + found);
}

}  // namespace

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

std::vector<std::vector<AgentId>> leader_groups(const Graph& graph) {
  std::vector<std::vector<char>> reaches_me;
  for (std::size_t i = 0; i < graph.agents(); ++i) reaches_me.push_back(ancestors(graph, agent_at(i)));
  std::vector<std::vector<AgentId>> groups;
  std::vector<char> placed(graph.agents(), 0);
  for (std::size_t i = 0; i < graph.agents(); ++i) {
    if (placed[i] != 0) continue;
    std::vector<AgentId> group;
    bool leads = true;
    for (std::size_t j = 0; j < graph.agents(); ++j) {
      if (reaches_me[i][j] == 0) continue;
      leads = leads && reaches_me[j][i] != 0;
      group.push_back(agent_at(j));
    }
    if (!leads) continue;
    for (const AgentId agent : group) placed[index_of(agent)] = 1;
    groups.push_back(std::move(group));
  }
  return groups;
}

GammaBounds gamma_bounds(const Matrix& A, const Graph& graph, const std::vector<AgentId>& leaders) {
  std::vector<Eigen::Index> in, out;
  for (std::size_t i = 0; i < graph.agents(); ++i)
    (std::find(leaders.begin(), leaders.end(), agent_at(i)) != leaders.end() ? in : out).push_back(static_cast<Eigen::Index>(i));
  const Matrix L = laplacian(graph);
  const double growth = std::max(0.0, symmetric_part_spectrum(A).maxCoeff());
  GammaBounds bounds;
  if (in.size() > 1) {
    const Vector w = left_null_vector(graph)(in);
    bounds.balance = w.minCoeff() / w.maxCoeff();
    // w_max lambda_max(A + A') / lambda_min>0(W L + L'W); the smallest eigenvalue is the zero of 1                          (3.83)
    bounds.leaders = w.maxCoeff() * growth / symmetric_part_spectrum(w.asDiagonal() * L(in, in))[1];
  }
  if (!out.empty()) {
    // L(out, out) is L~ + G~, with what they hear of the leaders as pinning; theta = (L~ + G~)^-T 1                          (3.84)
    const Matrix pinned = L(out, out);
    const Vector theta =
        solve(pinned.transpose(), Vector(Vector::Ones(pinned.rows())), "the Laplacian of who senses nothing, pinned by who does");
    bounds.followers = theta.maxCoeff() * growth / symmetric_part_spectrum(theta.asDiagonal() * pinned)[0];
  }
  return bounds;
}

Matrix discrete_lyapunov(const Matrix& A, const Matrix& Q) {
  const double radius = spectral_radius(A);
  if (!(radius < 1.0)) refuse_unstable("the spectral radius of a step", number_text(radius));
  // X_m = sum of A^k Q A'^k over k < 2^m: X_(m+1) = X_m + A^(2^m) X_m A'^(2^m)  (Smith 1968)
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
