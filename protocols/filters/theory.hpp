#pragma once
/// What theory asks of the filters and observers of one plant (Knotek, thesis, section 3.1).

namespace consort {

struct TheoryCase;
class Findings;

// One plant, who sees what, who hears whom, and what becomes of the errors.
void examine_kalman_bucy(const TheoryCase& of, Findings& out);
void examine_dkf_olfati_saber(const TheoryCase& of, Findings& out);
void examine_dkf_iterative(const TheoryCase& of, Findings& out);
void examine_dkf_kim(const TheoryCase& of, Findings& out);
void examine_dlo_kim(const TheoryCase& of, Findings& out);
void examine_dlo_zhang(const TheoryCase& of, Findings& out);

}  // namespace consort
