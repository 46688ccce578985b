#include "protocols/filters/stationary_gains.hpp"

#include "core/math/decompositions.hpp"
#include "protocols/luenberger.hpp"

#include <algorithm>

namespace consort {

double weighted_in_degree(const Graph& graph, AgentId agent) {
  double d = 0.0;
  for (const Neighbour& j : graph.in_neighbours(agent)) d += j.weight;
  return d;
}

std::vector<std::size_t> with_in_neighbours(const Graph& graph, std::size_t i, bool in_neighbours) {
  std::vector<std::size_t> all{i};
  if (in_neighbours)
    for (const Neighbour& j : graph.in_neighbours(agent_at(i))) all.push_back(index_of(j.id));
  return all;
}

Matrix StationaryGains::noise_weight(const char* name, std::size_t i, bool of_measurement) const {
  const Eigen::Index size = of_measurement ? C_[i].rows() : A_.rows();
  return size == 0 ? Matrix(0, 0) : parameters(i).covariance(name, size, {}, of_measurement);
}

Matrix StationaryGains::information_around(std::size_t i, bool in_neighbours) const {
  Matrix all = Matrix::Zero(A_.rows(), A_.rows());
  for (const std::size_t j : with_in_neighbours(graph_, i, in_neighbours)) all += sensor(C_[j], noise_weight("R", j, true)).U;
  return all;
}

EstimatorNetwork StationaryGains::network() const {
  if (kind_ == FilterKind::luenberger_kim || kind_ == FilterKind::luenberger_zhang) return luenberger_network();
  EstimatorNetwork network{A_, {}, {}};
  const bool kim = kind_ == FilterKind::kim, alone = kind_ == FilterKind::centralised;
  std::vector<Matrix> all_U, all_P;
  std::vector<CoupledFilter> coupled;
  for (std::size_t i = 0; i < C_.size(); ++i) {
    const bool aggregated = alone || (kind_ == FilterKind::olfati_saber && parameters(i).scalar("aggregated") == 1.0);
    all_U.push_back(information_around(i, aggregated));
    const Matrix Q = noise_weight("Q", i, false);
    if (kim)
      coupled.push_back({all_U[i], Q, parameters(i).scalar("k")});
    else
      all_P.push_back(stationary_covariance(A_, all_U[i], Q));
  }
  if (kim) all_P = coupled_covariances(A_, coupled, graph_);
  for (std::size_t i = 0; i < C_.size(); ++i) {
    network.injection.push_back(all_P[i] * all_U[i]);
    network.coupling.push_back(alone ? Matrix(Matrix::Zero(A_.rows(), A_.rows())) : Matrix(parameters(i).scalar("gamma") * all_P[i]));
  }
  return network;
}

EstimatorNetwork StationaryGains::luenberger_network() const {
  EstimatorNetwork network{A_, {}, {}};
  for (std::size_t i = 0; i < C_.size(); ++i) {
    const Matrix Q = noise_weight("Q", i, false), R = noise_weight("R", i, true);
    const Values own = parameters(i);
    const ObserverGains gains =
        kind_ == FilterKind::luenberger_kim
            ? kim_gains(A_, C_[i], Q, R, own.scalar("gamma"), own.scalar("k"))
            : zhang_gains(A_, C_[i], Q, R, own.scalar("c"), noise_weight("coupling_Q", i, false), noise_weight("coupling_R", i, false));
    network.injection.push_back(gains.L * C_[i]);
    network.coupling.push_back(gains.F);
  }
  return network;
}

std::pair<std::vector<IterativeFilter>, double> StationaryGains::iterative(const Matrix& step) const {
  std::vector<IterativeFilter> filters;
  double overshoot = 0.0;
  for (std::size_t i = 0; i < C_.size(); ++i) {
    const Matrix S = information_around(i, true), M = stationary_update(step, S, noise_weight("Q", i, false));
    double epsilon = parameters(i).scalar("epsilon");
    const double pulled = epsilon * weighted_in_degree(graph_, agent_at(i)) * symmetric_eigenvalues(M).maxCoeff();
    if (parameters(i).scalar("bounded") == 1.0 && pulled > 1.0)
      epsilon /= pulled;
    else
      overshoot = std::max(overshoot, pulled);
    filters.push_back({S, M, epsilon});
  }
  return {filters, overshoot};
}

}  // namespace consort
