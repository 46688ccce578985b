#pragma once
/// The topology part of the experiment file: graph families and schedules.

#include "core/network/schedule.hpp"
#include "orchestrator/script/yaml.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace consort {

/// A graph family or schedule of the experiment file, for `consort list topologies`.
struct TopologyEntry {
  std::string_view name;
  std::string_view form;     ///< how it is written in the file
  std::string_view summary;  ///< one line
};
std::span<const TopologyEntry> topology_table();

}  // namespace consort

namespace consort::script {

struct TopologyRead {
  Schedule::Spec spec;
  std::string text;      ///< as the user would say it, e.g. "random_pairs(dwell 1..8)"
  YAML::Node canonical;  ///< every default written out, seeds included
};

/// Reads a whole topology. `seed` is what random families take if they name none of their own; files are named from `directory`.
std::optional<TopologyRead> read_topology(Mistakes&, const YAML::Node&, const std::string& what, const std::filesystem::path& directory,
                                          std::size_t agents, Seed seed);

}  // namespace consort::script
