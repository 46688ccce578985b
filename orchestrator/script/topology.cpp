#include "orchestrator/script/topology.hpp"

#include "core/number_text.hpp"
#include "orchestrator/script/graphs.hpp"
#include "orchestrator/script/script.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>

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
      TopologyEntry{"file", "{file: graph.graphml}", "GraphML, MatrixMarket, adjacency CSV, edge list or node-link JSON"},
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

std::optional<TopologyRead> read_intervals(const TopologyContext& context, const YAML::Node& node, const std::string& what, bool periodic) {
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

std::optional<TopologyRead> read_random_pairs(const TopologyContext& context, const YAML::Node& node, const std::string& what) {
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

std::optional<TopologyRead> read_random_links(const TopologyContext& context, const YAML::Node& node, const std::string& what) {
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

std::optional<TopologyRead> read_topology(Mistakes& mistakes, const YAML::Node& node, const std::string& what,
                                          const std::filesystem::path& directory, std::size_t agents, Seed seed) {
  const TopologyContext context{mistakes, directory, agents, seed};
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
