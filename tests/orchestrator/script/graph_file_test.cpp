/// Graphs of other programs: what networkx, numpy and pandas write is read as they mean it, and what is wrong is named with its line.

#include "orchestrator/script/graph_file.hpp"
#include "orchestrator/script/script.hpp"
#include "tests/support/program.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#define EXPECT_SAYS(part, whole) EXPECT_PRED_FORMAT2(testing::IsSubstring, part, whole)

namespace consort::script {
namespace {

using Weighted = std::vector<WeightedEdge>;

WeightedEdge edge(std::uint32_t from, std::uint32_t to, double weight = 1.0) { return {{AgentId{from}, AgentId{to}}, weight}; }

std::string refusal(std::string_view text, std::string_view ending, std::size_t agents = 3) {
  try {
    read_graph_file(text, ending, agents);
    return "read";
  } catch (const GraphFileError& error) {
    return std::to_string(error.line) + ": " + error.what();
  }
}

TEST(GraphFile, AnEdgeListNamesSenderReceiverAndWeight) {
  EXPECT_EQ(read_graph_file("# two edges\n1 2\r\n3\t1 0.5\n", "edges", 3).graph.edges(), (Weighted{edge(3, 1, 0.5), edge(1, 2)}));
  EXPECT_EQ(read_graph_file("1 2 {}\n2 3 {'colour': 'red', 'weight': 0.25}", "edges", 4).graph.edges(),
            (Weighted{edge(1, 2), edge(2, 3, 0.25)}))
      << "as networkx writes them; agent 4 has no edge";
  EXPECT_EQ(read_graph_file("0 10\n10 2\n", "edges", 3).graph.edges(), (Weighted{edge(3, 2), edge(1, 3)})) << "0, 2, 10 are agents 1, 2, 3";
  EXPECT_EQ(read_graph_file("anna bert\n", "edges", 2, true).graph.edges(), (Weighted{edge(2, 1), edge(1, 2)}));
}

TEST(GraphFile, AMatrixHasReceiversInItsRows) {
  const Weighted wanted{edge(3, 1, 0.5), edge(1, 2)};
  EXPECT_EQ(read_graph_file("0,0,0.5\n1,0,0\n0,0,0\n", "csv", 3).graph.edges(), wanted);
  EXPECT_EQ(read_graph_file(",a,b,c\na,0,0,0.5\nb,1,0,0\nc,0,0,0\n", "csv", 3).graph.edges(), wanted) << "with names, as pandas writes it";
  EXPECT_EQ(read_graph_file("a, b, c\n0, 0, 0.5\n1, 0, 0\n0, 0, 0\n", "csv", 3).graph.edges(), wanted);
  EXPECT_EQ(read_graph_file("%%MatrixMarket matrix coordinate real general\n% a comment\n3 3 2\n1 3 0.5\n2 1 1\n", "mtx", 3).graph.edges(),
            wanted);
  EXPECT_EQ(read_graph_file("%%MatrixMarket matrix array real general\n3 3\n0\n1\n0\n0\n0\n0\n0.5\n0\n0\n", "mtx", 3).graph.edges(),
            wanted);
  EXPECT_EQ(read_graph_file("%%MatrixMarket matrix coordinate pattern symmetric\n3 3 1\n2 1\n", "mtx", 3).graph.edges(),
            (Weighted{edge(2, 1), edge(1, 2)}));
}

TEST(GraphFile, GraphMlAndNodeLinkDataListTheirNodes) {
  const char* xml = R"(<?xml version="1.0"?>
<graphml><key id="d0" for="edge" attr.name="weight" attr.type="double"/>
<graph edgedefault="undirected"><node id="n7"/><node id="n3"/><node id="n5"/>
<edge source="n7" target="n3"><data key="d0">0.5</data></edge><edge source="n3" target="n5" directed="true"/></graph></graphml>)";
  const Weighted wanted{edge(2, 1, 0.5), edge(1, 2, 0.5), edge(2, 3)};
  EXPECT_EQ(read_graph_file(xml, "graphml", 3).graph.edges(), wanted);
  EXPECT_EQ(read_graph_file(R"({"directed": true, "nodes": [{"id": "n7"}, {"id": 3}, {"id": 5}],
    "links": [{"source": "n7", "target": 3, "weight": 0.5}, {"source": 3, "target": "n7", "weight": 0.5}, {"source": 3, "target": 5}]})",
                            "json", 3)
                .graph.edges(),
            wanted);
  EXPECT_EQ(
      read_graph_file(R"({"nodes": [{"id": 3}, {"id": 1}, {"id": 2}], "edges": [{"source": 3, "target": 1}]})", "json", 3).graph.edges(),
      (Weighted{edge(3, 1), edge(1, 3)}))
      << "nodes that are called 1 to n are the agents of that number";
}

TEST(GraphFile, WhatIsWrongIsNamedWithItsLine) {
  EXPECT_EQ(refusal("1 2\n2\n", "edges"), "2: found '2'; allowed: sender, receiver and, if it has one, its weight");
  EXPECT_EQ(refusal("1 2\n1 2\n", "edges"), "2: found the edge from '1' to '2' a second time; allowed: each edge once");
  EXPECT_EQ(refusal("1 2 -1\n", "edges"), "1: found the weight '-1'; allowed: a number from 0 up");
  EXPECT_SAYS("1: found an edge from '1' to '1'; allowed: edges between two nodes", refusal("1 1\n", "edges"));
  EXPECT_EQ(refusal("a b\nc d\n", "edges"), "0: found 4 nodes; allowed: 3, one per agent (agents.count)");
  EXPECT_EQ(refusal("0,1\n1,0\n", "csv"), "1: found 2 nodes; allowed: 3, one per agent (agents.count)");
  EXPECT_EQ(refusal("0,1,0\n1,0\n0,0,0\n", "csv"), "2: found row 2 with 2 cells; allowed: 3 rows of 3");
  EXPECT_EQ(refusal("0,1,0\n1,0,x\n0,0,0\n", "csv"), "2: found the weight 'x'; allowed: a number from 0 up");
  EXPECT_EQ(refusal("0,1,0\n1,0,0\n", "csv"), "2: found 2 rows; allowed: 3, one per agent");
  EXPECT_SAYS("1: found 0.5 on the diagonal, row 1; allowed: 0 there", refusal("0.5,0.5,0\n0,1,0\n0,0,1\n", "csv"));
  EXPECT_EQ(refusal("%%MatrixMarket matrix coordinate real general\n3 4 1\n1 2 1\n", "mtx"),
            "2: found a matrix 3 x 4; allowed: as many rows as columns");
  EXPECT_EQ(refusal("%%MatrixMarket matrix coordinate real general\n3 3 2\n1 2 1\n", "mtx"),
            "3: found 1 entries; allowed: 2, as the file announces");
  EXPECT_EQ(refusal("%%MatrixMarket matrix coordinate real general\n3 3 1\n1 4 1\n", "mtx"),
            "3: found '4'; allowed: a whole number from 1 to 3");
  EXPECT_SAYS("allowed: %%MatrixMarket matrix", refusal("%%MatrixMarket matrix coordinate complex general\n", "mtx"));
  EXPECT_SAYS("it is no XML", refusal("<graphml>\n<graph>", "graphml"));
  EXPECT_EQ(refusal("<graphml><graph>\n<node id='a'/><node id='b'/><node id='c'/>\n<edge source='a'/></graph></graphml>", "graphml"),
            "3: found <edge> without 'target'");
  EXPECT_EQ(
      refusal("<graphml><graph><node id='a'/><node id='b'/><node id='c'/>\n<edge source='a' target='d'/></graph></graphml>", "graphml"),
      "2: found an edge of the node 'd', which the file does not list");
  EXPECT_SAYS("2: it is no JSON", refusal("{\"nodes\": [\n", "json"));
  EXPECT_EQ(refusal(R"({"nodes": [{"id": 1}, {"id": 2}, {"id": []}]})", "json"), "0: found nodes[2].id []; allowed: text or a number");
  EXPECT_EQ(refusal("", "gml"), "0: its name ends in '.gml'; allowed: graphml, mtx, csv, edges, json");
}

TEST(GraphFile, IsNamedInAnExperimentAndWrittenOutWhenItIsResolved) {
  const Folder folder;
  std::ofstream(folder.path() / "ring.edges") << "1 2\n2 3 0.5\n3 1\n";
  const std::string text = "experiment: e\nrounds: 5\ndt: 0.1\nagents: {count: 3, protocol: local_voting, initial: {x: [1, 2, 3]}}\n";
  const Experiment experiment = parse_experiment(text + "topology: {file: ring.edges}\n", "e.yaml", folder.path());
  const Graph& graph = *experiment.schedule(experiment.seed).at(0);
  EXPECT_EQ(graph.edges(), (Weighted{edge(3, 1), edge(1, 2), edge(2, 3, 0.5)}));
  const Experiment again = parse_experiment(experiment.resolved_text, "e.yaml", "/nowhere");
  EXPECT_EQ(*again.schedule(again.seed).at(0), graph) << "without the file";
  EXPECT_EQ(parse_experiment(text + "topology: {file: {path: ring.edges, both_ways: true}}\n", "e.yaml", folder.path())
                .schedule(Seed{1})
                .at(0)
                ->edge_count(),
            6u);
  std::ofstream(folder.path() / "ring.edges") << "1 2\n2 3 x\n";
  const auto mistake = [&](const std::string& topology) {
    try {
      parse_experiment(text + "topology: " + topology, "e.yaml", folder.path());
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_SAYS("ring.edges:2:1: found the weight 'x'", mistake("{file: ring.edges}"));
  EXPECT_SAYS("e.yaml:5:18: topology.file: found 'star.edges', which cannot be read", mistake("{file: star.edges}"));
  EXPECT_SAYS("which cannot be read", mistake("{intervals: [{rounds: 1, topology: {file: ring.dot}}]}"));
}

TEST(GraphFile, IsReadAsNetworkxNumpyAndPandasWriteIt) {
  const Folder folder;
  folder.write("write.py", R"(import json, networkx, numpy
graph = networkx.DiGraph()
graph.add_nodes_from(["a", "b", "c", "d"])
graph.add_edge("a", "b", weight=0.5)
graph.add_edge("b", "c", weight=2.0)
graph.add_edge("d", "a", weight=1.0)
networkx.write_graphml(graph, "directed.graphml")
networkx.write_edgelist(graph, "data.edges")
networkx.write_weighted_edgelist(graph, "weighted.edges")
json.dump(networkx.node_link_data(graph), open("links.json", "w"))
receives = networkx.to_numpy_array(graph).T
numpy.savetxt("plain.csv", receives, delimiter=",")
networkx.to_pandas_adjacency(graph).T.to_csv("named.csv")
networkx.write_graphml(networkx.karate_club_graph(), "karate.graphml")
)");
  Program python(folder, "/usr/bin/python3",
                 {"-c", "import os; os.chdir('" + folder.path().string() + "'); exec(open('write.py').read())"});
  ASSERT_EQ(python.wait(), 0) << python.err();
  const Weighted wanted{edge(4, 1), edge(1, 2, 0.5), edge(2, 3, 2.0)};
  for (const char* name : {"directed.graphml", "data.edges", "weighted.edges", "links.json", "plain.csv", "named.csv"}) {
    SCOPED_TRACE(name);
    const std::filesystem::path file = folder.path() / name;
    EXPECT_EQ(read_graph_file(text_of(file), file.extension().string().substr(1), 4).graph.edges(), wanted);
  }
  const Graph karate = read_graph_file(text_of(folder.path() / "karate.graphml"), "graphml", std::nullopt).graph;
  EXPECT_EQ(karate.edge_count(), 2u * 78u);
  EXPECT_TRUE(undirected(karate));
}

}  // namespace
}  // namespace consort::script
