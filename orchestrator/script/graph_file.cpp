#include "orchestrator/script/graph_file.hpp"

#include "core/counted.hpp"
#include "core/number_text.hpp"
#include "orchestrator/script/agents.hpp"
#include "orchestrator/script/wording.hpp"
#include "orchestrator/script/yaml.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <set>
#include <unordered_map>
#include <utility>

namespace consort::script {
namespace {

using Reader = void (*)(std::string_view, GraphBuilder&);
constexpr std::array<std::pair<std::string_view, Reader>, 5> kReaders{{{"graphml", read_graphml},
                                                                       {"mtx", read_matrix_market},
                                                                       {"csv", read_adjacency_csv},
                                                                       {"edges", read_edge_list},
                                                                       {"json", read_node_link}}};

// Nodes of an edge list by their names: numbers before words, numbers by their size.
bool before(const std::string& a, const std::string& b) {
  const auto number_a = parse_number<std::uint64_t>(a), number_b = parse_number<std::uint64_t>(b);
  if (number_a && number_b) return *number_a < *number_b;
  if (number_a || number_b) return number_a.has_value();
  return a < b;
}

bool is_agent(const std::string& name, std::size_t agents) {
  const auto number = parse_number<std::uint64_t>(name);
  return number && *number >= 1 && *number <= agents && std::to_string(*number) == name;
}

}  // namespace

std::vector<std::string> graph_file_endings() {
  std::vector<std::string> endings;
  for (const auto& reader : kReaders) endings.emplace_back(reader.first);
  return endings;
}

NamedGraph read_graph_file(std::string_view text, std::string_view ending, std::optional<std::size_t> agents, bool both_ways) {
  const auto reader = std::find_if(kReaders.begin(), kReaders.end(), [&](const auto& entry) { return entry.first == ending; });
  if (reader == kReaders.end()) {
    const auto endings = graph_file_endings();
    throw GraphFileError(0, fmt::format("its name ends in '.{}'; allowed: {}{}", shown(ending), listed(endings),
                                        did_you_mean(std::string(ending), endings)));
  }
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // a byte order mark
  GraphBuilder builder(agents, both_ways);
  reader->second(text, builder);
  return builder.graph();
}

std::size_t line_at(std::string_view text, std::size_t offset) {
  return 1 + static_cast<std::size_t>(
                 std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(std::min(offset, text.size())), '\n'));
}

double graph_weight(std::size_t line, std::string_view text) {
  const auto weight = finite_number(text);
  if (!weight || *weight < 0.0) throw GraphFileError(line, fmt::format("found the weight '{}'; allowed: a number from 0 up", shown(text)));
  return *weight;
}

void GraphBuilder::require_count(std::size_t line, std::size_t nodes) const {
  if (agents_ && nodes != *agents_)
    throw GraphFileError(line, fmt::format("found {}; allowed: {}, one per agent (agents.count)", counted(nodes, "node"), *agents_));
  if (nodes == 0 || nodes > kMostAgents)
    throw GraphFileError(line, fmt::format("found {}; allowed: 1 to {}", counted(nodes, "node"), kMostAgents));
}

void GraphBuilder::add_node(std::size_t line, std::string name) {
  if (nodes_.size() == agents_.value_or(kMostAgents)) require_count(line, nodes_.size() + 1);
  nodes_.push_back(std::move(name));
}

void GraphBuilder::add_edge(std::size_t line, std::string from, std::string to, double weight, bool directed) {
  if (weight == 0.0) return;
  if (from == to)
    throw GraphFileError(line, fmt::format("found an edge from '{0}' to '{0}'; allowed: edges between two nodes (what an agent "
                                           "makes of its own value is the protocol's)",
                                           shown(from)));
  edges_.push_back({line, std::move(from), std::move(to), weight, directed && !both_ways_});
}

void GraphBuilder::add_matrix(std::size_t line, std::size_t rows, std::size_t columns) {
  if (rows != columns) throw GraphFileError(line, fmt::format("found a matrix {} x {}; allowed: as many rows as columns", rows, columns));
  require_count(line, rows);
  for (std::size_t node = 1; node <= rows; ++node) add_node(line, std::to_string(node));
}

void GraphBuilder::add_entry(std::size_t line, std::size_t row, std::size_t column, double weight) {
  if (row == column && weight != 0.0)
    throw GraphFileError(line,
                         fmt::format("found {} on the diagonal, row {}; allowed: 0 there (what an agent makes of its own value is the "
                                     "protocol's; of weights whose rows sum to 1, what is left of 1)",
                                     number_text(weight), row));
  add_edge(line, std::to_string(column), std::to_string(row), weight, true);
}

std::vector<std::string> GraphBuilder::names() const {
  if (!nodes_.empty()) return nodes_;
  std::set<std::string> called;
  for (const Line& edge : edges_) called.insert({edge.from, edge.to});
  std::vector<std::string> sorted(called.begin(), called.end());
  if (std::all_of(sorted.begin(), sorted.end(), [this](const auto& name) { return is_agent(name, agents_.value_or(kMostAgents)); })) {
    const auto most = [](std::size_t so_far, const auto& name) {
      return std::max<std::size_t>(so_far, *parse_number<std::uint64_t>(name));
    };
    const std::size_t last = agents_.value_or(std::accumulate(sorted.begin(), sorted.end(), std::size_t{0}, most));
    sorted.clear();  // agents, some of which may have no edge
    for (std::size_t agent = 1; agent <= last; ++agent) sorted.push_back(std::to_string(agent));
  }
  std::sort(sorted.begin(), sorted.end(), before);
  return sorted;
}

NamedGraph GraphBuilder::graph() const {
  const std::vector<std::string> nodes = names();
  require_count(0, nodes.size());
  const bool numbered = std::all_of(nodes.begin(), nodes.end(), [&nodes](const auto& name) { return is_agent(name, nodes.size()); });
  std::unordered_map<std::string, AgentId> agent_of;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const AgentId agent = numbered ? AgentId{static_cast<std::uint32_t>(*parse_number<std::uint64_t>(nodes[i]))} : agent_at(i);
    if (!agent_of.emplace(nodes[i], agent).second)
      throw GraphFileError(0, fmt::format("found two nodes called '{}'; allowed: each once", shown(nodes[i])));
  }
  const auto agent = [&](const Line& line, const std::string& name) {
    const auto found = agent_of.find(name);
    if (found == agent_of.end())
      throw GraphFileError(line.number, fmt::format("found an edge of the node '{}', which the file does not list", shown(name)));
    return found->second;
  };
  std::vector<WeightedEdge> edges;
  std::set<Edge> seen;
  for (const Line& line : edges_) {
    const Edge edge{agent(line, line.from), agent(line, line.to)};
    for (const Edge each : {edge, Edge{edge.to, edge.from}}) {
      if (!seen.insert(each).second)
        throw GraphFileError(line.number, fmt::format("found the edge from '{}' to '{}' a second time; allowed: each edge once",
                                                      shown(line.from), shown(line.to)));
      edges.push_back({each, line.weight});
      if (line.directed) break;
    }
  }
  return {Graph(nodes.size(), edges), numbered ? std::vector<std::string>{} : nodes};
}

}  // namespace consort::script
