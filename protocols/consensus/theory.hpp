#pragma once
/// What theory asks of the protocols whose agents come to agree on a value: averaging, Kalman consensus and its descendants.

namespace consort {

struct TheoryCase;
class Findings;

void examine_local_voting(const TheoryCase& of, Findings& out);
void examine_kalman_consensus(const TheoryCase& of, Findings& out);
void examine_continuous_kalman_consensus(const TheoryCase& of, Findings& out);
/// unbiased_kalman_consensus, unbiased_information_consensus
void examine_unbiased_consensus(const TheoryCase& of, Findings& out);
void examine_robust_information_consensus(const TheoryCase& of, Findings& out);

}  // namespace consort
