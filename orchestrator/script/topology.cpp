#include "orchestrator/script/topology.hpp"

#include "core/counted.hpp"
#include "orchestrator/script/memory.hpp"
#include "orchestrator/script/script.hpp"
#include "orchestrator/script/wording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <set>

namespace consort {

std::span<const TopologyEntry> topology_table() {
  static constexpr std::array kTable{
      TopologyEntry{"directed_ring", "directed_ring", "1 -> 2 -> ... -> n -> 1"},
      TopologyEntry{"ring", "ring", "undirected cycle"},
      TopologyEntry{"path", "path", "undirected path 1 - 2 - ... - n"},
      TopologyEntry{"star", "star", "undirected star, agent 1 in the middle"},
      TopologyEntry{"complete", "complete", "everybody hears everybody"},
      TopologyEntry{"erdos_renyi", "{erdos_renyi: {p: 0.3, directed: false}}", "each pair joined with probability p; drawn once"},
      TopologyEntry{"random_geometric", "{random_geometric: {radius: 0.4}}", "points in the unit square joined within radius; drawn once"},
      TopologyEntry{"edges", "{edges: [1 -> 2, 2 <-> 3, {edge: 3 -> 1, weight: 0.5}]}", "explicit edges, sender -> receiver"},
      TopologyEntry{"adjacency", "{adjacency: [[0, 1], [1, 0]]}", "row i, column j: weight with which i receives from j"},
      TopologyEntry{"intervals", "{intervals: [{rounds: 5, topology: ring}, ...]}", "graphs one after the other; the last is held"},
      TopologyEntry{"periodic", "{periodic: [{rounds: 1, topology: ring}, ...]}", "graphs one after the other, then again"},
      TopologyEntry{"random_pairs", "{random_pairs: {dwell_rounds: [1, 8]}}",
                    "random perfect matchings, each kept for a random number of rounds"},
      TopologyEntry{"random_links", "{random_links: {base: ring, probability: 0.5}}",
                    "each edge of a base graph present with a probability, round by round"},
  };
  return kTable;
}

}  // namespace consort

namespace consort::script {

namespace {

// One reading of a topology: where messages go, and what the graphs are made of.
struct Context {
  Mistakes& mistakes;
  std::size_t agents;
  Seed seed;
};

struct GraphRead {
  std::shared_ptr<const Graph> graph;
  std::string text;
  YAML::Node canonical;
};

std::vector<std::string> topology_names() {
  std::vector<std::string> names;
  for (const auto& entry : topology_table()) names.emplace_back(entry.name);
  return names;
}

// Builds a graph; a family's own objection becomes a mistake at the node.
template <class Make>
std::optional<GraphRead> made(const Context& context, const YAML::Node& node, const std::string& what, std::string text,
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

std::optional<GraphRead> read_named(const Context& context, const YAML::Node& node, const std::string& what, const std::string& name) {
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

std::uint64_t own_seed(const Context& context, const Section& section) {
  if (const auto node = section.find("seed"); present(node))
    if (const auto seed = read_whole(context.mistakes, node, section.path("seed"), 0, std::numeric_limits<std::uint64_t>::max()))
      return *seed;
  return context.seed.value;
}

std::optional<GraphRead> read_erdos_renyi(const Context& context, const YAML::Node& node, const std::string& what) {
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

std::optional<GraphRead> read_random_geometric(const Context& context, const YAML::Node& node, const std::string& what) {
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

std::optional<GraphRead> read_edge_graph(const Context& context, const YAML::Node& node, const std::string& what) {
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
      if (weight == 1.0) {
        list.push_back(edge_text(edge));
      } else {
        YAML::Node weighted;
        weighted["edge"] = edge_text(edge);
        weighted["weight"] = number_text(weight);
        list.push_back(weighted);
      }
    }
  }
  if (context.mistakes.count() != before) return std::nullopt;
  YAML::Node canonical;
  canonical["edges"] = list;
  return made(context, node, what, counted(edges.size(), "edge"), canonical, [&] { return Graph(context.agents, edges); });
}

std::optional<GraphRead> read_adjacency(const Context& context, const YAML::Node& node, const std::string& what) {
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

// The only key of a topology mapping and its value.
std::optional<std::pair<std::string, YAML::Node>> only_rule(const Context& context, const YAML::Node& node, const std::string& what) {
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

// A graph that stays the same: a name or a rule that is no schedule.
std::optional<GraphRead> read_graph(const Context& context, const YAML::Node& node, const std::string& what) {
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
    if (key == "adjacency") return read_adjacency(context, rule->second, place);
  }
  context.mistakes.add(
      node,
      fmt::format("{}: found the schedule '{}' where one graph is needed; allowed: directed_ring, ring, path, star, complete, erdos_renyi, "
                  "random_geometric, edges, adjacency",
                  what, key));
  return std::nullopt;
}

std::optional<TopologyRead> read_intervals(const Context& context, const YAML::Node& node, const std::string& what, bool periodic) {
  if (!node.IsSequence() || node.size() == 0) {
    context.mistakes.add(node, fmt::format("{}: found {}; allowed: a list of {{rounds: 5, topology: ring}}", what, describe(node)));
    return std::nullopt;
  }
  const std::string key = periodic ? "periodic" : "intervals";
  FixedSchedule schedule;
  schedule.periodic = periodic;
  TopologyRead out;
  for (std::size_t i = 0; i < node.size(); ++i) {
    const Section section(context.mistakes, node[i], fmt::format("{}[{}]", what, i), "/definitions/interval");
    if (!section.is_map()) continue;
    const auto rounds_node = section.required("rounds");
    const auto rounds =
        present(rounds_node) ? read_whole(context.mistakes, rounds_node, section.path("rounds"), 1, kMostRounds) : std::nullopt;
    const auto graph_node = section.required("topology");
    const auto graph = present(graph_node) ? read_graph(context, graph_node, section.path("topology")) : std::nullopt;
    if (!rounds || !graph) continue;
    schedule.intervals.push_back({graph->graph, static_cast<Round>(*rounds)});
    YAML::Node entry;
    entry["rounds"] = *rounds;
    entry["topology"] = graph->canonical;
    out.canonical[key].push_back(entry);
    out.text += fmt::format("{}{} for {}", out.text.empty() ? "" : ", ", graph->text, *rounds);
  }
  if (schedule.intervals.size() != node.size()) return std::nullopt;
  out.text = fmt::format("{}({})", key, out.text);
  out.spec = std::move(schedule);
  return out;
}

std::optional<TopologyRead> read_random_pairs(const Context& context, const YAML::Node& node, const std::string& what) {
  RandomPairs pairs;
  if (!node.IsScalar() && !node.IsNull()) {
    const Section section(context.mistakes, node, what, "/definitions/topology_rule/properties/random_pairs");
    if (const auto dwell = section.find("dwell_rounds"); present(dwell)) {
      const auto low = dwell.IsSequence() && dwell.size() == 2 ? whole_number(dwell[0]) : std::nullopt;
      const auto high = low ? whole_number(dwell[1]) : std::nullopt;
      if (!high || *low < 1 || *high < *low || *high > kMostRounds) {
        context.mistakes.add(
            dwell, fmt::format("{}: found {}; allowed: [shortest, longest], whole numbers of rounds with 1 <= shortest <= longest",
                               section.path("dwell_rounds"), describe(dwell)));
        return std::nullopt;
      }
      pairs = {static_cast<Round>(*low), static_cast<Round>(*high)};
    }
  }
  TopologyRead out{pairs, fmt::format("random_pairs(dwell {}..{})", pairs.dwell_min, pairs.dwell_max), {}};
  out.canonical["random_pairs"]["dwell_rounds"].push_back(pairs.dwell_min);
  out.canonical["random_pairs"]["dwell_rounds"].push_back(pairs.dwell_max);
  return out;
}

std::optional<TopologyRead> read_random_links(const Context& context, const YAML::Node& node, const std::string& what) {
  const Section section(context.mistakes, node, what, "/definitions/topology_rule/properties/random_links");
  const auto base_node = section.required("base");
  const auto base = present(base_node) ? read_graph(context, base_node, section.path("base")) : std::nullopt;
  const auto p_node = section.required("probability");
  const auto p = present(p_node) ? read_number(context.mistakes, p_node, section.path("probability"), kProbability) : std::nullopt;
  if (!base || !p) return std::nullopt;
  TopologyRead out{RandomLinks{base->graph, *p}, fmt::format("random_links({}, probability {})", base->text, number_text(*p)), {}};
  out.canonical["random_links"]["base"] = base->canonical;
  out.canonical["random_links"]["probability"] = number_text(*p);
  return out;
}

}  // namespace

std::string edge_text(Edge edge) { return fmt::format("{} -> {}", edge.from.value, edge.to.value); }

std::vector<Edge> read_edge(Mistakes& mistakes, const YAML::Node& node, const std::string& what, std::size_t agents) {
  const auto refuse = [&](const std::string& why) {
    mistakes.add(
        node, fmt::format("{}: found {}{}; allowed: sender -> receiver with agents 1 to {}, such as 1 -> 2, 2 <-> 3 or 1 -> 2 -> 3", what,
                          describe(node), why, agents));
    return std::vector<Edge>{};
  };
  if (!node.IsScalar()) return refuse("");
  std::string_view rest = node.Scalar();
  const auto skip = [&rest] { rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size())); };
  std::vector<Edge> edges;
  std::optional<AgentId> last;
  bool both = false;
  while (true) {
    skip();
    std::uint32_t id = 0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), id);
    if (error != std::errc()) return refuse("");
    if (id < 1 || id > agents) return refuse(fmt::format(", and there is no agent {}", id));
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    const AgentId here{id};
    if (last) {
      if (*last == here) return refuse(", an edge from an agent to itself (it is implied, never listed)");
      edges.push_back({*last, here});
      if (both) edges.push_back({here, *last});
    }
    last = here;
    skip();
    if (rest.empty()) break;
    both = rest.starts_with("<->");
    if (!both && !rest.starts_with("->")) return refuse("");
    rest.remove_prefix(both ? 3 : 2);
  }
  return edges.empty() ? refuse("") : edges;
}

std::vector<Edge> read_edges(Mistakes& mistakes, const YAML::Node& node, const std::string& what, std::size_t agents) {
  if (!node.IsSequence() || node.size() == 0) {
    mistakes.add(node, fmt::format("{}: found {}; allowed: a list of edges such as [1 -> 2, 2 <-> 3]", what, describe(node)));
    return {};
  }
  std::vector<Edge> edges;
  std::set<Edge> seen;
  for (std::size_t i = 0; i < node.size(); ++i) {
    for (const Edge edge : read_edge(mistakes, node[i], fmt::format("{}[{}]", what, i), agents)) {
      if (!seen.insert(edge).second)
        mistakes.add(node[i], fmt::format("{}[{}]: found the edge {} a second time; allowed: each edge once", what, i, edge_text(edge)));
      edges.push_back(edge);
    }
  }
  return edges;
}

std::optional<TopologyRead> read_topology(Mistakes& mistakes, const YAML::Node& node, const std::string& what, std::size_t agents,
                                          Seed seed) {
  const Context context{mistakes, agents, seed};
  if (node.IsScalar() && node.Scalar() == "random_pairs") return read_random_pairs(context, node, what);
  if (node.IsMap() && node.size() == 1 && node.begin()->first.IsScalar()) {
    const std::string key = node.begin()->first.Scalar();
    const YAML::Node value = node.begin()->second;
    const std::string place = what + "." + key;
    if (key == "intervals" || key == "periodic") return read_intervals(context, value, place, key == "periodic");
    if (key == "random_pairs") return read_random_pairs(context, value, place);
    if (key == "random_links") return read_random_links(context, value, place);
  }
  auto graph = read_graph(context, node, what);
  if (!graph) return std::nullopt;
  FixedSchedule constant;
  constant.intervals.push_back({graph->graph, 1});
  return TopologyRead{std::move(constant), graph->text, graph->canonical};
}

}  // namespace consort::script
