#pragma once
/// The fixture of the estimators of Knotek, thesis, section 3.1: an oscillator seen by four agents on an undirected ring, and two
/// oscillators of which the agents see the first, the second, both and nothing.

#include "core/network/graph.hpp"
#include "protocols/filters/estimator_network.hpp"

#include <cmath>
#include <vector>

namespace consort::oscillator {

inline Matrix A() { return (Matrix(2, 2) << 0, 1, -1, 0).finished(); }
inline Matrix Q() { return 0.1 * Matrix::Identity(2, 2); }
inline std::vector<Matrix> C() {
  const double s = std::sqrt(0.5);
  return {(Matrix(1, 2) << 1, 0).finished(), (Matrix(1, 2) << 0, 1).finished(), (Matrix(1, 2) << s, s).finished(),
          (Matrix(1, 2) << 1, 0).finished()};
}
inline std::vector<double> R() { return {0.5, 1, 0.8, 0.2}; }
inline Sensor sensor_of(std::size_t i) { return sensor(C()[i], Matrix::Constant(1, 1, R()[i])); }
/// C_j'R_j^-1 C_j of all agents, or of agent i and its in-neighbours.
inline Matrix seen_by_all() {
  Matrix U = Matrix::Zero(2, 2);
  for (std::size_t i = 0; i < 4; ++i) U += sensor_of(i).U;
  return U;
}
inline Matrix seen_around(const Graph& graph, std::size_t i) {
  Matrix U = sensor_of(i).U;
  for (const Neighbour& j : graph.in_neighbours(agent_at(i))) U += sensor_of(index_of(j.id)).U;
  return U;
}

/// Filters coupled by (3.7c), with the oscillator's process noise.
inline std::vector<CoupledFilter> coupled(const std::vector<Matrix>& U, double k) {
  std::vector<CoupledFilter> filters;
  for (const Matrix& own : U) filters.push_back({own, Q(), k});
  return filters;
}

inline Matrix two() {
  Matrix A = Matrix::Zero(4, 4);
  A(0, 1) = 1;
  A(1, 0) = -1;
  A(2, 3) = 2;
  A(3, 2) = -2;
  return A;
}
/// Agent 4 measures nothing.
inline std::vector<Matrix> two_seen() {
  return {(Matrix(1, 4) << 1, 0, 0, 0).finished(), (Matrix(1, 4) << 0, 0, 1, 0).finished(), (Matrix(1, 4) << 1, 0, 1, 0).finished(),
          Matrix(0, 4)};
}

}  // namespace consort::oscillator
