#pragma once
/// Graphs as GraphML, for programs that draw and examine graphs.

#include "core/network/graph.hpp"
#include "orchestrator/report/sqlite.hpp"
#include "orchestrator/report/tables.hpp"

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace consort {

/// Directed, a node per agent with its name (its number where `names` is empty), the weight of each edge, and in which rounds it holds.
std::string graphml_of(const Graph& graph, std::span<const std::string> names, const std::string& id, const std::string& rounds = {});

/// folder/graph_<number>.graphml of each graph of a record.
std::vector<WrittenTable> write_graphs(Database& database, const std::filesystem::path& folder);

}  // namespace consort
