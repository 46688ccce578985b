#pragma once
/// How far a metric may be from what it is compared with.

#include <span>
#include <string>
#include <string_view>

namespace consort {

struct Tolerance {
  std::string metric;     ///< the name; with a star at its end all that begin so; empty: every metric
  double amount = 0.0;    ///< not negative
  bool relative = false;  ///< to what it is compared with
};

/// 0.01, 5%, bias=0.01, jitter*=50%. Throws ConfigError that begins with `option`.
Tolerance parse_tolerance(const std::string& option, const std::string& text);

/// How far `metric` may be from `reference`: what the last tolerance says that speaks of it; 0 if none does. One of `bias` speaks of
/// <protocol>.bias too.
double allowed(std::span<const Tolerance> tolerances, std::string_view metric, double reference);

}  // namespace consort
