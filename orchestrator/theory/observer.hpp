#pragma once
/// What theory asks of the distributed observer, of DAGC and of cooperative localisation (Huang et al. 2025).

#include "orchestrator/theory/case.hpp"

namespace consort {

/// distributed_observer, acyclic_sensing, cooperative_localization. Unobservable agents, couplings that run in a circle (without DAGC),
/// communication that is not strongly connected, and sensing without communication are refused.
void examine_observer(const TheoryCase& of, Findings& out);

}  // namespace consort
