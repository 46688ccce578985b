#pragma once
/// The acceptance criteria of an experiment (criterion.hpp says what one may be), such as "abs(bias) < 1e-6 and rounds <= 300".

#include "core/metrics/metrics.hpp"

#include <span>
#include <string>
#include <vector>

namespace consort {

struct CriterionResult {
  std::string text;
  bool met = false;
  double value = 0.0;  ///< of the first comparison: the first side that names a metric; of a chain the first such one between two others
  std::string undefined = {};  ///< why it cannot be met: something in it is "not a number" or "infinite"; else empty
  Metrics metrics = {};        ///< what it names, as it came out (absent: NaN); with `<metric>.share` where not all runs have the metric
};

/// The metric names a criterion uses, ascending. Throws ConfigError naming the column if the text is no criterion.
std::vector<std::string> metrics_of(const std::string& text);

/// Throws ConfigError naming column and nearest match if the criterion uses a name that is not among `known`, or cannot be read. Names
/// among `with_runs` are refused as what there is with several runs.
void check_criterion(const std::string& text, std::span<const std::string> known, std::span<const std::string> with_runs = {});

/// Judges each criterion. What is absent, no number or infinite meets none. Throws ConfigError if one cannot be read.
std::vector<CriterionResult> judge(std::span<const std::string> criteria, const Metrics& metrics);

}  // namespace consort
