#pragma once
/// What is done with findings: told, kept, and acted on.

#include "orchestrator/report/terminal.hpp"
#include "protocols/theory.hpp"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace consort {

/// [{verdict, condition, evidence, consequence}, ...]
nlohmann::ordered_json to_json(const std::vector<Finding>& findings);

/// For whoever waits for a run, a line each: how many conditions hold, if `count`; those that do not, with what follows; and, in one, those
/// that were left out.
std::vector<std::string> told(const std::vector<Finding>& findings, bool count, const TextStyle& style);

/// Throws ConfigError naming every condition without which the run is not started.
void refuse_unsound(const std::vector<Finding>& findings);

}  // namespace consort
