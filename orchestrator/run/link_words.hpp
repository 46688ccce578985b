#pragma once
/// Links and what happens to them, in words.

#include "core/experiment.hpp"

#include <string>

namespace consort {

/// "loss 0.1, delay 2 rounds", or "ideal".
std::string words_of(const LinkSpec& link);
/// What is cut or healed; lists of edges are cut short after `shown`.
std::string words_of(const LinkEvent& event, std::size_t shown = static_cast<std::size_t>(-1));
/// Which links change, and what they become.
std::string words_of(const LinkModel::Change& change);
/// Whose measurements get worse.
std::string words_of_degradation(const Disturbance& disturbance);

}  // namespace consort
