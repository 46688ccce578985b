#pragma once
/// What theory asks of the protocols that steer a plant with gains given beforehand.

namespace consort {

struct TheoryCase;
class Findings;

void examine_static_consensus(const TheoryCase& of, Findings& out);          ///< Knotek, thesis, 2.3.3
void examine_minimum_energy_consensus(const TheoryCase& of, Findings& out);  ///< Zamani, Shames, Ugrinovskii 2014
void examine_measured_consensus(const TheoryCase& of, Findings& out);

}  // namespace consort
