#pragma once
/// What of the agents' state the record of an experiment leaves out, being large.

#include "core/experiment.hpp"

#include <string>
#include <vector>

namespace consort {

/// A sentence per protocol of which something is left out that nobody asked to leave out.
std::vector<std::string> left_out_of_record(const Experiment& experiment);

}  // namespace consort
