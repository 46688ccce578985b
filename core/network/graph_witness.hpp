#pragma once
/// Why a graph lacks a property: the agents that show it.

#include "core/network/graph.hpp"

#include <optional>
#include <vector>

namespace consort {

/// Agents a, b, ..., a along a directed cycle; empty if there is none.
std::vector<AgentId> some_cycle(const Graph& graph);

/// Two agents such that nothing `from` sends ever reaches `to`; nothing if the graph is strongly connected.
std::optional<Edge> some_unreached(const Graph& graph);

}  // namespace consort
