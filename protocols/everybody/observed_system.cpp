#include "protocols/everybody/observed_system.hpp"

#include "core/errors.hpp"
#include "core/math/decompositions.hpp"
#include "core/math/discretise.hpp"
#include "core/math/schur.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace consort {
namespace {

constexpr AgentId agent(std::size_t index) { return agent_at(index); }

// The plant's matrix without its inputs, A = [A_ij], for one copy of all states.
Matrix dynamics(const ObservedSystem& system) {
  Matrix A = Matrix::Zero(system.states(), system.states());
  const auto at = [&](AgentId j) { return system.at_hat(agent(0), j); };
  for (std::size_t j = 0; j < system.agents.size(); ++j) {
    const ObservedAgent& own = system.agents[j];
    A.block(at(agent(j)), at(agent(j)), own.A.rows(), own.A.rows()) = own.A;
    for (const auto& [l, A_jl] : own.A_from) A.block(at(agent(j)), at(l), A_jl.rows(), A_jl.cols()) = A_jl;
  }
  return A;
}

// The part of R that every agent can compute for itself: hat^(i)' and bar_i' without consensus and measurements.
Matrix prediction(const ObservedSystem& system) {
  Matrix out = Matrix::Zero(system.error_size(), system.error_size());
  const Matrix A = dynamics(system);
  for (std::size_t i = 0; i < system.agents.size(); ++i) {
    const ObservedAgent& own = system.agents[i];
    out.block(system.at_hat(agent(i), agent(0)), system.at_hat(agent(i), agent(0)), A.rows(), A.cols()) = A;
    const Eigen::Index bar = system.at_bar(agent(i)), n = own.A.rows();
    out.block(bar, bar, n, n) = own.A;
    for (const auto& [l, A_il] : own.A_from) out.block(bar, system.at_hat(agent(i), l), n, A_il.cols()) = A_il;
  }
  return out;
}

// The part of R that measurements make: -F_i (C_ii bar_i + sum_l C_il hat_l^(i)).
Matrix correction(const ObservedSystem& system) {
  Matrix out = Matrix::Zero(system.error_size(), system.error_size());
  for (std::size_t i = 0; i < system.agents.size(); ++i) {
    const ObservedAgent& own = system.agents[i];
    const Eigen::Index bar = system.at_bar(agent(i)), n = own.A.rows();
    if (own.C.rows() > 0) out.block(bar, bar, n, n) = -own.F * own.C;
    for (const auto& [l, C_il] : own.C_from) out.block(bar, system.at_hat(agent(i), l), n, C_il.cols()) = -own.F * C_il;
  }
  return out;
}

// Adds the consensus terms; `gain(d)` stands before a sum whose weights sum to d.
template <class Gain>
void add_consensus(const ObservedSystem& system, Gain&& gain, Matrix& out) {
  const std::size_t m = system.agents.size();
  for (std::size_t j = 0; j < m; ++j) {
    const Eigen::Index n = system.agents[j].A.rows();
    const Matrix S = consensus_matrix(system.communication, agent(j), system.weights);
    for (std::size_t i = 0; i < m; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const double g = gain(S(row, row));
      const Eigen::Index at = system.at_hat(agent(i), agent(j));
      for (std::size_t l = 0; l < m; ++l)
        out.block(at, system.at_hat(agent(l), agent(j)), n, n).diagonal().array() -= g * S(row, static_cast<Eigen::Index>(l));
      // S 1 = O: what is missing in the row is bar_j.
      if (i == j) out.block(at, system.at_bar(agent(j)), n, n).diagonal().array() += g * S.row(row).sum();
    }
  }
}

// mu d of every error, the largest among those that move together.
Vector relaxation_rates(const ObservedSystem& system) {
  std::vector<Edge> couplings;
  for (std::size_t j = 0; j < system.agents.size(); ++j)
    for (const auto& [l, A_jl] : system.agents[j].A_from) couplings.push_back({l, agent(j)});
  const std::size_t m = system.agents.size();
  const std::vector<std::size_t> group = coupled_groups(m, couplings);
  Matrix rate = Matrix::Zero(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(m));  // agent x group
  for (std::size_t j = 0; j < m; ++j) {
    auto of_group = rate.col(static_cast<Eigen::Index>(group[j]));
    of_group = of_group.cwiseMax(system.mu * consensus_matrix(system.communication, agent(j), system.weights).diagonal()).eval();
  }
  Vector out(system.error_size());
  for (std::size_t i = 0; i < m; ++i) {
    for (std::size_t j = 0; j < m; ++j)
      out.segment(system.at_hat(agent(i), agent(j)), system.agents[j].A.rows())
          .setConstant(rate(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(group[j])));
    out.segment(system.at_bar(agent(i)), system.agents[i].A.rows())
        .setConstant(rate(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(group[i])));
  }
  return out;
}

// [E; M] with N E what drives the errors beside the model, and M the N of the round before, moved along:
//     E+ = P (E + now N E + growth (N E - M)),    M+ = P (N E - rate (what was added to E))
Matrix second_order_matrix(const ObservedSystem& system, Seconds h) {
  const Eigen::Index size = system.error_size();
  const Matrix P = matrix_exponential(prediction(system), h), I = Matrix::Identity(size, size),
               N = error_matrix(system) - prediction(system);
  const Vector rate = relaxation_rates(system);
  const auto now = rate.unaryExpr([&](double r) { return relaxation(r, h).now; }).asDiagonal();
  const auto growth = rate.unaryExpr([&](double r) { return relaxation(r, h).growth; }).eval();
  const Matrix added = now * N + growth.asDiagonal() * N;
  Matrix step(2 * size, 2 * size);
  step << P * (I + added), -(P * growth.asDiagonal()),  //
      P * (N - rate.asDiagonal() * added), P * rate.cwiseProduct(growth).asDiagonal();
  return step;
}

}  // namespace

Relaxation relaxation(double rate, Seconds h) {
  const double x = rate * h;
  if (x < 1e-5) return {h * (1.0 - x / 2.0), h * (0.5 - x / 6.0)};  // the next terms are below rounding, the differences would not be
  const Seconds now = -std::expm1(-x) / rate;
  return {now, (h - now) / x};
}

std::vector<std::size_t> coupled_groups(std::size_t agents, const std::vector<Edge>& couplings) {
  std::vector<std::size_t> group(agents);
  std::iota(group.begin(), group.end(), std::size_t{0});
  for (const Edge& edge : couplings) {
    const std::size_t from = group[index_of(edge.from)], to = group[index_of(edge.to)];
    std::replace(group.begin(), group.end(), from, to);
  }
  return group;
}

double consensus_weight(ConsensusWeights rule, double edge, std::size_t heard, std::size_t listeners) {
  switch (rule) {
    case ConsensusWeights::binary:
      return edge;
    case ConsensusWeights::in_degree:
      return edge / static_cast<double>(heard);
    case ConsensusWeights::out_degree:
      return edge / static_cast<double>(listeners);
  }
  return edge;
}

Matrix consensus_matrix(const Graph& communication, AgentId j, ConsensusWeights rule) {
  const std::size_t m = communication.agents();
  Matrix S = Matrix::Zero(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(m));
  for (std::size_t i = 0; i < m; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const auto neighbours = communication.in_neighbours(agent(i));
    const std::size_t heard = neighbours.size() + (agent(i) == j ? 1 : 0);
    for (const Neighbour& l : neighbours) {
      const double w = consensus_weight(rule, l.weight, heard, communication.out_degree(l.id));
      S(row, row) += w;
      S(row, static_cast<Eigen::Index>(index_of(l.id))) -= w;
    }
    if (agent(i) == j) S(row, row) += consensus_weight(rule, 1.0, heard, 1);
  }
  return S;
}

ConsensusSpectrum consensus_spectrum(const Graph& communication, ConsensusWeights rule) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  ConsensusSpectrum smallest{kInfinity, kInfinity};
  for (std::size_t j = 0; j < communication.agents(); ++j) {
    for (const auto& lambda : eigenvalues_of(consensus_matrix(communication, agent(j), rule))) {
      smallest.smallest_modulus = std::min(smallest.smallest_modulus, std::abs(lambda));
      smallest.smallest_real = std::min(smallest.smallest_real, lambda.real());
    }
  }
  return smallest;
}

Eigen::Index ObservedSystem::states() const {
  Eigen::Index sum = 0;
  for (const ObservedAgent& a : agents) sum += a.A.rows();
  return sum;
}
Eigen::Index ObservedSystem::error_size() const { return (static_cast<Eigen::Index>(agents.size()) + 1) * states(); }
Eigen::Index ObservedSystem::at_hat(AgentId i, AgentId j) const {
  Eigen::Index at = static_cast<Eigen::Index>(index_of(i)) * states();
  for (std::size_t l = 0; l < index_of(j); ++l) at += agents[l].A.rows();
  return at;
}
Eigen::Index ObservedSystem::at_bar(AgentId i) const { return at_hat(agent(agents.size()), i); }

Matrix error_matrix(const ObservedSystem& system) {
  check(system.communication.agents() == system.agents.size(), "an observed system has one communication graph over all its agents");
  Matrix R = prediction(system) + correction(system);
  add_consensus(
      system, [&](double) { return system.mu; }, R);
  return R;
}

Matrix sampled_error_matrix(const ObservedSystem& system, Seconds h) {
  check(system.communication.agents() == system.agents.size(), "an observed system has one communication graph over all its agents");
  if (system.scheme == SampledScheme::second_order) return second_order_matrix(system, h);
  Matrix correct = Matrix::Identity(system.error_size(), system.error_size()) + h * correction(system);
  add_consensus(
      system, [&](double d) { return d > 0.0 ? -std::expm1(-system.mu * d * h) / d : 0.0; }, correct);
  return matrix_exponential(prediction(system), h) * correct;
}

Matrix unknown_input_matrix(const ObservedSystem& system) {
  Eigen::Index inputs = 0;
  for (const ObservedAgent& a : system.agents) inputs += a.B.cols();
  Matrix D = Matrix::Zero(system.error_size(), inputs);
  Eigen::Index column = 0;
  for (std::size_t j = 0; j < system.agents.size(); ++j) {
    const Matrix& B = system.agents[j].B;
    for (std::size_t i = 0; i < system.agents.size(); ++i)
      if (i != j) D.block(system.at_hat(agent(i), agent(j)), column, B.rows(), B.cols()) = -B;
    column += B.cols();
  }
  return D;
}

std::optional<ErrorDecay> error_decay(const Matrix& R) {
  constexpr double kShare = 0.9, kTimeConstants = 20.0;
  constexpr int kSamples = 1000;
  const double slowest = -spectral_abscissa(R);
  if (!(slowest > 0.0)) return std::nullopt;
  ErrorDecay decay{kShare * slowest, 1.0};
  const double h = kTimeConstants / decay.eta / kSamples;
  const Matrix step = matrix_exponential(R, h) * std::exp(decay.eta * h);
  Matrix scaled = Matrix::Identity(R.rows(), R.cols());
  for (int k = 0; k < kSamples; ++k) {
    scaled = step * scaled;
    decay.kappa = std::max(decay.kappa, spectral_norm(scaled));
  }
  return decay;
}

double ultimate_bound(const ErrorDecay& decay, double input_norm, double ubar) { return decay.kappa * input_norm * ubar / decay.eta; }

double undirected_consensus_bound(const Graph& communication) {
  const double m = static_cast<double>(communication.agents()), lambda_2 = algebraic_connectivity(communication);
  return std::pow(lambda_2 / (lambda_2 + 1.0), m - 1.0) / m;
}

double directed_consensus_bound(std::size_t m) {
  const double n = static_cast<double>(m);
  // 1 - (1 - x)^(1/m) with x = 1 / (m + 1)!, which is far too small to be subtracted from one
  return -std::expm1(std::log1p(-1.0 / std::tgamma(n + 2.0)) / n);
}

double undirected_gain(std::size_t m, double rho) {
  const double n = static_cast<double>(m);
  return rho * std::pow((n * n - n + 4.0) / 4.0, n - 1.0) * n;
}

double directed_gain(std::size_t m, double rho) { return rho / directed_consensus_bound(m); }

double smallest_whole_above(double bound) { return std::floor(bound) + 1.0; }

}  // namespace consort
