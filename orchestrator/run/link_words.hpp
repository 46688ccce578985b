#pragma once
/// What happens to links, in words (what a link does: core/network/link_spec.hpp).

#include "core/experiment.hpp"

#include <string>

namespace consort {

/// What is cut or healed; lists of edges are cut short after `shown`.
std::string words_of(const LinkEvent& event, std::size_t shown = static_cast<std::size_t>(-1));
/// Which links change, and what they become.
std::string words_of(const LinkModel::Change& change);
/// Whose measurements get worse.
std::string words_of_degradation(const Disturbance& disturbance);

}  // namespace consort
