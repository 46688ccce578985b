#include "core/network/graph_witness.hpp"

#include <algorithm>

namespace consort {

std::vector<AgentId> some_cycle(const Graph& graph) {
  // Whoever hears nobody that is left is in no cycle. If others remain, each hears one of them: to walk from one to the next closes a
  // cycle.
  std::vector<char> left(graph.agents(), 1);
  const auto heard = [&](std::size_t i) {
    const auto neighbours = graph.in_neighbours(agent_at(i));
    return std::find_if(neighbours.begin(), neighbours.end(), [&](const Neighbour& j) { return left[index_of(j.id)] != 0; });
  };
  const auto hears = [&](std::size_t i) { return heard(i) != graph.in_neighbours(agent_at(i)).end(); };
  for (bool fewer = true; fewer;) {
    fewer = false;
    for (std::size_t i = 0; i < graph.agents(); ++i) {
      if (left[i] == 0 || hears(i)) continue;
      left[i] = 0;
      fewer = true;
    }
  }
  const auto start = std::find(left.begin(), left.end(), 1);
  if (start == left.end()) return {};
  std::vector<AgentId> way{agent_at(static_cast<std::size_t>(start - left.begin()))};
  while (true) {
    const AgentId next = heard(index_of(way.back()))->id;
    const auto met = std::find(way.begin(), way.end(), next);
    const bool closed = met != way.end();
    const auto first = met - way.begin();
    way.push_back(next);
    if (!closed) continue;
    way.erase(way.begin(), way.begin() + first);
    std::reverse(way.begin(), way.end());  // the walk went from receiver to sender
    // from the smallest number on, so that a cycle has one name
    way.pop_back();
    std::rotate(way.begin(), std::min_element(way.begin(), way.end()), way.end());
    way.push_back(way.front());
    return way;
  }
}

std::optional<Edge> some_unreached(const Graph& graph) {
  for (std::size_t from = 0; from < graph.agents(); ++from) {
    std::vector<char> reached(graph.agents(), 0);
    reached[from] = 1;
    for (bool grew = true; grew;) {
      grew = false;
      for (std::size_t to = 0; to < graph.agents(); ++to) {
        if (reached[to] != 0) continue;
        const auto neighbours = graph.in_neighbours(agent_at(to));
        const bool hears =
            std::any_of(neighbours.begin(), neighbours.end(), [&](const Neighbour& j) { return reached[index_of(j.id)] != 0; });
        if (!hears) continue;
        reached[to] = 1;
        grew = true;
      }
    }
    const auto missed = std::find(reached.begin(), reached.end(), 0);
    if (missed != reached.end()) return Edge{agent_at(from), agent_at(static_cast<std::size_t>(missed - reached.begin()))};
  }
  return std::nullopt;
}

}  // namespace consort
