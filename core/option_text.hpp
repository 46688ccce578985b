#pragma once
/// What stands behind an option of a command line: taken as it is meant, or refused with the option's name.

#include "core/errors.hpp"
#include "core/number_text.hpp"

#include <concepts>
#include <cstdint>
#include <sstream>
#include <string>

namespace consort {

/// A whole number from `low` to `high`, decimal (010 is ten). Throws ConfigError naming `option`.
template <std::unsigned_integral Number>
Number whole_option(const std::string& option, const std::string& text, Number low, Number high) {
  const auto value = parse_number<Number>(text);
  if (value && *value >= low && *value <= high) return *value;
  throw ConfigError(option + ": found '" + text + "'; allowed: a whole number from " + std::to_string(low) + " to " + std::to_string(high) +
                    (value ? "" : ", digits only") + written_out(text));
}

/// A number from `low` to `high`. Throws ConfigError naming `option`.
inline double number_option(const std::string& option, const std::string& text, double low, double high) {
  const auto value = parse_number<double>(text);
  if (value && *value >= low && *value <= high) return *value;  // NaN is neither
  std::ostringstream allowed;
  allowed << low << " to " << high;
  throw ConfigError(option + ": found '" + text + "'; allowed: a number from " + allowed.str());
}

}  // namespace consort
