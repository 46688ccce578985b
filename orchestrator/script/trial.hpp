#pragma once
/// Every agent is made once as the file is read, to hear early what its protocol, the links and the record object to.

#include "orchestrator/script/agents.hpp"

#include <string>
#include <vector>

namespace consort::script {

/// Makes every agent of every protocol and link once; what they refuse becomes a mistake at the value's place.
void try_agents(Mistakes&, const YAML::Mark& agents_mark, const YAML::Mark& links_mark, const Experiment& experiment, const Places& places);

/// The metric names this experiment will have.
std::vector<std::string> metric_names(const Experiment& experiment);

}  // namespace consort::script
