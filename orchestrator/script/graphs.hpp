#pragma once
/// One graph of the experiment file: a family by its name, or a rule that is no schedule.

#include "core/network/graph.hpp"
#include "core/random.hpp"
#include "orchestrator/script/yaml.hpp"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

namespace consort::script {

/// One reading of a topology: where messages go, and what the graphs are made of.
struct TopologyContext {
  Mistakes& mistakes;
  std::filesystem::path directory;  ///< of the experiment: files are named from there
  std::size_t agents;
  Seed seed;
};

struct GraphRead {
  std::shared_ptr<const Graph> graph;
  std::string text;
  YAML::Node canonical;
};

/// A graph that stays the same.
std::optional<GraphRead> read_graph(const TopologyContext& context, const YAML::Node& node, const std::string& what);

}  // namespace consort::script
