#include "orchestrator/report/page_network.hpp"

#include "core/network/graph.hpp"
#include "orchestrator/report/record_schema.hpp"
#include "tests/orchestrator/folder.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace consort {
namespace {

/// A record of one run with these graphs, a round each.
nlohmann::ordered_json drawn(const std::vector<Graph>& graphs) {
  const ScratchFolder folder;
  Database database(folder.path() / "record.sqlite", Database::Open::create);
  database.run(record_schema(1.0));
  for (std::size_t g = 0; g < graphs.size(); ++g) {
    database.run(fmt::format("INSERT INTO segments VALUES (0, {0}, {0}, {0})", g));
    for (const WeightedEdge& one : graphs[g].edges())
      database.run(fmt::format("INSERT INTO edges VALUES ({}, {}, {}, {})", g, one.edge.from.value, one.edge.to.value, one.weight));
  }
  return page_graphs(database, 0, graphs.front().agents());
}

TEST(PageGraphs, PlaceTheAgentsOfAnyGraphAtOnceAndApart) {
  for (const Graph& graph : {complete(100), ring(200), star(50), path(7), erdos_renyi(150, 0.02, true, Seed{1}), directed_ring(2)}) {
    const auto json = drawn({graph});
    ASSERT_EQ(json["places"].size(), graph.agents());
    std::set<std::pair<double, double>> apart;
    for (const auto& place : json["places"]) {
      const double x = place[0].get<double>(), y = place[1].get<double>();
      EXPECT_TRUE(x >= 0.0 && x <= 1.0 && y >= 0.0 && y <= 1.0) << x << " " << y;
      apart.emplace(x, y);
    }
    EXPECT_EQ(apart.size(), graph.agents());
    EXPECT_EQ(json["segments"][0]["edges"].size(), graph.edge_count());
  }
}

TEST(PageGraphs, AreAtMostTwentyFromFirstToLastWithTheirFacts) {
  std::vector<Graph> graphs(45, ring(4));
  graphs.back() = directed_ring(4);
  const auto json = drawn(graphs);
  EXPECT_EQ(json["of"], 45);
  ASSERT_EQ(json["segments"].size(), 20u);
  EXPECT_EQ(json["segments"][0]["facts"], "8 edges, undirected, strongly connected, balanced");
  EXPECT_EQ(json["segments"][19]["facts"], "4 edges, strongly connected, balanced");
  EXPECT_EQ(json["segments"][19]["from"], 44);
}

TEST(PageGraphs, AreNotDrawnOfMoreThanTwoHundredAgents) { EXPECT_TRUE(drawn({ring(201)}).is_null()); }

}  // namespace
}  // namespace consort
