#pragma once
/// Where a run ends if nothing ends it before.

#include "core/experiment.hpp"

namespace consort {

/// The last round of the experiment, or the one from which on nobody is there and none will come.
Round last_round(const Experiment& experiment);

}  // namespace consort
