#pragma once
/// What theory asks of the filters and observers of one plant (Knotek, thesis, section 3.1).

#include "orchestrator/survey.hpp"
#include "orchestrator/theory.hpp"

namespace consort {

/// The findings about one protocol of the experiment, each condition beginning with its name; none for protocols that others examine.
std::vector<Finding> examine_filters(const Experiment& experiment, const Survey& survey, const ProtocolChoice& choice);

}  // namespace consort
