#pragma once
/// What protocols of all families ask of the values they are made from, and of what they measure.

#include "core/errors.hpp"
#include "core/number_text.hpp"
#include "core/value_doc.hpp"
#include "protocols/protocol.hpp"

#include <array>
#include <cmath>
#include <string>

namespace consort {

/// y_i as a vector (n).
inline Eigen::Map<const Vector> measured(const Sense& sense) { return {sense.y.data(), static_cast<Eigen::Index>(sense.y.size())}; }

/// Two tables of parameters, one after the other.
template <std::size_t N, std::size_t M>
constexpr std::array<ValueDoc, N + M> joined(const std::array<ValueDoc, N>& first, const std::array<ValueDoc, M>& second) {
  std::array<ValueDoc, N + M> all{};
  for (std::size_t i = 0; i < N; ++i) all[i] = first[i];
  for (std::size_t i = 0; i < M; ++i) all[N + i] = second[i];
  return all;
}

/// A scalar parameter that must be above zero (or, if `zero_too`, at least zero). Throws ConfigError.
inline double positive_parameter(std::string_view who, const Values& given, std::string_view name, std::optional<double> fallback,
                                 bool zero_too = false) {
  const double value = given.scalar(name, fallback);
  if (std::isfinite(value) && (value > 0.0 || (zero_too && value == 0.0))) return value;
  throw ConfigError("protocol " + std::string(who) + ": " + std::string(name) + " is " + number_text(value) +
                    (zero_too ? "; allowed: 0 or more" : "; allowed: above 0"));
}

/// A parameter that is 0 or 1. Throws ConfigError.
inline bool flag(std::string_view who, const Values& values, std::string_view name) {
  const double value = values.scalar(name, 0.0);
  if (value == 0.0 || value == 1.0) return value == 1.0;
  throw ConfigError("protocol " + std::string(who) + ": " + std::string(name) + " is " + number_text(value) + "; allowed: 0 or 1");
}

}  // namespace consort
