#include "orchestrator/report/drawing.hpp"

#include "core/errors.hpp"
#include "core/number_text.hpp"

#include <fmt/format.h>
#include <graphviz/gvc.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>

namespace consort {
namespace {

struct Free {
  void operator()(Agraph_t* graph) const { agclose(graph); }
  void operator()(char* rendered) const { gvFreeRenderData(rendered); }
};

// Graphviz has one context in a process, for ever (a second one uses what the first has freed), and one user at a time.
class Drawing {
 public:
  Drawing() : alone_(one_at_a_time()) {}
  [[nodiscard]] GVC_t* context() const {
    static GVC_t* const only = gvContext();
    return only;
  }

 private:
  static std::mutex& one_at_a_time() {
    static std::mutex mutex;
    return mutex;
  }
  std::lock_guard<std::mutex> alone_;
};

// Cycles and trees look like what they are; with more edges, circo would take hours, and springs a moment.
const char* engine_for(std::size_t agents, std::size_t drawn) { return drawn <= agents ? "circo" : "neato"; }

std::string quoted(const std::string& name) {
  std::string out = "\"";
  for (const char c : name) out += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  return out + "\"";
}

// Its other direction is there, with the same weight.
bool has_twin(const Graph& graph, const WeightedEdge& edge) {
  const auto heard = graph.in_neighbours(edge.edge.from);
  return std::find(heard.begin(), heard.end(), Neighbour{edge.edge.to, edge.weight}) != heard.end();
}

}  // namespace

std::vector<std::pair<double, double>> places_of(std::size_t agents, const std::set<Edge>& edges) {
  const Drawing drawing;
  std::string name = "network";
  const std::unique_ptr<Agraph_t, Free> graph(agopen(name.data(), Agundirected, nullptr));
  std::string label = "label", nothing;
  agattr(graph.get(), AGNODE, label.data(), nothing.data());  // no text, so no fonts
  std::vector<Agnode_t*> nodes;
  for (std::size_t i = 0; i < agents; ++i) nodes.push_back(agnode(graph.get(), std::to_string(i + 1).data(), 1));
  std::set<std::pair<std::size_t, std::size_t>> drawn;
  for (const Edge& edge : edges) {
    const std::pair<std::size_t, std::size_t> ends = std::minmax({index_of(edge.from), index_of(edge.to)});
    if (drawn.insert(ends).second) agedge(graph.get(), nodes[ends.first], nodes[ends.second], nullptr, 1);
  }
  std::vector<std::pair<double, double>> places(agents, {0.5, 0.5});
  if (gvLayout(drawing.context(), graph.get(), engine_for(agents, drawn.size())) != 0) return places;
  double left = 1e300, right = -1e300, bottom = 1e300, top = -1e300;
  for (std::size_t i = 0; i < agents; ++i) {
    const pointf at = ND_coord(nodes[i]);
    places[i] = {at.x, at.y};
    left = std::min(left, at.x);
    right = std::max(right, at.x);
    bottom = std::min(bottom, at.y);
    top = std::max(top, at.y);
  }
  const double size = std::max({right - left, top - bottom, 1e-9});
  for (auto& [x, y] : places) {  // four digits are more than a screen has
    x = std::round(1e4 * ((x - left) / size + 0.5 * (1.0 - (right - left) / size))) / 1e4;
    y = std::round(1e4 * ((top - y) / size + 0.5 * (1.0 - (top - bottom) / size))) / 1e4;
  }
  gvFreeLayout(drawing.context(), graph.get());
  return places;
}

std::string facts_of(const Graph& graph) {
  std::string text = fmt::format("{} edge{}", graph.edge_count(), graph.edge_count() == 1 ? "" : "s");
  if (undirected(graph)) text += ", undirected";
  text += strongly_connected(graph) ? ", strongly connected" : has_spanning_tree(graph) ? ", with a spanning tree" : ", not connected";
  return text + (balanced(graph) ? ", balanced" : ", not balanced");
}

std::string dot_of(const Graph& graph, std::span<const std::string> names) {
  std::string out =
      "digraph network {\n"
      "  graph [overlap=scale, outputorder=edgesfirst]\n"
      "  node [shape=circle, style=filled, fillcolor=white, margin=0.03, fontname=\"sans-serif\"]\n"
      "  edge [color=gray50, fontsize=9, fontname=\"sans-serif\"]\n";
  const auto name = [&](AgentId agent) { return names.empty() ? std::to_string(agent.value) : quoted(names[index_of(agent)]); };
  for (std::size_t i = 0; i < graph.agents(); ++i) out += fmt::format("  {}\n", name(agent_at(i)));
  for (const WeightedEdge& edge : graph.edges()) {
    const bool twin = has_twin(graph, edge);
    if (twin && edge.edge.to < edge.edge.from) continue;  // drawn with the other
    std::vector<std::string> details;
    if (twin) details.emplace_back("dir=none");
    if (edge.weight != 1.0) details.push_back(fmt::format("label={}", quoted(number_text(edge.weight))));
    out += fmt::format("  {} -> {}{}\n", name(edge.edge.from), name(edge.edge.to),
                       details.empty() ? "" : fmt::format(" [{}]", fmt::join(details, ", ")));
  }
  return out + "}\n";
}

std::string svg_of(const Graph& graph, std::span<const std::string> names) {
  const Drawing drawing;
  const std::unique_ptr<Agraph_t, Free> drawn(agmemread(dot_of(graph, names).c_str()));
  if (!drawn || gvLayout(drawing.context(), drawn.get(), engine_for(graph.agents(), static_cast<std::size_t>(agnedges(drawn.get())))) != 0)
    throw RunError("Graphviz cannot lay this graph out");
  char* text = nullptr;
  unsigned length = 0;
  const int failed = gvRenderData(drawing.context(), drawn.get(), "svg", &text, &length);
  const std::unique_ptr<char, Free> rendered(text);
  gvFreeLayout(drawing.context(), drawn.get());
  if (failed != 0) throw RunError("Graphviz cannot draw SVG");
  return {text, length};
}

}  // namespace consort
