// Graph files that are trees: GraphML as XML, node-link data as JSON.

#include "orchestrator/script/graph_file.hpp"
#include "orchestrator/script/yaml.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <pugixml.hpp>

namespace consort::script {
namespace {

// The key under which GraphML keeps weights of edges; empty: none has one.
std::string weight_key(const pugi::xml_node& root) {
  for (const pugi::xml_node key : root.children("key")) {
    const std::string_view of = key.attribute("for").as_string("all");
    if (std::string_view(key.attribute("attr.name").as_string()) == "weight" && (of == "edge" || of == "all"))
      return key.attribute("id").as_string();
  }
  return {};
}

double weight_of(std::size_t line, const pugi::xml_node& edge, const std::string& key) {
  if (!key.empty())
    for (const pugi::xml_node data : edge.children("data"))
      if (key == data.attribute("key").as_string()) return graph_weight(line, data.text().as_string());
  return 1.0;
}

std::size_t place_of(const pugi::xml_node& node) { return static_cast<std::size_t>(std::max<std::ptrdiff_t>(node.offset_debug(), 0)); }

std::string needed(std::size_t line, const pugi::xml_node& node, const char* attribute) {
  const std::string value = node.attribute(attribute).as_string();
  if (value.empty()) throw GraphFileError(line, fmt::format("found <{}> without '{}'", node.name(), attribute));
  return value;
}

// A node's name: text, or a number as Python writes it.
std::string name_of_node(const nlohmann::json& value, const std::string& what) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number()) return value.dump();
  throw GraphFileError(0, fmt::format("found {} {}; allowed: text or a number", what, shown(value.dump().substr(0, 60))));
}

const nlohmann::json& list_of(const nlohmann::json& graph, const char* key) {
  static const nlohmann::json nothing = nlohmann::json::array();
  const auto found = graph.find(key);
  if (found == graph.end()) return nothing;
  if (!found->is_array()) throw GraphFileError(0, fmt::format("found '{}' that is no list", key));
  return *found;
}

const nlohmann::json& member(const nlohmann::json& of, const char* key, const std::string& what) {
  if (of.is_object())
    if (const auto found = of.find(key); found != of.end()) return *found;
  throw GraphFileError(0, fmt::format("found {} without '{}'", what, key));
}

bool switch_of(const nlohmann::json& graph, const char* key) {
  const auto found = graph.find(key);
  return found != graph.end() && found->is_boolean() && found->get<bool>();
}

double weight_in(const nlohmann::json& edge, const std::string& what) {
  const auto found = edge.find("weight");
  if (found == edge.end() || found->is_null()) return 1.0;
  if (!found->is_number())
    throw GraphFileError(0, fmt::format("found {} with the weight {}; allowed: a number", what, shown(found->dump().substr(0, 60))));
  return graph_weight(0, found->dump());
}

}  // namespace

void read_graphml(std::string_view text, GraphBuilder& into) {
  pugi::xml_document document;
  const pugi::xml_parse_result result = document.load_buffer(text.data(), text.size());
  if (!result)
    throw GraphFileError(line_at(text, static_cast<std::size_t>(std::max<std::ptrdiff_t>(result.offset, 0))),
                         fmt::format("it is no XML: {}", result.description()));
  const pugi::xml_node root = document.child("graphml"), graph = root.child("graph");
  if (!graph) throw GraphFileError(1, "found no <graph> in a <graphml>");
  if (const pugi::xml_node second = graph.next_sibling("graph"))
    throw GraphFileError(line_at(text, place_of(second)), "found a second <graph>; allowed: one");
  const bool directed = std::string_view(graph.attribute("edgedefault").as_string("directed")) != "undirected";
  const std::string key = weight_key(root);
  // Lines are counted on the way: the file's order is that of its text.
  std::size_t line = 1, counted_to = 0;
  for (const pugi::xml_node node : graph.children()) {
    const std::size_t offset = std::clamp(place_of(node), counted_to, text.size());
    line += line_at(text.substr(counted_to), offset - counted_to) - 1;
    counted_to = offset;
    const std::string_view name = node.name();
    if (name == "node") {
      if (node.child("graph")) throw GraphFileError(line, "found a graph within a node; allowed: nodes and edges of one graph");
      into.add_node(line, needed(line, node, "id"));
    } else if (name == "edge") {
      into.add_edge(line, needed(line, node, "source"), needed(line, node, "target"), weight_of(line, node, key),
                    node.attribute("directed").as_bool(directed));
    } else if (name == "hyperedge") {
      throw GraphFileError(line, "found a hyperedge; allowed: edges between two nodes");
    }
  }
}

void read_node_link(std::string_view text, GraphBuilder& into) {
  nlohmann::json graph;
  try {
    graph = nlohmann::json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    throw GraphFileError(line_at(text, error.byte), "it is no JSON: the text breaks off or has a character that does not belong there");
  } catch (const nlohmann::json::out_of_range&) {
    throw GraphFileError(0, "found a number beyond 1e308");
  }
  if (!graph.is_object() || !graph.contains("nodes"))
    throw GraphFileError(1, "found no object with 'nodes' and 'links' (or 'edges'), as networkx writes node-link data");
  const bool directed = switch_of(graph, "directed");
  for (std::size_t i = 0; const nlohmann::json& node : list_of(graph, "nodes")) {
    const std::string what = fmt::format("nodes[{}]", i++);
    into.add_node(0, name_of_node(member(node, "id", what), what + ".id"));
  }
  const char* key = graph.contains("links") ? "links" : "edges";
  for (std::size_t i = 0; const nlohmann::json& edge : list_of(graph, key)) {
    const std::string what = fmt::format("{}[{}]", key, i++);
    into.add_edge(0, name_of_node(member(edge, "source", what), what + ".source"),
                  name_of_node(member(edge, "target", what), what + ".target"), weight_in(edge, what), directed);
  }
}

}  // namespace consort::script
