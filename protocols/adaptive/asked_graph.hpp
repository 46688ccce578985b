#pragma once
/// The graphs that theorems about adapted gains ask for.

#include "core/network/graph.hpp"

#include <string_view>

namespace consort {

/// A leader is an agent without in-neighbours; the others are followers.
enum class AskedGraph { strong_or_led, led, undirected, undirected_followers, undirected_followers_led };
std::string_view wording(AskedGraph asked);
bool suits(const Graph& graph, AskedGraph asked);

}  // namespace consort
