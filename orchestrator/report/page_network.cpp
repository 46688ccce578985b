#include "orchestrator/report/page_network.hpp"

#include "core/network/graph.hpp"
#include "orchestrator/report/drawing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
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
