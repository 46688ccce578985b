#include "core/network/graph.hpp"

#include "core/number_text.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace consort {

namespace {

bool row_order(const WeightedEdge& a, const WeightedEdge& b) {
  return std::pair(a.edge.to, a.edge.from) < std::pair(b.edge.to, b.edge.from);
}

std::vector<WeightedEdge> with_unit_weights(std::span<const Edge> edges) {
  std::vector<WeightedEdge> weighted;
  weighted.reserve(edges.size());
  for (const Edge& edge : edges) weighted.push_back({edge, 1.0});
  return weighted;
}

void require_agents(std::size_t n, const char* family) {
  if (n < 1) throw ConfigError(std::string("topology ") + family + ": 0 agents; allowed: 1 or more");
}

// Appends both directions of the undirected link {i, j}; arguments are positions.
void join(std::vector<Edge>& edges, std::size_t i, std::size_t j) {
  edges.push_back({agent_at(i), agent_at(j)});
  edges.push_back({agent_at(j), agent_at(i)});
}

}  // namespace

Graph::Graph(std::size_t agents, std::span<const WeightedEdge> edges) : first_(agents + 1, 0), out_degree_(agents, 0) {
  check(edges.size() <= std::numeric_limits<std::uint32_t>::max(), "Graph: more than 2^32 - 1 edges");
  for (const auto& [edge, weight] : edges) {
    check(edge.from.value >= 1 && edge.from.value <= agents && edge.to.value >= 1 && edge.to.value <= agents,
          "Graph: agents are numbered 1..n");
    check(edge.from != edge.to, "Graph: a self-loop is implied, never listed");
    check(std::isfinite(weight) && weight > 0.0, "Graph: a weight is positive and finite");
  }
  std::vector<WeightedEdge> sorted;
  if (!std::is_sorted(edges.begin(), edges.end(), row_order)) {
    sorted.assign(edges.begin(), edges.end());
    std::stable_sort(sorted.begin(), sorted.end(), row_order);
    edges = sorted;
  }
  neighbours_.reserve(edges.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto& [edge, weight] = edges[e];
    if (e > 0 && edges[e - 1].edge == edge) {
      neighbours_.back().weight = weight;
      continue;
    }
    neighbours_.push_back({edge.from, weight});
    ++first_[edge.to.value];
    ++out_degree_[index_of(edge.from)];
  }
  for (std::size_t i = 1; i <= agents; ++i) first_[i] += first_[i - 1];
}

Graph::Graph(std::size_t agents, std::span<const Edge> edges) : Graph(agents, std::span<const WeightedEdge>(with_unit_weights(edges))) {}

bool Graph::has(Edge edge) const {
  const auto row = in_neighbours(edge.to);
  const auto it =
      std::lower_bound(row.begin(), row.end(), edge.from, [](const Neighbour& neighbour, AgentId id) { return neighbour.id < id; });
  return it != row.end() && it->id == edge.from;
}

std::vector<WeightedEdge> Graph::edges() const {
  std::vector<WeightedEdge> all;
  all.reserve(neighbours_.size());
  for (std::size_t i = 0; i < agents(); ++i) {
    for (const auto& [id, weight] : in_neighbours(agent_at(i))) all.push_back({{id, agent_at(i)}, weight});
  }
  return all;
}

Graph directed_ring(std::size_t n) {
  require_agents(n, "directed_ring");
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < n && n > 1; ++i) edges.push_back({agent_at(i), agent_at((i + 1) % n)});
  return Graph(n, edges);
}

Graph ring(std::size_t n) {
  require_agents(n, "ring");
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < n && n > 1; ++i) join(edges, i, (i + 1) % n);
  return Graph(n, edges);
}

Graph path(std::size_t n) {
  require_agents(n, "path");
  std::vector<Edge> edges;
  for (std::size_t i = 0; i + 1 < n; ++i) join(edges, i, i + 1);
  return Graph(n, edges);
}

Graph star(std::size_t n) {
  require_agents(n, "star");
  std::vector<Edge> edges;
  for (std::size_t i = 1; i < n; ++i) join(edges, 0, i);
  return Graph(n, edges);
}

Graph complete(std::size_t n) {
  require_agents(n, "complete");
  std::vector<Edge> edges;
  edges.reserve(n * (n - 1));
  for (std::size_t to = 0; to < n; ++to) {
    for (std::size_t from = 0; from < n; ++from) {
      if (from != to) edges.push_back({agent_at(from), agent_at(to)});
    }
  }
  return Graph(n, edges);
}

Graph erdos_renyi(std::size_t n, double probability, bool directed, Seed seed) {
  require_agents(n, "erdos_renyi");
  if (!(probability >= 0.0 && probability <= 1.0)) {
    throw ConfigError("topology erdos_renyi: probability " + number_text(probability) + "; allowed: 0 to 1");
  }
  constexpr Purpose kPairs{"erdos renyi"};
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      if (i == j || (!directed && j < i)) continue;
      if (seed.stream(kPairs, i + 1, j + 1).uniform() >= probability) continue;
      if (directed) {
        edges.push_back({agent_at(j), agent_at(i)});
      } else {
        join(edges, i, j);
      }
    }
  }
  return Graph(n, edges);
}

Graph random_geometric(std::size_t n, double radius, Seed seed) {
  require_agents(n, "random_geometric");
  if (!(radius > 0.0 && std::isfinite(radius))) {
    throw ConfigError("topology random_geometric: radius " + number_text(radius) + "; allowed: positive (sqrt(2) joins every pair)");
  }
  constexpr Purpose kPoints{"random geometric"};
  std::vector<std::array<double, 2>> points(n);
  for (std::size_t i = 0; i < n; ++i) {
    Stream stream = seed.stream(kPoints, i + 1);
    for (double& coordinate : points[i]) coordinate = stream.uniform();
  }
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      if (std::hypot(points[i][0] - points[j][0], points[i][1] - points[j][1]) <= radius) join(edges, i, j);
    }
  }
  return Graph(n, edges);
}

Graph from_adjacency(const Matrix& g) {
  if (g.rows() != g.cols() || g.rows() == 0) {
    throw ConfigError("topology adjacency: the matrix is " + std::to_string(g.rows()) + " x " + std::to_string(g.cols()) +
                      "; allowed: square, a row and a column per agent");
  }
  std::vector<WeightedEdge> edges;
  for (Eigen::Index i = 0; i < g.rows(); ++i) {
    for (Eigen::Index j = 0; j < g.cols(); ++j) {
      const double weight = g(i, j);
      if (weight == 0.0) continue;
      const std::string place =
          "topology adjacency: entry (" + std::to_string(i + 1) + ", " + std::to_string(j + 1) + ") is " + number_text(weight);
      if (!(weight > 0.0 && std::isfinite(weight))) throw ConfigError(place + "; allowed: zero or a positive weight");
      if (i == j) throw ConfigError(place + "; allowed: zero on the diagonal, a self-loop is implied");
      edges.push_back({{agent_at(static_cast<std::size_t>(j)), agent_at(static_cast<std::size_t>(i))}, weight});
    }
  }
  return Graph(static_cast<std::size_t>(g.rows()), edges);
}

Graph part_of(const Graph& graph, std::span<const AgentId> members) {
  std::vector<std::uint32_t> number(graph.agents(), 0);  // 0: not one of them
  for (std::size_t i = 0; i < members.size(); ++i) number[index_of(members[i])] = agent_at(i).value;
  std::vector<WeightedEdge> edges;
  for (const auto& [edge, weight] : graph.edges()) {
    const AgentId from{number[index_of(edge.from)]}, to{number[index_of(edge.to)]};
    if (from.value != 0 && to.value != 0) edges.push_back({{from, to}, weight});
  }
  return Graph(members.size(), std::span<const WeightedEdge>(edges));
}

Graph union_of(std::span<const Graph> graphs) {
  if (graphs.empty()) return {};
  std::vector<WeightedEdge> all;
  for (const Graph& graph : graphs) {
    check(graph.agents() == graphs.front().agents(), "union_of: the graphs have different numbers of agents");
    const auto edges = graph.edges();
    all.insert(all.end(), edges.begin(), edges.end());
  }
  // The last of equal edges keeps its weight, so the largest weight goes last.
  std::sort(all.begin(), all.end(),
            [](const WeightedEdge& a, const WeightedEdge& b) { return row_order(a, b) || (a.edge == b.edge && a.weight < b.weight); });
  return Graph(graphs.front().agents(), all);
}

}  // namespace consort
