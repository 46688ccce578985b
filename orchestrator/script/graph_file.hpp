#pragma once
/// Graphs in files of other programs: GraphML, MatrixMarket, adjacency CSV, edge lists, node-link JSON.

#include "core/errors.hpp"
#include "core/network/graph.hpp"

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace consort::script {

/// What is wrong in a line of a graph file; 0: nowhere in particular.
struct GraphFileError : ConfigError {
  GraphFileError(std::size_t in_line, const std::string& text) : ConfigError(text), line(in_line) {}
  std::size_t line;
};

/// The endings that read_graph_file() knows: "graphml", "mtx", "csv", "edges", "json".
std::vector<std::string> graph_file_endings();

/// A graph, and what its file calls the agents; no names where it calls them 1 to n.
struct NamedGraph {
  Graph graph;
  std::vector<std::string> names;
};

/// A graph of so many agents; of as many as the file has nodes, if nothing is said. `ending` says what the text is. In every format an edge
/// from s to t means that t receives from s, but in a matrix (MatrixMarket, CSV), where row i, column j is the weight with which i receives
/// from j. An edge without a weight has weight 1, an edge without a direction is two. Agents have their number where the file's nodes are
/// called 1 to n; else they are numbered as the file lists its nodes, and in an edge list, which lists none, by their names in order. With
/// `both_ways` every edge counts in both directions. Throws GraphFileError.
NamedGraph read_graph_file(std::string_view text, std::string_view ending, std::optional<std::size_t> agents, bool both_ways = false);

/// The nodes and edges of a file, as it calls them; agents are made of them at the end.
class GraphBuilder {
 public:
  GraphBuilder(std::optional<std::size_t> agents, bool both_ways) : agents_(agents), both_ways_(both_ways) {}

  void add_node(std::size_t line, std::string name);  ///< in the order of the file
  void add_edge(std::size_t line, std::string from, std::string to, double weight, bool directed);
  /// A matrix of so many rows and columns is announced: a node per row, called 1 to n.
  void add_matrix(std::size_t line, std::size_t rows, std::size_t columns);
  /// Row i, column j of it, from 1: i receives from j.
  void add_entry(std::size_t line, std::size_t row, std::size_t column, double weight);
  /// Throws GraphFileError on a count of nodes that is not that of the agents, unknown nodes, self-loops, weights that are not positive,
  /// and edges that occur twice.
  [[nodiscard]] NamedGraph graph() const;

 private:
  struct Line {
    std::size_t number;
    std::string from, to;
    double weight;
    bool directed;
  };
  [[nodiscard]] std::vector<std::string> names() const;
  void require_count(std::size_t line, std::size_t nodes) const;

  std::optional<std::size_t> agents_;  // that are wanted
  bool both_ways_;
  std::vector<std::string> nodes_;
  std::vector<Line> edges_;
};

/// A weight as a file writes it: a number, finite and not negative. Throws GraphFileError.
double graph_weight(std::size_t line, std::string_view text);
/// The line of the byte at `offset`, from 1.
std::size_t line_at(std::string_view text, std::size_t offset);

// Each reads one format. They throw GraphFileError.
void read_graphml(std::string_view text, GraphBuilder& into);
void read_node_link(std::string_view text, GraphBuilder& into);
void read_edge_list(std::string_view text, GraphBuilder& into);
void read_matrix_market(std::string_view text, GraphBuilder& into);
void read_adjacency_csv(std::string_view text, GraphBuilder& into);

}  // namespace consort::script
