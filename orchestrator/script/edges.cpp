#include "orchestrator/script/edges.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <set>

namespace consort::script {

std::string edge_text(Edge edge) { return fmt::format("{} -> {}", edge.from.value, edge.to.value); }

std::vector<Edge> read_edge(Mistakes& mistakes, const YAML::Node& node, const std::string& what, std::size_t agents) {
  const auto refuse = [&](const std::string& why) {
    mistakes.add(
        node, fmt::format("{}: found {}{}; allowed: sender -> receiver with agents 1 to {}, such as 1 -> 2, 2 <-> 3 or 1 -> 2 -> 3", what,
                          describe(node), why, agents));
    return std::vector<Edge>{};
  };
  if (!node.IsScalar()) return refuse("");
  std::string_view rest = node.Scalar();
  const auto skip = [&rest] { rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size())); };
  std::vector<Edge> edges;
  std::optional<AgentId> last;
  bool both = false;
  while (true) {
    skip();
    std::uint32_t id = 0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), id);
    if (error != std::errc()) return refuse("");
    if (id < 1 || id > agents) return refuse(fmt::format(", and there is no agent {}", id));
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    const AgentId here{id};
    if (last) {
      if (*last == here) return refuse(", an edge from an agent to itself (it is implied, never listed)");
      edges.push_back({*last, here});
      if (both) edges.push_back({here, *last});
    }
    last = here;
    skip();
    if (rest.empty()) break;
    both = rest.starts_with("<->");
    if (!both && !rest.starts_with("->")) return refuse("");
    rest.remove_prefix(both ? 3 : 2);
  }
  return edges.empty() ? refuse("") : edges;
}

std::vector<Edge> read_edges(Mistakes& mistakes, const YAML::Node& node, const std::string& what, std::size_t agents) {
  if (!node.IsSequence() || node.size() == 0) {
    mistakes.add(node, fmt::format("{}: found {}; allowed: a list of edges such as [1 -> 2, 2 <-> 3]", what, describe(node)));
    return {};
  }
  std::vector<Edge> edges;
  std::set<Edge> seen;
  for (std::size_t i = 0; i < node.size(); ++i) {
    for (const Edge edge : read_edge(mistakes, node[i], fmt::format("{}[{}]", what, i), agents)) {
      if (!seen.insert(edge).second)
        mistakes.add(node[i], fmt::format("{}[{}]: found the edge {} a second time; allowed: each edge once", what, i, edge_text(edge)));
      edges.push_back(edge);
    }
  }
  return edges;
}

}  // namespace consort::script
