#pragma once
/// The graphs of a record as GraphML, for programs that draw and examine graphs.

#include "orchestrator/report/sqlite.hpp"
#include "orchestrator/report/tables.hpp"

#include <filesystem>
#include <vector>

namespace consort {

/// folder/graph_<number>.graphml of each graph: directed, a node per agent, the weight of each edge, and in which rounds it holds.
std::vector<WrittenTable> write_graphs(Database& database, const std::filesystem::path& folder);

}  // namespace consort
