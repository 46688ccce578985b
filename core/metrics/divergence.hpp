#pragma once
/// Has a run drawn apart although nothing disturbed it?

#include "core/experiment.hpp"
#include "core/trace.hpp"

#include <optional>

namespace consort {

/// What the agents are to make small rose more than a hundredfold over the last half of a run.
struct Divergence {
  bool of_error = false;  ///< of estimators, whose error it is; of all others their disagreement
  Round from_round = 0, to_round = 0;
  double from = 0.0, to = 0.0;
};

/// Judged on the reported rounds, the largest values around the middle and at the end. Nothing where something else explains a rise: links
/// that are not ideal, a network that lost or was late, a disturbed plant, whoever comes or goes and whatever is cut or healed in the last
/// half, a leader that itself grows as much; nor for what is rounding beside the numbers themselves, nor in a run of few rounds.
std::optional<Divergence> divergence(const Experiment& experiment, Seed run_seed, const ProtocolChoice& protocol, const Trace& trace);

}  // namespace consort
