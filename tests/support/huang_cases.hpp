#pragma once
/// The systems of Huang et al. 2025, section 5, with the graphs it leaves to figures chosen (fixtures): as whole systems, for theory.

#include "protocols/everybody/acyclic_graph.hpp"
#include "protocols/everybody/observed_system.hpp"

#include <initializer_list>
#include <utility>
#include <vector>

namespace consort::huang {

inline Graph graph(std::size_t agents, std::initializer_list<std::pair<unsigned, unsigned>> sender_receiver) {
  std::vector<Edge> edges;
  for (const auto& [from, to] : sender_receiver) edges.push_back({AgentId{from}, AgentId{to}});
  return Graph(agents, std::span<const Edge>(edges));
}

inline const Matrix kA11{{1.2, 1.0}, {0.0, 0.8}};
inline const Matrix kF1 = Vector{{4.2, 4.8}}.asDiagonal();

/// 5.1, three agents that differ (given); `communication`: directed ring 1 -> 2 -> 3 -> 1 unless said otherwise (fixture).
inline ObservedSystem different(Graph communication = graph(3, {{1, 2}, {2, 3}, {3, 1}})) {
  const auto one = [](double value) { return Matrix::Constant(1, 1, value).eval(); };
  const Matrix I = Matrix::Identity(2, 2);
  ObservedAgent second{one(1.03), one(1.0), one(1.0), one(3.0)};
  second.A_from[AgentId{1}] = Matrix{{0.8, 1.0}};
  second.C_from[AgentId{1}] = Matrix{{0.8, 1.2}};
  return {{{kA11, I, I, kF1}, second, {one(0.3), one(1.0), one(1.0), one(2.0)}}, std::move(communication), ConsensusWeights::binary, 10.0};
}
/// Its initial states one after the other (given).
inline Vector different_start() { return Vector{{.5, -.5, .5, .5}}; }

/// 5.1 with agents that are alike (given): C_21 = C_32 = diag(1.2, .8), as far as both agents are there; weights (11), mu = 572.
/// `couplings` as (measured, measuring).
inline ObservedSystem alike(std::size_t agents, std::initializer_list<std::pair<unsigned, unsigned>> couplings, Graph communication) {
  const Matrix I = Matrix::Identity(2, 2), C = Vector{{1.2, .8}}.asDiagonal();
  ObservedSystem system{{}, std::move(communication), ConsensusWeights::in_degree, 572.0};
  for (std::size_t i = 0; i < agents; ++i) system.agents.push_back({kA11, I, I, kF1});
  for (const auto& [measured, measuring] : couplings) system.agents[measuring - 1].C_from[AgentId{measured}] = C;
  return system;
}
inline ObservedSystem alike_three() { return alike(3, {{1, 2}, {2, 3}}, graph(3, {{1, 2}, {2, 3}, {3, 1}})); }
inline ObservedSystem alike_joined() { return alike(4, {{1, 2}, {2, 3}, {3, 4}}, graph(4, {{1, 2}, {2, 3}, {3, 4}, {4, 1}})); }
inline ObservedSystem alike_left() { return alike(2, {}, graph(2, {{1, 2}, {2, 1}})); }  // agents 1 and 3

/// The error of everybody who starts from nothing: minus the truth, for m estimates and the second one of oneself.
inline Vector start_error(const ObservedSystem& system, const Vector& x) {
  return -x.replicate(static_cast<Eigen::Index>(system.agents.size()) + 1, 1);
}

/// [E; M] in round 0, where N has not grown: M is N E.
inline Vector second_order_start(const ObservedSystem& system, const Vector& e) {
  ObservedSystem model = system;
  model.mu = 0.0;
  for (ObservedAgent& agent : model.agents) agent.F.setZero();
  Vector out(2 * e.size());
  out << e, (error_matrix(system) - error_matrix(model)) * e;
  return out;
}
inline ObservedSystem second_order(ObservedSystem system) {
  system.scheme = SampledScheme::second_order;
  return system;
}

/// 5.2 (given positions): six integrators in the plane; agents of an undirected ring (fixture).
inline Matrix positions() { return Matrix{{5, 7}, {3, 4}, {5, 2}, {10, 2}, {12, 4}, {10, 7}}; }
inline Graph ring_of_six() {
  return graph(6, {{1, 2}, {2, 1}, {2, 3}, {3, 2}, {3, 4}, {4, 3}, {4, 5}, {5, 4}, {5, 6}, {6, 5}, {6, 1}, {1, 6}});
}

/// Agents that localise each other over `uses` (user, other), each channel with gain F (n x n); agent 2 knows where it is (given).
inline ObservedSystem localisation(const Matrix& A, const Matrix& B, const Matrix& F,
                                   const std::vector<std::pair<unsigned, unsigned>>& uses) {
  const Eigen::Index n = A.rows();
  const Matrix I = Matrix::Identity(n, n);
  ObservedSystem system{{}, ring_of_six(), ConsensusWeights::binary, 1.0};
  for (unsigned i = 1; i <= 6; ++i) {
    ObservedAgent agent{A, B, Matrix(0, n), Matrix(n, 0)};
    const auto add = [&](AgentId other) {
      const Eigen::Index p = agent.C.rows();
      agent.C.conservativeResize(p + n, n);
      agent.C.bottomRows(n) = -I;
      agent.F.conservativeResize(n, p + n);
      agent.F.rightCols(n) = F;
      for (auto& [l, C_il] : agent.C_from) {
        C_il.conservativeResize(p + n, n);
        C_il.bottomRows(n).setZero();
      }
      if (other.value == 0) return;
      agent.C_from[other] = Matrix::Zero(p + n, n);
      agent.C_from[other].bottomRows(n) = I;
    };
    for (const auto& [user, other] : uses)
      if (user == i) add(AgentId{other});
    if (i == 2) add(AgentId{});
    system.agents.push_back(std::move(agent));
  }
  return system;
}
/// What DAGC makes of the sensing (measurer, measured) (1,2)(2,3)(4,3)(5,4)(6,5), absolute 2.
inline const std::vector<std::pair<unsigned, unsigned>> kUses{{1, 2}, {3, 2}, {4, 3}, {5, 4}, {6, 5}};
inline ObservedSystem localisation_single() {
  return localisation(Matrix::Zero(2, 2), Matrix::Identity(2, 2), Vector{{-1, -.5}}.asDiagonal(), kUses);
}
inline ObservedSystem localisation_double() {
  Matrix A = Matrix::Zero(4, 4), B = Matrix::Zero(4, 2);
  A.topRightCorner(2, 2).setIdentity();
  B.bottomRows(2).setIdentity();
  return localisation(A, B, -2.0 * Matrix::Identity(4, 4), kUses);
}
inline Vector localisation_start() {
  const Matrix transposed = positions().transpose();
  return Eigen::Map<const Vector>(transposed.data(), transposed.size());
}

}  // namespace consort::huang
