#pragma once
/// What theory asks of the filters and observers of one plant (Knotek, thesis, section 3.1).

#include "orchestrator/theory/case.hpp"

namespace consort {

/// kalman_bucy, dkf_olfati_saber, dkf_iterative, dkf_kim, dlo_kim, dlo_zhang
void examine_filter(const TheoryCase& of, Findings& out);

}  // namespace consort
