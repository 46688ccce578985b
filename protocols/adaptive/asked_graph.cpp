#include "protocols/adaptive/asked_graph.hpp"

#include <vector>

namespace consort {
namespace {

bool led(const Graph& graph) {
  const auto leads = [&](std::size_t i) { return graph.in_degree(agent_at(i)) == 0; };
  for (std::size_t i = 0; i < graph.agents(); ++i)
    if (leads(i)) return has_spanning_tree(graph);
  return false;
}

Graph followers(const Graph& graph) {
  std::vector<AgentId> members;
  for (std::size_t i = 0; i < graph.agents(); ++i)
    if (graph.in_degree(agent_at(i)) > 0) members.push_back(agent_at(i));
  return part_of(graph, members);
}

}  // namespace

std::string_view wording(AskedGraph asked) {
  switch (asked) {
    case AskedGraph::strong_or_led:
      return "strongly connected, or a leader (an agent without in-neighbours) reaches everybody";
    case AskedGraph::led:
      return "a leader (an agent without in-neighbours) reaches everybody";
    case AskedGraph::undirected:
      return "undirected and connected";
    case AskedGraph::undirected_followers:
      return "undirected among the followers, and connected or led";
    case AskedGraph::undirected_followers_led:
      return "undirected among the followers, and a leader reaches everybody";
  }
  return "";
}

bool suits(const Graph& graph, AskedGraph asked) {
  switch (asked) {
    case AskedGraph::strong_or_led:
      return strongly_connected(graph) || led(graph);
    case AskedGraph::led:
      return led(graph);
    case AskedGraph::undirected:
      return undirected(graph) && strongly_connected(graph);
    case AskedGraph::undirected_followers:
      return undirected(followers(graph)) && (strongly_connected(graph) || led(graph));
    case AskedGraph::undirected_followers_led:
      return undirected(followers(graph)) && led(graph);
  }
  return false;
}

}  // namespace consort
