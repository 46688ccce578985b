#pragma once
/// What theory asks of the distributed observer, of DAGC and of cooperative localisation (Huang et al. 2025).

#include "orchestrator/survey.hpp"
#include "orchestrator/theory.hpp"

#include <string_view>

namespace consort {

/// Is it one of distributed_observer, acyclic_sensing, cooperative_localization?
bool observes_everybody(std::string_view protocol);

/// Appends the findings about that protocol, each condition beginning with its name. Unobservable agents, couplings that run in a circle
/// (without DAGC), communication that is not strongly connected, and sensing without communication are refused.
void examine_observer(const Experiment& experiment, const ProtocolChoice& choice, const Survey& survey, std::vector<Finding>& out);

}  // namespace consort
