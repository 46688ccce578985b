#include "orchestrator/report/graphml.hpp"

#include "core/errors.hpp"

#include <fmt/format.h>

#include <pugixml.hpp>

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

}  // namespace

std::vector<WrittenTable> write_graphs(Database& database, const std::filesystem::path& folder) {
  std::vector<WrittenTable> written;
  Statement agents = database.prepare("SELECT agents FROM experiment");
  const std::int64_t nodes = agents.step() ? agents.integer(0) : 0;
  for (Statement graph = database.prepare("SELECT DISTINCT graph FROM segments ORDER BY graph"); graph.step();) {
    const std::int64_t number = graph.integer(0);
    pugi::xml_document document;
    pugi::xml_node root = document.append_child("graphml");
    root.append_attribute("xmlns").set_value("http://graphml.graphdrawing.org/xmlns");
    declare(root, "rounds", "graph", "string");
    declare(root, "weight", "edge", "double");
    pugi::xml_node body = root.append_child("graph");
    body.append_attribute("id").set_value(fmt::format("graph_{}", number).c_str());
    body.append_attribute("edgedefault").set_value("directed");
    put(body, "rounds", rounds_of_graph(database, number));
    for (std::int64_t agent = 1; agent <= nodes; ++agent)
      body.append_child("node").append_attribute("id").set_value(std::to_string(agent).c_str());
    Statement edge = database.prepare("SELECT sender, receiver, weight FROM edges WHERE graph = ? ORDER BY sender, receiver");
    edge.bind(0, number);
    WrittenTable& file = written.emplace_back(WrittenTable{folder / fmt::format("graph_{}.graphml", number)});
    for (; edge.step(); ++file.rows) {
      pugi::xml_node node = body.append_child("edge");
      node.append_attribute("source").set_value(edge.text(0).c_str());
      node.append_attribute("target").set_value(edge.text(1).c_str());
      put(node, "weight", fmt::format("{}", edge.real(2)));
    }
    if (!document.save_file(file.file.c_str(), "  ")) throw RunError("cannot write " + file.file.string());
  }
  return written;
}

}  // namespace consort
