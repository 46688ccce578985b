#pragma once
/// What theory asks of an experiment whose agents adapt coupling gains: adaptive_consensus and the protocols it is compared with.

#include "orchestrator/survey.hpp"
#include "orchestrator/theory.hpp"

#include <string_view>

namespace consort {

bool adapts_gains(std::string_view protocol);

/// Connectivity, stabilisable dynamics, the step against the gains, and what Algorithm 4.2 can resolve; appended to `out`.
void examine_adaptive(const Experiment& experiment, const ProtocolChoice& choice, const Survey& survey, std::vector<Finding>& out);

}  // namespace consort
