/// Graphs as Graphviz and other programs take them.

#include "orchestrator/report/drawing.hpp"

#include "orchestrator/report/graphml.hpp"
#include "orchestrator/script/graph_file.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

Graph weighted() {
  const std::vector<WeightedEdge> edges{
      {{AgentId{1}, AgentId{2}}, 1.0}, {{AgentId{2}, AgentId{1}}, 1.0}, {{AgentId{2}, AgentId{3}}, 0.5}, {{AgentId{3}, AgentId{2}}, 0.25}};
  return Graph(3, std::span<const WeightedEdge>(edges));
}

TEST(Drawing, DotHasALineWithoutArrowWhereBothDirectionsAreAlike) {
  const std::string dot = dot_of(weighted(), {});
  EXPECT_TRUE(dot.ends_with("\n  1\n  2\n  3\n  1 -> 2 [dir=none]\n  3 -> 2 [label=\"0.25\"]\n  2 -> 3 [label=\"0.5\"]\n}\n")) << dot;
}

TEST(Drawing, NamesAreTextWhateverTheyAre) {
  const std::vector<std::string> names{R"(a"b)", R"(c\d)", "<svg onload=alert(1)>"};
  EXPECT_NE(dot_of(weighted(), names).find(R"("a\"b" -> "c\\d")"), std::string::npos);
  const std::string svg = svg_of(weighted(), names);
  EXPECT_NE(svg.find("<svg"), std::string::npos);
  EXPECT_EQ(svg.find("<svg onload"), std::string::npos);
  EXPECT_EQ(svg_of(weighted(), {}).find("nan"), std::string::npos);
}

TEST(Drawing, GraphMlIsReadBackAsTheSameGraph) {
  const std::vector<std::string> names{"<&>", "2", "c"};
  const script::NamedGraph read = script::read_graph_file(graphml_of(weighted(), names, "g"), "graphml", std::nullopt);
  EXPECT_EQ(read.graph, weighted());
  EXPECT_EQ(read.names, names);
  EXPECT_EQ(script::read_graph_file(graphml_of(ring(30), {}, "g"), "graphml", 30).graph, ring(30));
}

}  // namespace
}  // namespace consort
