#pragma once
/// Acceptance criteria: comparisons over metric names, such as "abs(bias) < 1e-6 && rounds <= 300".

#include "core/metrics.hpp"

#include <span>
#include <string>
#include <vector>

namespace consort {

struct CriterionResult {
  std::string text;
  bool met = false;
  double value = 0.0;  ///< the left-hand side (of the first comparison, if there are several)
};

/// The metric names a criterion uses, ascending. Throws ConfigError if the text is not a comparison muParser understands.
std::vector<std::string> metrics_of(const std::string& criterion);

/// Throws ConfigError naming the nearest match if `criterion` uses a name that is not among `known`, or cannot be read.
void check_criterion(const std::string& criterion, std::span<const std::string> known);

/// Judges each criterion. A metric or a side that is not a number never meets a criterion. Throws ConfigError as check_criterion.
std::vector<CriterionResult> judge(std::span<const std::string> criteria, const Metrics& metrics);

}  // namespace consort
