#pragma once
/// What theory asks of the protocols that steer a plant, and of Kalman consensus in continuous time.

#include "orchestrator/survey.hpp"
#include "orchestrator/theory.hpp"

#include <functional>

namespace consort {

/// The findings about one protocol of the experiment, each condition beginning with its name; none for protocols that others examine.
std::vector<Finding> examine_control(const Experiment& experiment, const Survey& survey, const ProtocolChoice& choice);

/// The smallest h > 0 for which `radius(h)`, the spectral radius of a loop sampled with step h, reaches 1, to six digits; 0 if the loop is
/// unstable however short the step, infinity if no step up to 1e6 `shortest` makes it so. `shortest` is short against all it does.
Seconds largest_stable_step(const std::function<double(Seconds)>& radius, Seconds shortest);

}  // namespace consort
