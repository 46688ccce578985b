#pragma once
/// What theory asks of the distributed observer, of DAGC and of cooperative localisation (Huang et al. 2025).

namespace consort {

struct TheoryCase;
class Findings;

// Unobservable agents, couplings that run in a circle (without DAGC), communication that is not strongly connected, and sensing without
// communication are refused.
void examine_distributed_observer(const TheoryCase& of, Findings& out);
void examine_acyclic_sensing(const TheoryCase& of, Findings& out);
void examine_cooperative_localization(const TheoryCase& of, Findings& out);

}  // namespace consort
