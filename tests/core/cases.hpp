#pragma once
/// Random cases for the property tests of the core.

#include "core/network/graph.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

namespace consort::cases {

constexpr std::uint64_t kSeeds = 200;

/// Every edge with `probability`, weights in [0.5, 2).
inline Graph random_graph(Stream& stream, std::size_t agents, double probability) {
  std::vector<WeightedEdge> edges;
  for (std::size_t i = 0; i < agents; ++i) {
    for (std::size_t j = 0; j < agents; ++j) {
      if (i != j && stream.uniform() < probability) edges.push_back({{agent_at(j), agent_at(i)}, stream.uniform(0.5, 2.0)});
    }
  }
  return Graph(agents, edges);
}

template <class T>
void shuffle(Stream& stream, std::vector<T>& items) {
  for (std::size_t i = items.size(); i > 1; --i) std::swap(items[i - 1], items[stream.below(i)]);
}

/// A permutation of 0..n-1.
inline std::vector<std::size_t> random_order(Stream& stream, std::size_t n) {
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), 0U);
  shuffle(stream, order);
  return order;
}

/// The same graph with agent i called order[i] (positions).
inline Graph relabelled(const Graph& graph, const std::vector<std::size_t>& order) {
  std::vector<WeightedEdge> edges = graph.edges();
  for (auto& [edge, weight] : edges) edge = {agent_at(order[index_of(edge.from)]), agent_at(order[index_of(edge.to)])};
  return Graph(graph.agents(), edges);
}

inline Edge edge(std::uint32_t from, std::uint32_t to) { return {AgentId{from}, AgentId{to}}; }

}  // namespace consort::cases
