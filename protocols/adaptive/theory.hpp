#pragma once
/// What theory asks of an experiment whose agents adapt coupling gains: adaptive_consensus and the protocols it is compared with.

namespace consort {

struct TheoryCase;
class Findings;

// Connectivity, stabilisable dynamics, noise, the step against the gains, and what Algorithm 4.2 can resolve.
void examine_adaptive_consensus(const TheoryCase& of, Findings& out);
void examine_su_consensus(const TheoryCase& of, Findings& out);
void examine_yu_consensus(const TheoryCase& of, Findings& out);
void examine_li_edge_consensus(const TheoryCase& of, Findings& out);
void examine_li_agent_consensus(const TheoryCase& of, Findings& out);
void examine_das_neural_consensus(const TheoryCase& of, Findings& out);

}  // namespace consort
