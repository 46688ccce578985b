#pragma once
/// What theory asks of a network of observers of one plant, and what it says of their errors (Knotek, thesis, chapter 3).

namespace consort {

struct TheoryCase;
class Findings;

/// A condition counts for every graph of the run: what fails in all of them is `refused` where nothing converges without it, what fails in
/// some `fails`.
void examine_sensor_network(const TheoryCase& of, Findings& out);

}  // namespace consort
