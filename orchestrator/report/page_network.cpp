#include "orchestrator/report/page_network.hpp"

#include "core/network/graph.hpp"

#include <fmt/format.h>
#include <graphviz/gvc.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <set>

namespace consort {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostNodes = 200, kMostSegments = 20, kMostEdges = 20'000, kMostRows = 40;

struct Segment {
  std::int64_t from, to, graph;
};

using Edges = std::vector<WeightedEdge>;

Edges edges_of(Database& database, std::int64_t graph) {
  Statement row = database.prepare("SELECT sender, receiver, weight FROM edges WHERE graph = ? ORDER BY sender, receiver");
  row.bind(0, graph);
  Edges edges;
  while (row.step())
    edges.push_back(
        {{AgentId{static_cast<std::uint32_t>(row.integer(0))}, AgentId{static_cast<std::uint32_t>(row.integer(1))}}, row.real(2)});
  return edges;
}

// Where Graphviz puts the agents of a graph, in 0..1 both ways. A cycle is drawn as one.
std::vector<std::pair<double, double>> places_of(std::size_t agents, const std::set<Edge>& edges) {
  struct Free {
    void operator()(Agraph_t* graph) const { agclose(graph); }
  };
  // Graphviz has one context in a process, for ever (a second one uses what the first has freed), and one user at a time.
  static std::mutex one_at_a_time;
  const std::lock_guard alone(one_at_a_time);
  static GVC_t* const context = gvContext();
  std::string name = "network";
  const std::unique_ptr<Agraph_t, Free> graph(agopen(name.data(), Agundirected, nullptr));
  std::string label = "label", nothing;
  agattr(graph.get(), AGNODE, label.data(), nothing.data());  // no text, so no fonts
  std::vector<Agnode_t*> nodes;
  for (std::size_t i = 0; i < agents; ++i) nodes.push_back(agnode(graph.get(), std::to_string(i + 1).data(), 1));
  std::set<std::pair<std::size_t, std::size_t>> drawn;
  for (const Edge& edge : edges) {
    const std::pair<std::size_t, std::size_t> ends = std::minmax({index_of(edge.from), index_of(edge.to)});
    if (drawn.insert(ends).second) agedge(graph.get(), nodes[ends.first], nodes[ends.second], nullptr, 1);
  }
  // Cycles and trees look like what they are; with more edges, circo would take hours, and springs a moment.
  const char* engine = drawn.size() <= agents ? "circo" : "neato";
  std::vector<std::pair<double, double>> places(agents, {0.5, 0.5});
  if (gvLayout(context, graph.get(), engine) != 0) return places;
  double left = 1e300, right = -1e300, bottom = 1e300, top = -1e300;
  for (std::size_t i = 0; i < agents; ++i) {
    const pointf at = ND_coord(nodes[i]);
    places[i] = {at.x, at.y};
    left = std::min(left, at.x);
    right = std::max(right, at.x);
    bottom = std::min(bottom, at.y);
    top = std::max(top, at.y);
  }
  const double size = std::max({right - left, top - bottom, 1e-9});
  for (auto& [x, y] : places) {  // four digits are more than a screen has
    x = std::round(1e4 * ((x - left) / size + 0.5 * (1.0 - (right - left) / size))) / 1e4;
    y = std::round(1e4 * ((top - y) / size + 0.5 * (1.0 - (top - bottom) / size))) / 1e4;
  }
  gvFreeLayout(context, graph.get());
  return places;
}

std::string facts_of(const Graph& graph) {
  std::string text = fmt::format("{} edge{}", graph.edge_count(), graph.edge_count() == 1 ? "" : "s");
  if (undirected(graph)) text += ", undirected";
  text += strongly_connected(graph) ? ", strongly connected" : has_spanning_tree(graph) ? ", with a spanning tree" : ", not connected";
  return text + (balanced(graph) ? ", balanced" : ", not balanced");
}

// Up to `kMostSegments`, over the whole run.
std::vector<Segment> chosen(const std::vector<Segment>& all) {
  if (all.size() <= kMostSegments) return all;
  std::vector<Segment> some;
  for (std::size_t i = 0; i < kMostSegments; ++i) some.push_back(all[i * (all.size() - 1) / (kMostSegments - 1)]);
  return some;
}

Json rows_of(Statement& row) {
  Json rows = Json::array();
  while (row.step()) {
    Json one;
    for (int c = 0; c < row.columns(); ++c) {
      const std::string name = row.name(c);
      if (row.is_null(c))
        one[name] = nullptr;
      else if (row.is_real(c))
        one[name] = row.real(c);
      else
        one[name] = row.integer(c);
    }
    rows.push_back(std::move(one));
  }
  return rows;
}

Json table(Database& database, std::int64_t run, const std::string& sql) {
  Statement row = database.prepare(sql);
  row.bind(0, run);
  return rows_of(row);
}

}  // namespace

Json page_graphs(Database& database, std::int64_t run, std::size_t agents) {
  if (agents > kMostNodes) return {};
  std::vector<Segment> all;
  Statement row = database.prepare("SELECT first_round, last_round, graph FROM segments WHERE run = ? ORDER BY first_round");
  row.bind(0, run);
  while (row.step()) all.push_back({row.integer(0), row.integer(1), row.integer(2)});
  if (all.empty()) return {};
  std::map<std::int64_t, Edges> graphs;
  std::set<Edge> united;
  std::size_t edges = 0;
  Json segments = Json::array();
  for (const Segment& segment : chosen(all)) {
    const auto [known, fresh] = graphs.try_emplace(segment.graph);
    if (fresh) known->second = edges_of(database, segment.graph);
    edges += known->second.size();
    if (edges > kMostEdges) break;
    Json list = Json::array();
    for (const WeightedEdge& edge : known->second) {
      list.push_back({edge.edge.from.value, edge.edge.to.value, edge.weight});
      united.insert(edge.edge);
    }
    segments.push_back(Json{{"from", segment.from},
                            {"to", segment.to},
                            {"edges", std::move(list)},
                            {"facts", facts_of(Graph(agents, std::span<const WeightedEdge>(known->second)))}});
  }
  Json places = Json::array();
  for (const auto& [x, y] : places_of(agents, united)) places.push_back({x, y});
  return {{"agents", agents}, {"places", std::move(places)}, {"segments", std::move(segments)}, {"of", all.size()}};
}

Json page_messages(Database& database, std::int64_t run) {
  return {{"totals", table(database, run,
                           "SELECT messages_sent AS sent, messages_delivered AS delivered, messages_lost AS lost FROM runs "
                           "WHERE run = ?")},
          {"links", table(database, run,
                          fmt::format("SELECT sender, receiver, delivered, lost, duplicated, reordered, superseded FROM links "
                                      "WHERE run = ? ORDER BY lost DESC, sender, receiver LIMIT {}",
                                      kMostRows))},
          {"network", table(database, run,
                            fmt::format("SELECT sender, receiver, sent, received, lost, late, duplicated, reordered FROM "
                                        "network WHERE run = ? ORDER BY lost + late DESC, sender, receiver LIMIT {}",
                                        kMostRows))},
          {"agents", table(database, run,
                           fmt::format("SELECT agent, messages_sent AS sent, messages_delivered AS delivered, messages_lost AS "
                                       "lost FROM agents WHERE run = ? ORDER BY agent LIMIT {}",
                                       kMostRows))},
          {"processes", table(database, run,
                              fmt::format("SELECT process, periods, missed_deadlines, missed_inputs, jitter_p50, jitter_p99, "
                                          "jitter_max, cpu, resident_bytes, sent_again_bytes FROM processes WHERE run = ? ORDER "
                                          "BY process LIMIT {}",
                                          kMostRows))}};
}

}  // namespace consort
