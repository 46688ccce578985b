#pragma once
/// Random systems that satisfy the assumptions of the distributed observer.

#include "protocols/everybody/observed_system.hpp"

#include <vector>

namespace consort {

/// Two to five agents of one to three states, coupled along their numbers, strongly connected, any of the three weights.
inline ObservedSystem random_observed_system(Stream& stream) {
  const std::size_t m = 2 + stream.below(4);
  ObservedSystem system;
  const auto random = [&](Eigen::Index rows, Eigen::Index cols) {
    return Matrix(Matrix::NullaryExpr(rows, cols, [&] { return stream.uniform(-1.0, 1.0); }));
  };
  for (std::size_t i = 0; i < m; ++i) {
    const auto n = 1 + static_cast<Eigen::Index>(stream.below(3)), p = 1 + static_cast<Eigen::Index>(stream.below(2));
    ObservedAgent agent{random(n, n), random(n, 1), random(p, n), random(n, p)};
    for (std::size_t l = 0; l < i; ++l) {
      const Eigen::Index n_l = system.agents[l].A.rows();
      if (stream.uniform() < 0.4) agent.A_from[agent_at(l)] = random(n, n_l);
      if (stream.uniform() < 0.4) agent.C_from[agent_at(l)] = random(p, n_l);
    }
    system.agents.push_back(agent);
  }
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < m; ++i)
    for (std::size_t j = 0; j < m; ++j)
      if (i != j && (j == (i + 1) % m || stream.uniform() < 0.4)) edges.push_back({agent_at(i), agent_at(j)});
  system.communication = Graph(m, std::span<const Edge>(edges));
  system.weights = static_cast<ConsensusWeights>(stream.below(3));
  system.mu = stream.uniform(0.5, 20.0);
  return system;
}

}  // namespace consort
