#pragma once
/// What theory asks of an experiment whose agents adapt coupling gains: adaptive_consensus and the protocols it is compared with.

#include "orchestrator/theory/case.hpp"

namespace consort {

/// Connectivity, stabilisable dynamics, noise, the step against the gains, and what Algorithm 4.2 can resolve.
void examine_adaptive(const TheoryCase& of, Findings& out);

}  // namespace consort
