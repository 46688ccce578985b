#pragma once
/// The canonical text of an experiment: every default written out. Loaded again it gives the same experiment.

#include "core/experiment.hpp"
#include "orchestrator/script/hosts.hpp"

#include <yaml-cpp/yaml.h>

#include <string>

namespace consort::script {

/// A number, a list or a list of rows.
YAML::Node matrix_node(const Matrix& value);

/// `topology` is the canonical topology node that read_topology() made.
std::string resolved(const Experiment& experiment, const YAML::Node& topology, const std::vector<Host>& hosts);

}  // namespace consort::script
