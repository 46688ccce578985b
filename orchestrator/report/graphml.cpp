#include "orchestrator/report/graphml.hpp"

#include "core/errors.hpp"
#include "core/number_text.hpp"

#include <fmt/format.h>

#include <pugixml.hpp>

#include <algorithm>
#include <fstream>
#include <sstream>

namespace consort {
namespace {

void declare(pugi::xml_node root, const char* id, const char* of, const char* type) {
  pugi::xml_node key = root.append_child("key");
  key.append_attribute("id").set_value(id);
  key.append_attribute("for").set_value(of);
  key.append_attribute("attr.name").set_value(id);
  key.append_attribute("attr.type").set_value(type);
}

void put(pugi::xml_node node, const char* key, const std::string& value) {
  pugi::xml_node data = node.append_child("data");
  data.append_attribute("key").set_value(key);
  data.text().set(value.c_str());
}

// Runs and rounds that have the graph: "run 0: 0-9, 20-29; run 1: 0-9".
std::string rounds_of_graph(Database& database, std::int64_t graph) {
  Statement row = database.prepare("SELECT run, first_round, last_round FROM segments WHERE graph = ? ORDER BY run, first_round");
  row.bind(0, graph);
  std::string text;
  std::int64_t run = -1;
  while (row.step()) {
    if (row.integer(0) == run)
      text += ", ";
    else
      text += fmt::format("{}run {}: ", text.empty() ? "" : "; ", row.integer(0));
    run = row.integer(0);
    text += fmt::format("{}-{}", row.integer(1), row.integer(2));
  }
  return text;
}

std::vector<WeightedEdge> edges_of_graph(Database& database, std::int64_t graph) {
  Statement edge = database.prepare("SELECT sender, receiver, weight FROM edges WHERE graph = ?");
  edge.bind(0, graph);
  std::vector<WeightedEdge> edges;
  const auto agent = [&](int column) { return AgentId{static_cast<std::uint32_t>(edge.integer(column))}; };
  while (edge.step()) edges.push_back({{agent(0), agent(1)}, edge.real(2)});
  return edges;
}

}  // namespace

std::string graphml_of(const Graph& graph, std::span<const std::string> names, const std::string& id, const std::string& rounds) {
  pugi::xml_document document;
  pugi::xml_node root = document.append_child("graphml");
  root.append_attribute("xmlns").set_value("http://graphml.graphdrawing.org/xmlns");
  if (!rounds.empty()) declare(root, "rounds", "graph", "string");
  declare(root, "weight", "edge", "double");
  pugi::xml_node body = root.append_child("graph");
  body.append_attribute("id").set_value(id.c_str());
  body.append_attribute("edgedefault").set_value("directed");
  if (!rounds.empty()) put(body, "rounds", rounds);
  const auto name = [&](AgentId agent) { return names.empty() ? std::to_string(agent.value) : names[index_of(agent)]; };
  for (std::size_t i = 0; i < graph.agents(); ++i) body.append_child("node").append_attribute("id").set_value(name(agent_at(i)).c_str());
  std::vector<WeightedEdge> edges = graph.edges();
  std::sort(edges.begin(), edges.end(), [](const WeightedEdge& a, const WeightedEdge& b) { return a.edge < b.edge; });
  for (const WeightedEdge& edge : edges) {
    pugi::xml_node node = body.append_child("edge");
    node.append_attribute("source").set_value(name(edge.edge.from).c_str());
    node.append_attribute("target").set_value(name(edge.edge.to).c_str());
    put(node, "weight", number_text(edge.weight));
  }
  std::ostringstream text;
  document.save(text, "  ");
  return text.str();
}

std::vector<WrittenTable> write_graphs(Database& database, const std::filesystem::path& folder) {
  std::vector<WrittenTable> written;
  Statement agents = database.prepare("SELECT agents FROM experiment");
  const auto nodes = agents.step() ? static_cast<std::size_t>(agents.integer(0)) : 0;
  for (Statement row = database.prepare("SELECT DISTINCT graph FROM segments ORDER BY graph"); row.step();) {
    const std::int64_t number = row.integer(0);
    const Graph graph(nodes, std::span<const WeightedEdge>(edges_of_graph(database, number)));
    const WrittenTable& file = written.emplace_back(WrittenTable{folder / fmt::format("graph_{}.graphml", number), graph.edge_count()});
    std::ofstream out(file.file, std::ios::binary);
    out << graphml_of(graph, {}, fmt::format("graph_{}", number), rounds_of_graph(database, number));
    if (!out.flush()) throw RunError("cannot write " + file.file.string());
  }
  return written;
}

}  // namespace consort
