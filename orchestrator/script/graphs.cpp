#include "orchestrator/script/graphs.hpp"

#include "core/counted.hpp"
#include "core/number_text.hpp"
#include "orchestrator/script/edges.hpp"
#include "orchestrator/script/graph_file.hpp"
#include "orchestrator/script/input_file.hpp"
#include "orchestrator/script/memory.hpp"
#include "orchestrator/script/topology.hpp"
#include "orchestrator/script/wording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

namespace consort::script {
namespace {

std::vector<std::string> topology_names() {
  std::vector<std::string> names;
  for (const auto& entry : topology_table()) names.emplace_back(entry.name);
  return names;
}

// Builds a graph; a family's own objection becomes a mistake at the node.
template <class Make>
std::optional<GraphRead> made(const TopologyContext& context, const YAML::Node& node, const std::string& what, std::string text,
                              YAML::Node canonical, Make make, double edges = 0.0) {
  constexpr double kEdgeBytes = 2 * sizeof(WeightedEdge) + 2 * sizeof(Neighbour);  // while it is made
  try {
    require_memory(kEdgeBytes * edges, fmt::format("a graph of {:.3g} edges", edges), "fewer agents or edges");
    return GraphRead{std::make_shared<const Graph>(make()), std::move(text), std::move(canonical)};
  } catch (const ConfigError& error) {
    context.mistakes.add(node, fmt::format("{}: {}", what, error.what()));
    return std::nullopt;
  }
}

std::optional<GraphRead> read_named(const TopologyContext& context, const YAML::Node& node, const std::string& what,
                                    const std::string& name) {
  const std::size_t n = context.agents;
  using Family = Graph (*)(std::size_t);
  for (const auto& [family, make] : {std::pair<std::string_view, Family>{"directed_ring", directed_ring},
                                     {"ring", ring},
                                     {"path", path},
                                     {"star", star},
                                     {"complete", complete}})
    if (name == family)
      return made(
          context, node, what, name, YAML::Node(name), [build = make, n] { return build(n); },
          name == "complete" ? static_cast<double>(n) * static_cast<double>(n) : 0.0);
  const auto names = topology_names();
  if (std::find(names.begin(), names.end(), name) != names.end()) {
    const auto entry =
        std::find_if(topology_table().begin(), topology_table().end(), [&name](const TopologyEntry& e) { return e.name == name; });
    context.mistakes.add(node, fmt::format("{}: found '{}' without its parameters; allowed: {}", what, name, entry->form));
  } else {
    context.mistakes.add(node, fmt::format("{}: found {}; allowed: {}{}", what, describe(node), listed(names), did_you_mean(name, names)));
  }
  return std::nullopt;
}

std::uint64_t own_seed(const TopologyContext& context, const Section& section) {
  if (const auto node = section.find("seed"); present(node))
    if (const auto seed = read_whole(context.mistakes, node, section.path("seed"), 0, std::numeric_limits<std::uint64_t>::max()))
      return *seed;
  return context.seed.value;
}

std::optional<GraphRead> read_erdos_renyi(const TopologyContext& context, const YAML::Node& node, const std::string& what) {
  const Section section(context.mistakes, node, what, "/definitions/topology_rule/properties/erdos_renyi");
  const auto p_node = section.required("p");
  const auto p = present(p_node) ? read_number(context.mistakes, p_node, section.path("p"), kProbability) : std::nullopt;
  bool directed = false;
  if (const auto directed_node = section.find("directed"); present(directed_node)) {
    const auto on = plain_switch(directed_node);
    if (!on)
      context.mistakes.add(directed_node,
                           fmt::format("{}: found {}; allowed: true or false", section.path("directed"), describe(directed_node)));
    directed = on.value_or(false);
  }
  const std::uint64_t seed = own_seed(context, section);
  if (!p) return std::nullopt;
  const double probability = *p;
  YAML::Node canonical;
  canonical["erdos_renyi"]["p"] = number_text(probability);
  canonical["erdos_renyi"]["directed"] = directed;
  canonical["erdos_renyi"]["seed"] = seed;
  return made(
      context, node, what, fmt::format("erdos_renyi(p = {}{}, seed {})", number_text(probability), directed ? ", directed" : "", seed),
      canonical, [&] { return erdos_renyi(context.agents, probability, directed, Seed{seed}); },
      probability * static_cast<double>(context.agents) * static_cast<double>(context.agents));
}

std::optional<GraphRead> read_random_geometric(const TopologyContext& context, const YAML::Node& node, const std::string& what) {
  const Section section(context.mistakes, node, what, "/definitions/topology_rule/properties/random_geometric");
  const auto radius_node = section.required("radius");
  const auto radius = present(radius_node) ? read_number(context.mistakes, radius_node, section.path("radius"), kPositive) : std::nullopt;
  const std::uint64_t seed = own_seed(context, section);
  if (!radius) return std::nullopt;
  YAML::Node canonical;
  canonical["random_geometric"]["radius"] = number_text(*radius);
  canonical["random_geometric"]["seed"] = seed;
  return made(context, node, what, fmt::format("random_geometric(radius {}, seed {})", number_text(*radius), seed), canonical,
              [&] { return random_geometric(context.agents, *radius, Seed{seed}); });
}

YAML::Node edge_node(const WeightedEdge& edge) {
  if (edge.weight == 1.0) return YAML::Node(edge_text(edge.edge));
  YAML::Node weighted;
  weighted["edge"] = edge_text(edge.edge);
  weighted["weight"] = number_text(edge.weight);
  return weighted;
}

std::optional<GraphRead> read_edge_graph(const TopologyContext& context, const YAML::Node& node, const std::string& what) {
  if (!node.IsSequence()) {
    context.mistakes.add(
        node, fmt::format("{}: found {}; allowed: a list of edges such as 1 -> 2, 2 <-> 3 or {{edge: 1 -> 2, weight: 0.5}}", what,
                          describe(node)));
    return std::nullopt;
  }
  const std::size_t before = context.mistakes.count();
  std::vector<WeightedEdge> edges;
  std::set<Edge> seen;
  YAML::Node list(YAML::NodeType::Sequence);
  for (std::size_t i = 0; i < node.size(); ++i) {
    const YAML::Node entry = node[i];
    const std::string place = fmt::format("{}[{}]", what, i);
    double weight = 1.0;
    std::vector<Edge> found;
    if (entry.IsMap()) {
      const Section section(context.mistakes, entry, place, "/definitions/weighted_edge");
      if (const auto edge_node = section.required("edge"); present(edge_node))
        found = read_edge(context.mistakes, edge_node, section.path("edge"), context.agents);
      if (const auto weight_node = section.find("weight"); present(weight_node))
        weight = read_number(context.mistakes, weight_node, section.path("weight"), kPositive).value_or(1.0);
    } else {
      found = read_edge(context.mistakes, entry, place, context.agents);
    }
    for (const Edge edge : found) {
      if (!seen.insert(edge).second)
        context.mistakes.add(entry, fmt::format("{}: found the edge {} a second time; allowed: each edge once", place, edge_text(edge)));
      edges.push_back({edge, weight});
      list.push_back(edge_node({edge, weight}));
    }
  }
  if (context.mistakes.count() != before) return std::nullopt;
  YAML::Node canonical;
  canonical["edges"] = list;
  return made(context, node, what, counted(edges.size(), "edge"), canonical, [&] { return Graph(context.agents, edges); });
}

std::optional<GraphRead> read_adjacency(const TopologyContext& context, const YAML::Node& node, const std::string& what) {
  const auto matrix = read_matrix(context.mistakes, node, what);
  if (!matrix) return std::nullopt;
  const auto n = static_cast<Eigen::Index>(context.agents);
  if (matrix->rows() != n || matrix->cols() != n) {
    context.mistakes.add(node, fmt::format("{}: found a matrix {} x {}; allowed: {} x {}, a row and a column per agent", what,
                                           matrix->rows(), matrix->cols(), n, n));
    return std::nullopt;
  }
  YAML::Node canonical;
  for (Eigen::Index i = 0; i < n; ++i) {
    YAML::Node row(YAML::NodeType::Sequence);
    for (Eigen::Index j = 0; j < n; ++j) row.push_back(number_text((*matrix)(i, j)));
    canonical["adjacency"].push_back(row);
  }
  return made(context, node, what, fmt::format("adjacency {} x {}", n, n), canonical, [&] { return from_adjacency(*matrix); });
}

// `{file: graph.graphml}`, or `{file: {path: graph.edges, both_ways: true}}`.
std::optional<GraphRead> read_file(const TopologyContext& context, const YAML::Node& node, const std::string& what) {
  YAML::Node path = node;
  bool both_ways = false;
  if (node.IsMap()) {
    const Section section(context.mistakes, node, what, "/definitions/topology_rule/properties/file/oneOf/1");
    path.reset(section.required("path"));  // = would change the document
    if (const auto switched = section.find("both_ways"); present(switched)) both_ways = plain_switch(switched).value_or(false);
    if (!present(path)) return std::nullopt;
  }
  const auto name = read_text(context.mistakes, path, what);
  if (!name) return std::nullopt;
  const std::filesystem::path file = context.directory / *name;
  try {
    const std::string ending = file.extension().string();
    const auto graph = std::make_shared<const Graph>(
        read_graph_file(read_input(file), ending.empty() ? ending : ending.substr(1), context.agents, both_ways).graph);
    YAML::Node canonical;
    canonical["edges"] = YAML::Node(YAML::NodeType::Sequence);
    for (const WeightedEdge& edge : graph->edges()) canonical["edges"].push_back(edge_node(edge));
    return GraphRead{graph, fmt::format("{}, {}", *name, counted(canonical["edges"].size(), "edge")), canonical};
  } catch (const GraphFileError& error) {
    if (error.line > 0) {
      context.mistakes.add(file.string(), error.line, 1, error.what());
    } else {
      context.mistakes.add(path, fmt::format("{}: '{}': {}", what, shown(*name), error.what()));
    }
  } catch (const ConfigError& error) {
    context.mistakes.add(path, fmt::format("{}: found '{}', which {} beside the experiment", what, shown(*name), error.what()));
  }
  return std::nullopt;
}

// The only key of a topology mapping and its value.
std::optional<std::pair<std::string, YAML::Node>> only_rule(const TopologyContext& context, const YAML::Node& node,
                                                            const std::string& what) {
  const std::size_t before = context.mistakes.count();
  const Section section(context.mistakes, node, what, "/definitions/topology_rule");
  if (!section.is_map() || context.mistakes.count() != before) return std::nullopt;
  if (node.size() != 1) {
    context.mistakes.add(node, fmt::format("{}: found {}; allowed: exactly one of {}", what, counted(node.size(), "key"),
                                           listed(schema_keys("/definitions/topology_rule"))));
    return std::nullopt;
  }
  return std::pair(node.begin()->first.Scalar(), YAML::Node(node.begin()->second));
}

}  // namespace

std::optional<GraphRead> read_graph(const TopologyContext& context, const YAML::Node& node, const std::string& what) {
  if (node.IsScalar() && node.Scalar() != "random_pairs") return read_named(context, node, what, node.Scalar());
  std::string key = "random_pairs";
  if (!node.IsScalar()) {
    const auto rule = only_rule(context, node, what);
    if (!rule) return std::nullopt;
    key = rule->first;
    const std::string place = what + "." + key;
    if (key == "erdos_renyi") return read_erdos_renyi(context, rule->second, place);
    if (key == "random_geometric") return read_random_geometric(context, rule->second, place);
    if (key == "edges") return read_edge_graph(context, rule->second, place);
    if (key == "file") return read_file(context, rule->second, place);
    if (key == "adjacency") return read_adjacency(context, rule->second, place);
  }
  context.mistakes.add(
      node,
      fmt::format("{}: found the schedule '{}' where one graph is needed; allowed: directed_ring, ring, path, star, complete, erdos_renyi, "
                  "random_geometric, edges, adjacency, file",
                  what, key));
  return std::nullopt;
}

}  // namespace consort::script
