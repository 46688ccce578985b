#pragma once
/// What is done with findings: told, kept, and acted on.

#include "orchestrator/theory.hpp"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace consort {

/// [{verdict, condition, evidence, consequence}, ...]
nlohmann::ordered_json to_json(const std::vector<Finding>& findings);

/// One line for whoever waits: how many conditions hold, and those that do not.
std::string told(const std::vector<Finding>& findings);

/// Throws ConfigError naming every condition without which the run is not started.
void refuse_unsound(const std::vector<Finding>& findings);

}  // namespace consort
