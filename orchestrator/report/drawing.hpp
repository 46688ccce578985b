#pragma once
/// Graphs drawn by Graphviz, and said in words.

#include "core/network/graph.hpp"

#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace consort {

/// Where Graphviz puts the agents of a graph, in 0..1 both ways. A cycle is drawn as one.
std::vector<std::pair<double, double>> places_of(std::size_t agents, const std::set<Edge>& edges);

/// "12 edges, undirected, strongly connected, balanced".
std::string facts_of(const Graph& graph);

/// In Graphviz' language: `names` of the agents (their numbers where it is empty), an edge without arrow where both directions have the
/// same weight, weights other than 1 beside their edges.
std::string dot_of(const Graph& graph, std::span<const std::string> names);

/// Drawn, as SVG. Throws RunError where Graphviz cannot.
std::string svg_of(const Graph& graph, std::span<const std::string> names);

}  // namespace consort
