#pragma once
/// The processes of a run that somebody starts by hand.

#include "core/experiment.hpp"
#include "orchestrator/run/wiring.hpp"

#include <string>
#include <vector>

namespace consort {

/// What to enter for each process that is not started here, as it stands; `wiring` has its ports, where the run has some.
std::vector<std::string> commands_by_hand(const Experiment& experiment, const RunOptions& options, const Placement& placement,
                                          const Wiring& wiring);

}  // namespace consort
