#include "core/counted.hpp"
#include "io/standard_streams.hpp"
#include "orchestrator/cli/help.hpp"
#include "orchestrator/cli/verbs.hpp"
#include "orchestrator/report/drawing.hpp"
#include "orchestrator/report/graphml.hpp"
#include "orchestrator/script/graph_file.hpp"
#include "orchestrator/script/input_file.hpp"
#include "orchestrator/script/script.hpp"
#include "orchestrator/script/yaml.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>

namespace consort {
namespace {

using script::NamedGraph;

constexpr std::size_t kMostExamined = 2000;  // agents: the spectrum takes a matrix of their square

NamedGraph graph_in_file(const std::filesystem::path& file, const std::string& ending, bool both_ways) {
  std::string text;
  try {
    text = read_input(file);
  } catch (const ConfigError& error) {
    throw ConfigError(fmt::format("{}: {}", file.string(), error.what()));
  }
  try {
    return script::read_graph_file(text, ending, std::nullopt, both_ways);
  } catch (const script::GraphFileError& error) {
    throw ConfigError(fmt::format("{}{}: {}", file.string(), error.line > 0 ? fmt::format(":{}", error.line) : "", error.what()));
  }
}

struct Degrees {
  std::size_t least = 0, most = 0;
};

template <class Degree>
Degrees degrees(const Graph& graph, const Degree& of) {
  Degrees out{graph.agents(), 0};
  for (std::size_t i = 0; i < graph.agents(); ++i) {
    out.least = std::min(out.least, of(agent_at(i)));
    out.most = std::max(out.most, of(agent_at(i)));
  }
  return out;
}

std::string range(const Degrees& of) { return of.least == of.most ? std::to_string(of.least) : fmt::format("{} to {}", of.least, of.most); }

class GraphVerb : public Verb {
 public:
  explicit GraphVerb(CLI::App& parent) : Verb(*parent.add_subcommand("graph", "")) {
    document(
        app_,
        "draw a graph, and say what theory asks about it\n"
        "FILE is an experiment, whose graph in round K is shown, or a graph of another program: GraphML (.graphml), MatrixMarket (.mtx), "
        "adjacency matrix (.csv), edge list (.edges), node-link data of networkx (.json). An edge from s to t means that t receives from "
        "s; in a matrix row i receives from column j. An experiment takes such a file by `topology: {file: FILE}`.",
        {{"consort graph experiments/leader_following.yaml", "Edges, degrees, connectivity, the spectrum of the Laplacian."},
         {"consort graph karate.graphml --svg > karate.svg", "A drawing."},
         {"consort graph experiments/table1_case1.yaml --round 3 --graphml", "For other programs."}},
        {{"0", "it is a graph"}, {"2", "it is not; the text names file, line, what was found and what is allowed"}});
    app_.add_option("file", file_, "An experiment (YAML), or a graph.")->required()->type_name("FILE");
    app_.add_option("--round", round_, "Of an experiment: the round whose graph is meant. Default: 0.")->type_name("K");
    app_.add_flag("--both-ways", both_ways_, "Of a graph file: every edge counts in both directions.");
    CLI::Option* dot = app_.add_flag("--dot", dot_, "Print it in Graphviz' language.");
    CLI::Option* svg = app_.add_flag("--svg", svg_, "Print a drawing.");
    app_.add_flag("--graphml", graphml_, "Print it as GraphML.")->excludes(dot)->excludes(svg);
    dot->excludes(svg);
    add_output_flags("Print the facts as JSON.", "Print nothing but what is wrong with the file.");
  }

  Exit execute() override {
    const NamedGraph read = this->read();
    if (dot_ || svg_ || graphml_) {
      streams::put(dot_   ? dot_of(read.graph, read.names)
                   : svg_ ? svg_of(read.graph, read.names)
                          : graphml_of(read.graph, read.names, file_.stem().string()));
      return Exit::ok;
    }
    show(text(read.graph), json(read.graph).dump(2) + "\n");
    return Exit::ok;
  }

 private:
  [[nodiscard]] NamedGraph read() const {
    const std::string ending = file_.extension().string();
    const auto endings = script::graph_file_endings();
    if (!ending.empty() && std::find(endings.begin(), endings.end(), ending.substr(1)) != endings.end())
      return graph_in_file(file_, ending.substr(1), both_ways_);
    const Experiment experiment = load_experiment(file_);
    return {*experiment.schedule(experiment.seed).at(round_), {}};
  }

  [[nodiscard]] static std::string text(const Graph& graph) {
    std::string out = fmt::format("{}: {}\n", counted(graph.agents(), "agent"), facts_of(graph));
    out += fmt::format("in-degree {}, out-degree {}\n", range(degrees(graph, [&](AgentId i) { return graph.in_degree(i); })),
                       range(degrees(graph, [&](AgentId i) { return graph.out_degree(i); })));
    if (graph.agents() > kMostExamined) return out + fmt::format("the spectrum is left out: more than {} agents\n", kMostExamined);
    return out + fmt::format("algebraic connectivity {:.6g}\n", algebraic_connectivity(graph));
  }

  [[nodiscard]] static nlohmann::ordered_json json(const Graph& graph) {
    const Degrees in = degrees(graph, [&](AgentId i) { return graph.in_degree(i); });
    const Degrees out = degrees(graph, [&](AgentId i) { return graph.out_degree(i); });
    nlohmann::ordered_json facts{{"agents", graph.agents()},
                                 {"edges", graph.edge_count()},
                                 {"undirected", undirected(graph)},
                                 {"strongly_connected", strongly_connected(graph)},
                                 {"spanning_tree", has_spanning_tree(graph)},
                                 {"balanced", balanced(graph)},
                                 {"in_degree", {in.least, in.most}},
                                 {"out_degree", {out.least, out.most}},
                                 {"algebraic_connectivity", nullptr}};
    if (graph.agents() <= kMostExamined) facts["algebraic_connectivity"] = algebraic_connectivity(graph);
    return facts;
  }

  std::filesystem::path file_;
  Round round_ = 0;
  bool both_ways_ = false, dot_ = false, svg_ = false, graphml_ = false;
};

}  // namespace

std::unique_ptr<Verb> make_graph_verb(CLI::App& parent) { return std::make_unique<GraphVerb>(parent); }

}  // namespace consort
