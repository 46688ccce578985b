#include "core/network/graph.hpp"

#include "tests/core/cases.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace consort {
namespace {

using cases::edge;
using std::numbers::pi;

Graph of_edges(std::size_t agents, std::vector<Edge> edges) { return Graph(agents, std::span<const Edge>(edges)); }

/// Knotek 2019, Fig. 2.1.
Graph figure_2_1() {
  return of_edges(6, {edge(1, 2), edge(1, 3), edge(2, 3), edge(2, 4), edge(3, 1), edge(3, 5), edge(4, 6), edge(5, 6), edge(6, 2)});
}

/// Two directed circles of 25 joined by one link in either direction.
Graph two_circles() {
  std::vector<Edge> edges{edge(25, 26), edge(50, 1)};
  for (std::uint32_t i = 1; i <= 25; ++i) {
    edges.push_back(edge(i, i % 25 + 1));
    edges.push_back(edge(25 + i, 26 + i % 25));
  }
  return of_edges(50, edges);
}

void expect_real_spectrum(const Graph& graph, std::vector<double> expected) {
  std::sort(expected.begin(), expected.end());
  const auto spectrum = laplacian_spectrum(graph);
  ASSERT_EQ(spectrum.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(spectrum[i].real(), expected[i], 1e-10);
    EXPECT_EQ(spectrum[i].imag(), 0.0);
  }
}

TEST(Laplacian, HasZeroRowSums) {
  const Matrix l = laplacian(figure_2_1());
  EXPECT_EQ(Vector(l.rowwise().sum()), Vector(Vector::Zero(6)));
  EXPECT_EQ(Vector(l.diagonal()), (Vector(6) << 1, 2, 2, 1, 1, 2).finished());  // the thesis's D
}

TEST(Spectrum, OfUndirectedFamiliesIsTheAnalyticOne) {
  constexpr std::size_t kAgents = 10;
  std::vector<double> ring_values, path_values;
  for (std::size_t k = 0; k < kAgents; ++k) {
    ring_values.push_back(2 - 2 * std::cos(2 * pi * static_cast<double>(k) / kAgents));
    path_values.push_back(2 - 2 * std::cos(pi * static_cast<double>(k) / kAgents));
  }
  std::vector<double> star_values(kAgents, 1.0), complete_values(kAgents, 10.0);
  star_values[0] = complete_values[0] = 0.0;
  star_values[1] = 10.0;
  expect_real_spectrum(ring(kAgents), ring_values);
  expect_real_spectrum(path(kAgents), path_values);
  expect_real_spectrum(star(kAgents), star_values);
  expect_real_spectrum(complete(kAgents), complete_values);
}

TEST(Spectrum, OfTheDirectedRingLiesOnACircle) {
  const auto spectrum = laplacian_spectrum(directed_ring(6));
  ASSERT_EQ(spectrum.size(), 6U);
  double previous = -1.0;
  for (const auto& value : spectrum) {
    EXPECT_NEAR(std::abs(value - 1.0), 1.0, 1e-10);  // 1 - exp(2 pi i k / 6)
    EXPECT_GE(value.real(), previous - 1e-12);
    previous = value.real();
  }
}

// The static bound 1 / (2 min Re lambda) of the linear quadratic protocol.
TEST(AlgebraicConnectivity, GivesTheKnownBoundsOfTheCouplingGain) {
  EXPECT_NEAR(1 / (2 * algebraic_connectivity(ring(10))), 1.309017, 5e-7);
  EXPECT_NEAR(1 / (2 * algebraic_connectivity(ring(50))), 31.704569, 5e-7);
  EXPECT_NEAR(1 / (2 * algebraic_connectivity(directed_ring(6))), 1.0, 1e-12);
  EXPECT_NEAR(algebraic_connectivity(two_circles()), 0.032379, 5e-7);
  EXPECT_NEAR(1 / (2 * algebraic_connectivity(two_circles())), 15.4419, 5e-5);
}

TEST(AlgebraicConnectivity, IsZeroWithoutASpanningTree) {
  EXPECT_EQ(algebraic_connectivity(of_edges(4, {edge(1, 2), edge(2, 1), edge(3, 4), edge(4, 3)})), 0.0);
  EXPECT_EQ(algebraic_connectivity(of_edges(3, {edge(1, 3), edge(2, 3)})), 0.0);
  EXPECT_EQ(algebraic_connectivity(of_edges(1, {})), 0.0);
  EXPECT_EQ(algebraic_connectivity(Graph()), 0.0);
  EXPECT_NEAR(algebraic_connectivity(of_edges(3, {edge(1, 2), edge(2, 3)})), 1.0, 1e-7);  // triangular, 1 is a double, defective eigenvalue
}

TEST(Connectivity, TellsStrongFromSpanningTree) {
  const Graph chain = of_edges(3, {edge(1, 2), edge(2, 3)});
  EXPECT_TRUE(strongly_connected(directed_ring(5)));
  EXPECT_TRUE(strongly_connected(figure_2_1()));
  EXPECT_FALSE(strongly_connected(chain));
  EXPECT_TRUE(has_spanning_tree(chain));
  EXPECT_FALSE(has_spanning_tree(of_edges(3, {edge(1, 3), edge(2, 3)})));
  EXPECT_FALSE(has_spanning_tree(of_edges(2, {})));
  EXPECT_TRUE(strongly_connected(of_edges(1, {})));
  EXPECT_TRUE(has_spanning_tree(of_edges(1, {})));
  EXPECT_FALSE(strongly_connected(Graph()));
  EXPECT_FALSE(has_spanning_tree(Graph()));
  EXPECT_TRUE(strongly_connected(ring(1000)));
}

TEST(Balance, ComparesWeightedDegrees) {
  EXPECT_TRUE(balanced(directed_ring(5)));
  EXPECT_TRUE(balanced(ring(5)));
  EXPECT_TRUE(balanced(Graph()));
  EXPECT_TRUE(balanced(of_edges(3, {})));
  EXPECT_FALSE(balanced(figure_2_1()));
  const std::vector<WeightedEdge> uneven{{edge(1, 2), 1.0}, {edge(2, 1), 1.1}};
  EXPECT_FALSE(balanced(Graph(2, uneven)));
  EXPECT_FALSE(undirected(Graph(2, uneven)));
}

TEST(LeftNullVector, OfFigure21IsThePublishedOne) {
  const Vector w = left_null_vector(figure_2_1());
  const Vector expected = (Vector(6) << .384615, .153846, .230769, .076923, .076923, .076923).finished();
  EXPECT_LT((w - expected).cwiseAbs().maxCoeff(), 5e-7);
  EXPECT_NEAR(w.dot(Vector::LinSpaced(6, 1, 6)), 2.538462, 5e-7);
}

TEST(LeftNullVector, LivesOnTheAgentsThatReachEverybody) {
  // 2 <-> 3 feed 1 and 4; 2 listens twice as closely to 3 as 3 to 2.
  const std::vector<WeightedEdge> edges{{edge(3, 2), 2.0}, {edge(2, 3), 1.0}, {edge(2, 1), 1.0}, {edge(1, 4), 1.0}};
  const Vector w = left_null_vector(Graph(4, edges));
  EXPECT_EQ(w(0), 0.0);
  EXPECT_EQ(w(3), 0.0);
  EXPECT_DOUBLE_EQ(w(1), 1.0 / 3);
  EXPECT_DOUBLE_EQ(w(2), 2.0 / 3);
  EXPECT_EQ(left_null_vector(of_edges(1, {})), Vector(Vector::Ones(1)));
  EXPECT_THROW(left_null_vector(of_edges(2, {})), ContractViolation);
  EXPECT_THROW(left_null_vector(Graph()), ContractViolation);
}

TEST(LeftNullVector, KeepsRelativePrecisionAcrossManyMagnitudes) {
  // A chain whose stationary weights are 1, 1e-6, ..., 1e-24 of each other.
  std::vector<WeightedEdge> edges;
  for (std::uint32_t i = 1; i < 5; ++i) {
    edges.push_back({edge(i + 1, i), 1e-6});
    edges.push_back({edge(i, i + 1), 1.0});
  }
  const Vector w = left_null_vector(Graph(5, edges));
  for (Eigen::Index i = 1; i < 5; ++i) EXPECT_NEAR(w(i) / w(i - 1) * 1e6, 1.0, 1e-14);
}

/// Slow and simple: reachability by repeated multiplication.
bool reaches_all(const Graph& graph, std::size_t from) {
  std::vector<bool> reached(graph.agents(), false);
  reached[from] = true;
  for (std::size_t repeat = 0; repeat < graph.agents(); ++repeat) {
    for (const auto& [e, weight] : graph.edges()) {
      if (reached[index_of(e.from)]) reached[index_of(e.to)] = true;
    }
  }
  return std::count(reached.begin(), reached.end(), true) == static_cast<std::ptrdiff_t>(graph.agents());
}

TEST(GraphFacts, AgreeWithReachabilityAndWithTheLaplacian) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"graph facts"});
    const std::size_t agents = 1 + stream.below(8);
    const Graph graph = cases::random_graph(stream, agents, stream.uniform(0.0, 0.6));
    std::size_t roots = 0;
    std::vector<bool> is_root(agents);
    for (std::size_t i = 0; i < agents; ++i) roots += is_root[i] = reaches_all(graph, i);
    ASSERT_EQ(has_spanning_tree(graph), roots > 0);
    ASSERT_EQ(strongly_connected(graph), roots == agents);
    if (roots == 0) continue;
    const Vector w = left_null_vector(graph);
    ASSERT_LT((w.transpose() * laplacian(graph)).cwiseAbs().maxCoeff(), 1e-13);
    ASSERT_NEAR(w.sum(), 1.0, 1e-14);
    for (std::size_t i = 0; i < agents; ++i) ASSERT_EQ(w(static_cast<Eigen::Index>(i)) > 0.0, bool{is_root[i]});
    ASSERT_EQ(algebraic_connectivity(graph) > 0.0, agents > 1);
  }
}

TEST(GraphFacts, DoNotDependOnTheNamesOfTheAgents) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"relabelling"});
    const std::size_t agents = 2 + stream.below(7);
    const Graph graph = cases::random_graph(stream, agents, stream.uniform(0.2, 0.9));
    const auto order = cases::random_order(stream, agents);
    const Graph renamed = cases::relabelled(graph, order);
    ASSERT_EQ(strongly_connected(renamed), strongly_connected(graph));
    ASSERT_EQ(has_spanning_tree(renamed), has_spanning_tree(graph));
    ASSERT_EQ(balanced(renamed), balanced(graph));
    ASSERT_EQ(undirected(renamed), undirected(graph));
    ASSERT_NEAR(algebraic_connectivity(renamed), algebraic_connectivity(graph), 1e-6);
    if (!has_spanning_tree(graph)) continue;
    const Vector w = left_null_vector(graph), w_renamed = left_null_vector(renamed);
    for (std::size_t i = 0; i < agents; ++i) {
      ASSERT_NEAR(w_renamed(static_cast<Eigen::Index>(order[i])), w(static_cast<Eigen::Index>(i)), 1e-13);
    }
  }
}

}  // namespace
}  // namespace consort
