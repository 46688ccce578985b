#pragma once
/// What models ask of the values they are made from.

#include "core/errors.hpp"
#include "core/number_text.hpp"
#include "core/values.hpp"

#include <cmath>
#include <string>

namespace consort {

inline std::string shape_text(const Matrix& value) { return std::to_string(value.rows()) + " x " + std::to_string(value.cols()); }

/// The initial vector `name` of length n; zero if it is not given, a scalar stands for every component. Throws ConfigError on another
/// length.
inline Vector initial_vector(const Values& initial, std::string_view name, Eigen::Index n) {
  if (!initial.has(name)) return Vector::Zero(n);
  const Vector given = initial.vector(name);
  if (given.size() == n) return given;
  if (given.size() == 1) return Vector::Constant(n, given[0]);
  throw ConfigError("initial '" + std::string(name) + "': found " + std::to_string(given.size()) +
                    " numbers; allowed: " + std::to_string(n));
}

/// A whole number between `low` and `high`. Throws ConfigError.
inline Eigen::Index whole_parameter(const Values& given, std::string_view name, Eigen::Index fallback, Eigen::Index low,
                                    Eigen::Index high) {
  const double value = given.scalar(name, static_cast<double>(fallback));
  if (!(value >= static_cast<double>(low) && value <= static_cast<double>(high) && value == std::floor(value)))
    throw ConfigError("parameter '" + std::string(name) + "': found " + number_text(value) + "; allowed: a whole number from " +
                      std::to_string(low) + " to " + std::to_string(high));
  return static_cast<Eigen::Index>(value);
}

}  // namespace consort
