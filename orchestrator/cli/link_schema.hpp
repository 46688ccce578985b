#pragma once
/// The definitions of experiments/experiment.schema.json that speak of links, as `LinkSpec::fields` has them.

#include <nlohmann/json_fwd.hpp>

namespace consort {

nlohmann::ordered_json link_definitions();

}  // namespace consort
