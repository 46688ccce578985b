#include "core/network/graph_witness.hpp"

#include <gtest/gtest.h>

#include <set>

namespace consort {
namespace {

TEST(GraphWitness, ACycleIsOneAndIsFoundExactlyIfThereIsOne) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    const std::size_t n = 1 + seed % 7;
    const Graph graph = erdos_renyi(n, 0.25, true, Seed{seed});
    const auto cycle = some_cycle(graph);
    // acyclic if and only if the adjacency matrix is nilpotent
    Matrix power = Matrix::Identity(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n));
    for (std::size_t k = 0; k < n; ++k) power *= adjacency(graph);
    ASSERT_EQ(cycle.empty(), power.isZero(0.0));
    if (cycle.empty()) continue;
    ASSERT_EQ(cycle.front(), cycle.back());
    for (std::size_t s = 0; s + 1 < cycle.size(); ++s) EXPECT_TRUE(graph.has({cycle[s], cycle[s + 1]}));
    EXPECT_EQ(std::set<AgentId>(cycle.begin(), cycle.end()).size(), cycle.size() - 1);
  }
  const auto ring_of_three = some_cycle(directed_ring(3));
  EXPECT_EQ(ring_of_three, (std::vector<AgentId>{AgentId{1}, AgentId{2}, AgentId{3}, AgentId{1}})) << "in the direction of the edges";
}

TEST(GraphWitness, AnUnreachedAgentIsFoundExactlyIfNotStronglyConnected) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    const std::size_t n = 1 + seed % 7;
    const Graph graph = erdos_renyi(n, 0.4, true, Seed{seed});
    const auto edge = some_unreached(graph);
    ASSERT_EQ(edge.has_value(), !strongly_connected(graph));
    if (!edge) continue;
    const auto size = static_cast<Eigen::Index>(n);
    Matrix reach = Matrix::Identity(size, size);
    for (std::size_t k = 0; k < n; ++k) reach += adjacency(graph) * reach;
    EXPECT_EQ(reach(static_cast<Eigen::Index>(index_of(edge->to)), static_cast<Eigen::Index>(index_of(edge->from))), 0.0);
  }
}

}  // namespace
}  // namespace consort
