#pragma once
/// Which metrics an experiment shows, and the criteria it is judged by.

#include "core/experiment.hpp"
#include "orchestrator/script/yaml.hpp"

namespace consort::script {

/// `metrics: [...]` and `criteria: [...]` at the `top` of the file.
void read_measures(Mistakes&, const Section& top, Experiment& experiment);
/// Once the rest of the experiment is known to hold: the metrics that criteria name exist, and are computed.
void check_criteria(Mistakes&, const Section& top, Experiment& experiment);
/// Of a cell of a study: its criteria are judged over all cells; what they name in this one is computed.
void take_metrics_of_criteria(Experiment& experiment);

}  // namespace consort::script
