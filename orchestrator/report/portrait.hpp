#pragma once
/// An experiment on one page, for people: what the file says, who hears whom, what theory expects.

#include "core/experiment.hpp"
#include "orchestrator/report/terminal.hpp"
#include "protocols/theory.hpp"

#include <string>
#include <vector>

namespace consort {

std::string portrait(const Experiment& experiment, const std::vector<Finding>& findings, const TextStyle& style);

/// Row i shows from whom agent i receives: in round 0, or only in another round. Empty above 24 agents.
std::string picture(const Experiment& experiment, const TextStyle& style);

}  // namespace consort
