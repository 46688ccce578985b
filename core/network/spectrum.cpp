#include "core/math/decompositions.hpp"
#include "core/network/graph.hpp"

#include <boost/graph/compressed_sparse_row_graph.hpp>
#include <boost/graph/strong_components.hpp>

#include <algorithm>
#include <cmath>
#include <string>

namespace consort {

namespace {

struct Components {
  std::vector<std::size_t> of;  // component of each agent
  std::size_t count = 0;
};

// Every edge turned round, in the order of the graph itself: its strong components are the same, and nothing need be sorted.
Components strong_components_of(const Graph& graph) {
  Components components;
  components.of.resize(graph.agents());
  if (graph.agents() == 0) return components;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> turned;
  turned.reserve(graph.edge_count());
  for (std::size_t i = 0; i < graph.agents(); ++i)
    for (const Neighbour& j : graph.in_neighbours(agent_at(i)))
      turned.emplace_back(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(index_of(j.id)));
  const boost::compressed_sparse_row_graph<boost::directedS, boost::no_property, boost::no_property, boost::no_property, std::uint32_t>
      flow(boost::edges_are_sorted, turned.begin(), turned.end(), static_cast<std::uint32_t>(graph.agents()));
  const auto vertex_index = boost::get(boost::vertex_index, flow);
  components.count =
      static_cast<std::size_t>(boost::strong_components(flow, boost::make_iterator_property_map(components.of.begin(), vertex_index)));
  return components;
}

// Agents of the one strong component that nobody outside feeds, ascending; empty if there are several such components.
std::vector<std::size_t> root_of(const Graph& graph) {
  const Components components = strong_components_of(graph);
  std::vector<bool> fed(components.count, false);
  for (std::size_t i = 0; i < graph.agents(); ++i)
    for (const Neighbour& j : graph.in_neighbours(agent_at(i)))
      if (components.of[index_of(j.id)] != components.of[i]) fed[components.of[i]] = true;
  if (std::count(fed.begin(), fed.end(), false) != 1) return {};
  std::vector<std::size_t> root;
  for (std::size_t i = 0; i < graph.agents(); ++i) {
    if (!fed[components.of[i]]) root.push_back(i);
  }
  return root;
}

// Stationary distribution of the irreducible chain with rate rates(i, j) from i to j, by the elimination of Grassmann, Taksar, Heyman
// 1985: without a subtraction, so every entry is right to full relative precision.
Vector stationary_distribution(Matrix rates) {
  const Eigen::Index n = rates.rows();
  rates.diagonal().setZero();
  for (Eigen::Index k = n - 1; k > 0; --k) {
    rates.col(k).head(k) /= rates.row(k).head(k).sum();
    rates.topLeftCorner(k, k) += rates.col(k).head(k) * rates.row(k).head(k);
  }
  Vector w = Vector::Ones(n);
  for (Eigen::Index k = 1; k < n; ++k) w(k) = w.head(k).dot(rates.col(k).head(k));
  return w / w.sum();
}

}  // namespace

Matrix adjacency(const Graph& graph) {
  const auto n = static_cast<Eigen::Index>(graph.agents());
  Matrix g = Matrix::Zero(n, n);
  for (const auto& [edge, weight] : graph.edges()) {
    g(static_cast<Eigen::Index>(index_of(edge.to)), static_cast<Eigen::Index>(index_of(edge.from))) = weight;
  }
  return g;
}

Matrix laplacian(const Graph& graph) {
  const Matrix g = adjacency(graph);
  return Matrix(g.rowwise().sum().asDiagonal()) - g;
}

bool strongly_connected(const Graph& graph) { return strong_components_of(graph).count == 1; }

bool has_spanning_tree(const Graph& graph) { return !root_of(graph).empty(); }

bool undirected(const Graph& graph) {
  for (std::size_t i = 0; i < graph.agents(); ++i)
    for (const Neighbour& j : graph.in_neighbours(agent_at(i))) {
      const auto back = graph.in_neighbours(j.id);
      const auto self = std::lower_bound(back.begin(), back.end(), agent_at(i), [](const Neighbour& n, AgentId id) { return n.id < id; });
      if (self == back.end() || self->id != agent_at(i) || self->weight != j.weight) return false;
    }
  return true;
}

bool balanced(const Graph& graph) {
  const auto n = static_cast<Eigen::Index>(graph.agents());
  Vector in = Vector::Zero(n), out = Vector::Zero(n);
  for (std::size_t i = 0; i < graph.agents(); ++i)
    for (const Neighbour& j : graph.in_neighbours(agent_at(i))) {
      in[static_cast<Eigen::Index>(i)] += j.weight;
      out[static_cast<Eigen::Index>(index_of(j.id))] += j.weight;
    }
  return n == 0 || (in - out).cwiseAbs().maxCoeff() <= 1e-12 * std::max(1.0, in.maxCoeff());
}

std::vector<std::complex<double>> laplacian_spectrum(const Graph& graph) {
  if (graph.agents() == 0) return {};
  const Matrix l = laplacian(graph);
  std::vector<std::complex<double>> spectrum;
  spectrum.reserve(graph.agents());
  if (undirected(graph)) {
    for (const double value : symmetric_eigenvalues(l)) spectrum.emplace_back(value, 0.0);
  } else {
    for (const std::complex<double> value : eigenvalues(l, "the Laplacian")) spectrum.push_back(value);
  }
  std::sort(spectrum.begin(), spectrum.end(),
            [](const auto& a, const auto& b) { return std::pair(a.real(), a.imag()) < std::pair(b.real(), b.imag()); });
  return spectrum;
}

double algebraic_connectivity(const Graph& graph) {
  if (graph.agents() < 2 || !has_spanning_tree(graph)) return 0.0;
  auto spectrum = laplacian_spectrum(graph);
  // With a spanning tree zero is a simple eigenvalue and all others have a positive real part (Ren, Beard 2005, Lemma 3.3).
  spectrum.erase(
      std::min_element(spectrum.begin(), spectrum.end(), [](const auto& a, const auto& b) { return std::abs(a) < std::abs(b); }));
  return spectrum.front().real();
}

Vector left_null_vector(const Graph& graph) {
  const std::vector<std::size_t> root = root_of(graph);
  check(!root.empty(), "left_null_vector: the graph has no spanning tree");
  const auto size = static_cast<Eigen::Index>(root.size());
  std::vector<Eigen::Index> place(graph.agents(), -1);
  for (Eigen::Index r = 0; r < size; ++r) place[root[static_cast<std::size_t>(r)]] = r;
  // Nothing enters the root, so w lives on it; there -L generates a chain that jumps from i to its in-neighbour j at rate w_ij.
  Matrix rates = Matrix::Zero(size, size);
  for (const auto& [edge, weight] : graph.edges()) {
    const Eigen::Index i = place[index_of(edge.to)];
    if (i >= 0) rates(i, place[index_of(edge.from)]) = weight;
  }
  const Vector on_root = stationary_distribution(std::move(rates));
  Vector w = Vector::Zero(static_cast<Eigen::Index>(graph.agents()));
  for (Eigen::Index r = 0; r < size; ++r) w(static_cast<Eigen::Index>(root[static_cast<std::size_t>(r)])) = on_root(r);
  return w;
}

}  // namespace consort
