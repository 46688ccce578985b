#pragma once
/// Directed weighted graphs and the facts theory asks of them. g_ij = 1 means that i receives from j; no self-loops.

#include "core/errors.hpp"
#include "core/random.hpp"
#include "core/types.hpp"

#include <complex>
#include <memory>
#include <span>
#include <vector>

namespace consort {

/// One in-neighbour j of an agent i, with the weight w_ij of the edge j -> i.
struct Neighbour {
  AgentId id;
  double weight = 1.0;
  bool operator==(const Neighbour&) const = default;
};

struct WeightedEdge {
  Edge edge;
  double weight = 1.0;
  bool operator==(const WeightedEdge&) const = default;
};

/// An immutable graph over agents 1..n (compressed rows: the in-neighbours of each agent, ascending).
class Graph {
 public:
  Graph() = default;
  /// Throws ContractViolation on an id outside 1..n, a self-loop, or a weight that is not positive and finite. A repeated edge keeps its
  /// last weight.
  Graph(std::size_t agents, std::span<const WeightedEdge> edges);
  Graph(std::size_t agents, std::span<const Edge> edges);

  [[nodiscard]] std::size_t agents() const { return out_degree_.size(); }
  [[nodiscard]] std::size_t edge_count() const { return neighbours_.size(); }
  [[nodiscard]] std::span<const Neighbour> in_neighbours(AgentId i) const {
    check(i.value >= 1 && i.value <= agents(), "Graph: agents are numbered 1..n");
    return std::span(neighbours_).subspan(first_[index_of(i)], first_[i.value] - first_[index_of(i)]);
  }
  [[nodiscard]] std::size_t in_degree(AgentId i) const { return in_neighbours(i).size(); }
  /// Number of listeners (mu_j).
  [[nodiscard]] std::size_t out_degree(AgentId j) const {
    check(j.value >= 1 && j.value <= agents(), "Graph: agents are numbered 1..n");
    return out_degree_[index_of(j)];
  }
  [[nodiscard]] bool has(Edge) const;
  [[nodiscard]] std::vector<WeightedEdge> edges() const;  ///< ascending by receiver, then sender
  bool operator==(const Graph&) const = default;

 private:
  std::vector<std::uint32_t> first_{0};  // row starts, n + 1 entries
  std::vector<Neighbour> neighbours_;
  std::vector<std::uint32_t> out_degree_;
};

// Families. All throw ConfigError with the allowed range when a parameter makes no sense.
Graph directed_ring(std::size_t n);  ///< 1 -> 2 -> ... -> n -> 1 (one agent: no edge)
Graph ring(std::size_t n);           ///< undirected cycle (two agents: joined once)
Graph path(std::size_t n);           ///< undirected path 1 - 2 - ... - n
Graph star(std::size_t n);           ///< undirected, agent 1 in the middle
Graph complete(std::size_t n);
Graph erdos_renyi(std::size_t n, double probability, bool directed, Seed seed);  ///< each (un)ordered pair independently
Graph random_geometric(std::size_t n, double radius, Seed seed);  ///< points uniform in the unit square, joined within `radius`
Graph from_adjacency(const Matrix& g);                            ///< g(i,j) > 0: i receives from j with that weight

Matrix adjacency(const Graph&);                 ///< n x n, entry (i,j) = w_ij
Matrix laplacian(const Graph&);                 ///< L = diag(row sums) - adjacency, L 1 = 0
Graph union_of(std::span<const Graph> graphs);  ///< an edge is present if it is in any; the largest weight counts
/// The graph of some agents, ascending, renumbered in order.
Graph part_of(const Graph&, std::span<const AgentId> members);

bool strongly_connected(const Graph&);  ///< every agent reaches every other; false without agents
bool has_spanning_tree(const Graph&);   ///< directed: some agent reaches every other
bool undirected(const Graph&);          ///< symmetric adjacency
bool balanced(const Graph&);            ///< weighted in-degree = weighted out-degree at every agent (1e-12)
/// Eigenvalues of L, ascending by real part.
std::vector<std::complex<double>> laplacian_spectrum(const Graph&);
/// Smallest real part among the eigenvalues of L other than one zero; 0 if there is no spanning tree or only one agent.
double algebraic_connectivity(const Graph&);
/// Left null vector w of L (w^T L = 0), sum 1: positive at the agents that reach every other, zero elsewhere. Needs a spanning tree
/// (ContractViolation otherwise).
Vector left_null_vector(const Graph&);

}  // namespace consort
