#include "core/network/graph.hpp"

#include "tests/core/cases.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace consort {
namespace {

using cases::edge;

Graph of_edges(std::size_t agents, std::vector<Edge> edges) { return Graph(agents, std::span<const Edge>(edges)); }
Graph of_weighted(std::size_t agents, std::vector<WeightedEdge> edges) { return Graph(agents, std::span<const WeightedEdge>(edges)); }

TEST(Graph, ListsInNeighboursAscendingWithTheirWeights) {
  const Graph graph = of_weighted(4, {{edge(4, 1), 0.5}, {edge(2, 1), 2.0}, {edge(1, 3), 3.0}});
  const auto row = graph.in_neighbours(AgentId{1});
  ASSERT_EQ(row.size(), 2U);
  EXPECT_EQ(row[0], (Neighbour{AgentId{2}, 2.0}));
  EXPECT_EQ(row[1], (Neighbour{AgentId{4}, 0.5}));
  EXPECT_EQ(graph.in_degree(AgentId{2}), 0U);
  EXPECT_EQ(graph.out_degree(AgentId{1}), 1U);
  EXPECT_EQ(graph.out_degree(AgentId{3}), 0U);
  EXPECT_TRUE(graph.has(edge(1, 3)));
  EXPECT_FALSE(graph.has(edge(3, 1)));
  EXPECT_EQ(graph.edge_count(), 3U);
}

TEST(Graph, KeepsTheLastWeightOfARepeatedEdge) {
  const Graph graph = of_weighted(2, {{edge(2, 1), 1.0}, {edge(1, 2), 5.0}, {edge(2, 1), 3.0}, {edge(2, 1), 2.0}});
  EXPECT_EQ(graph, of_weighted(2, {{edge(2, 1), 2.0}, {edge(1, 2), 5.0}}));
  EXPECT_EQ(graph.out_degree(AgentId{2}), 1U);
}

TEST(Graph, RefusesWhatIsNoGraph) {
  EXPECT_THROW(of_edges(2, {edge(1, 3)}), ContractViolation);
  EXPECT_THROW(of_edges(2, {edge(0, 1)}), ContractViolation);
  EXPECT_THROW(of_edges(2, {edge(1, 1)}), ContractViolation);
  for (const double weight : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(of_weighted(2, {{edge(1, 2), weight}}), ContractViolation);
  }
  EXPECT_THROW((void)Graph().in_neighbours(AgentId{1}), ContractViolation);
  EXPECT_THROW((void)ring(3).out_degree(AgentId{4}), ContractViolation);
  EXPECT_THROW((void)ring(3).in_neighbours(AgentId{0}), ContractViolation);
}

TEST(Graph, WithoutAgentsIsEmpty) {
  EXPECT_EQ(Graph(), of_edges(0, {}));
  EXPECT_EQ(Graph().agents(), 0U);
  EXPECT_TRUE(Graph().edges().empty());
}

TEST(Graph, IsTheSameForEveryOrderOfItsEdges) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"edge order"});
    const Graph graph = cases::random_graph(stream, 1 + stream.below(9), stream.uniform());
    std::vector<WeightedEdge> edges = graph.edges();
    cases::shuffle(stream, edges);
    ASSERT_EQ(of_weighted(graph.agents(), edges), graph);
    std::size_t listeners = 0;
    for (std::size_t i = 0; i < graph.agents(); ++i) listeners += graph.out_degree(agent_at(i));
    ASSERT_EQ(listeners, graph.edge_count());
    ASSERT_EQ(from_adjacency(adjacency(graph)), graph);
  }
}

TEST(Family, HasTheEdgesOfItsName) {
  EXPECT_EQ(directed_ring(3), of_edges(3, {edge(1, 2), edge(2, 3), edge(3, 1)}));
  EXPECT_EQ(path(3), of_edges(3, {edge(1, 2), edge(2, 1), edge(2, 3), edge(3, 2)}));
  EXPECT_EQ(star(3), of_edges(3, {edge(1, 2), edge(2, 1), edge(1, 3), edge(3, 1)}));
  EXPECT_EQ(ring(3), complete(3));
  EXPECT_EQ(ring(10).edge_count(), 20U);
  EXPECT_EQ(complete(10).edge_count(), 90U);
}

TEST(Family, OfOneOrTwoAgentsIsStillAGraph) {
  for (const auto family : {directed_ring, ring, path, star, complete}) {
    EXPECT_EQ(family(1), of_edges(1, {}));
    EXPECT_EQ(family(2), of_edges(2, {edge(1, 2), edge(2, 1)}));
    EXPECT_THROW(family(0), ConfigError);
  }
}

TEST(Family, RefusesParametersThatMakeNoSense) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double probability : {-0.1, 1.1, nan}) EXPECT_THROW(erdos_renyi(3, probability, false, Seed{1}), ConfigError);
  for (const double radius : {0.0, -1.0, nan}) EXPECT_THROW(random_geometric(3, radius, Seed{1}), ConfigError);
  EXPECT_THROW(erdos_renyi(0, 0.5, true, Seed{1}), ConfigError);
  EXPECT_THROW(random_geometric(0, 0.5, Seed{1}), ConfigError);
  EXPECT_THROW(from_adjacency(Matrix::Zero(2, 3)), ConfigError);
  EXPECT_THROW(from_adjacency(Matrix()), ConfigError);
  EXPECT_THROW(from_adjacency(Matrix::Identity(2, 2)), ConfigError);
  EXPECT_THROW(from_adjacency((Matrix(2, 2) << 0, -1, 0, 0).finished()), ConfigError);
  EXPECT_THROW(from_adjacency((Matrix(2, 2) << 0, nan, 0, 0).finished()), ConfigError);
}

TEST(ErdosRenyi, HasTheExpectedNumberOfEdges) {
  constexpr double kPairs = 100 * 99 / 2;
  EXPECT_NEAR(static_cast<double>(erdos_renyi(100, 0.3, true, Seed{5}).edge_count()), 2 * kPairs * 0.3, 5 * std::sqrt(2 * kPairs * 0.21));
  const Graph symmetric = erdos_renyi(100, 0.3, false, Seed{5});
  EXPECT_NEAR(static_cast<double>(symmetric.edge_count()) / 2, kPairs * 0.3, 5 * std::sqrt(kPairs * 0.21));
  EXPECT_TRUE(undirected(symmetric));
  EXPECT_FALSE(undirected(erdos_renyi(100, 0.3, true, Seed{5})));
  EXPECT_EQ(erdos_renyi(6, 1.0, false, Seed{1}), complete(6));
  EXPECT_EQ(erdos_renyi(6, 0.0, true, Seed{1}).edge_count(), 0U);
}

TEST(RandomGeometric, JoinsMoreWithALargerRadiusAndAllWithTheDiagonal) {
  EXPECT_EQ(random_geometric(20, 1.4143, Seed{1}), complete(20));
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const Graph near = random_geometric(12, 0.3, Seed{seed});
    const Graph far = random_geometric(12, 0.5, Seed{seed});
    ASSERT_TRUE(undirected(near));
    ASSERT_EQ(union_of(std::vector{near, far}), far);
  }
}

TEST(RandomFamily, DrawsTheSameWhenMoreAgentsJoin) {
  const auto among_first = [](const Graph& graph, std::size_t agents) {
    std::vector<WeightedEdge> edges = graph.edges();
    std::erase_if(edges, [&](const WeightedEdge& e) { return e.edge.from.value > agents || e.edge.to.value > agents; });
    return of_weighted(agents, edges);
  };
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    ASSERT_EQ(among_first(erdos_renyi(15, 0.4, true, Seed{seed}), 9), erdos_renyi(9, 0.4, true, Seed{seed}));
    ASSERT_EQ(among_first(erdos_renyi(15, 0.4, false, Seed{seed}), 9), erdos_renyi(9, 0.4, false, Seed{seed}));
    ASSERT_EQ(among_first(random_geometric(15, 0.4, Seed{seed}), 9), random_geometric(9, 0.4, Seed{seed}));
  }
}

TEST(Union, TakesEveryEdgeWithItsLargestWeight) {
  const std::vector<Graph> graphs{of_weighted(3, {{edge(1, 2), 2.0}}), of_weighted(3, {{edge(1, 2), 1.0}, {edge(2, 3), 4.0}}),
                                  of_weighted(3, {{edge(1, 2), 1.5}})};
  EXPECT_EQ(union_of(graphs), of_weighted(3, {{edge(1, 2), 2.0}, {edge(2, 3), 4.0}}));
  EXPECT_EQ(union_of({}), Graph());
  EXPECT_THROW(union_of(std::vector{ring(3), ring(4)}), ContractViolation);
}

}  // namespace
}  // namespace consort
