#pragma once
/// Text as it may stand in the list of criteria.

#include "core/errors.hpp"
#include "orchestrator/script/criteria.hpp"

#include <cmath>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>

namespace consort::fuzz {

/// Reads the text as a criterion and judges it; true if it is one. Throws std::logic_error if it is refused without its column, names no
/// metric, or is met by metrics that are no numbers; and whatever the reader throws except ConfigError.
inline bool read_criterion(std::span<const std::uint8_t> bytes) {
  const std::string text(bytes.begin(), bytes.end());
  try {
    Metrics ones, none;
    for (const auto& name : metrics_of(text)) ones[name] = 1.0, none[name] = std::nan("");
    if (ones.empty()) throw std::logic_error("a criterion without a metric: " + text);
    judge(std::vector{text}, ones);
    if (judge(std::vector{text}, none).front().met) throw std::logic_error("met by what is no number: " + text);
    return true;
  } catch (const ConfigError& refusal) {
    if (std::string(refusal.what()).find("(column ") == std::string::npos) throw std::logic_error(refusal.what());
    return false;
  }
}

}  // namespace consort::fuzz
