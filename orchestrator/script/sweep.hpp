#pragma once
/// A sweep within a run: every protocol once per value of one key of the links. Any other makes a study (study.hpp).

#include "orchestrator/script/links.hpp"

namespace consort::script {

/// `sweep: {links.KEY: values}`: every protocol once per value. The values are a list, or named. `links` is the section they vary.
void read_sweep(Mistakes&, const YAML::Node&, const YAML::Node& links, const LinkChanges& changes, Experiment& experiment);

}  // namespace consort::script
