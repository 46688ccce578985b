#pragma once
/// Edges as the experiment file writes them.

#include "core/network/graph.hpp"
#include "orchestrator/script/yaml.hpp"

#include <string>
#include <vector>

namespace consort::script {

/// "1 -> 2", "2 <-> 3" or a chain. A text that is no edge, an agent outside 1..agents and a self-loop are mistakes.
std::vector<Edge> read_edge(Mistakes&, const YAML::Node&, const std::string& what, std::size_t agents);
/// A list of those; an edge that occurs twice is a mistake.
std::vector<Edge> read_edges(Mistakes&, const YAML::Node&, const std::string& what, std::size_t agents);

std::string edge_text(Edge edge);

}  // namespace consort::script
