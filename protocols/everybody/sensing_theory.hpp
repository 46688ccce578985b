#pragma once
/// What theory asks where agents measure each other relative to themselves (Huang et al. 2025, Algorithm 1).

#include "protocols/theory_case.hpp"

#include <string>
#include <vector>

namespace consort {

inline std::string word(AgentId agent) { return std::to_string(agent.value); }

/// Sensing edges are communication edges both ways. `knowledge` by agent: what the plant lets it know.
void ask_sensing_is_communicated(const TheoryCase& of, const std::vector<Values>& knowledge, Findings& out);
void ask_unique_ids(const TheoryCase& of, Findings& out);

}  // namespace consort
