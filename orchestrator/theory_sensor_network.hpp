#pragma once
/// What theory asks of a network of observers of one plant, and what it says of their errors (Knotek, thesis, chapter 3).

#include "orchestrator/survey.hpp"
#include "orchestrator/theory.hpp"

namespace consort {

/// The findings about the protocol sensor_network_observer, each condition beginning with its name; none for other protocols. A condition
/// counts for every graph of the run: what fails in all of them is `refused` where nothing converges without it, what fails in some
/// `fails`.
std::vector<Finding> examine_sensor_network(const Experiment& experiment, const Survey& survey, const ProtocolChoice& choice);

}  // namespace consort
