#include "orchestrator/script/criteria.hpp"

#include "core/errors.hpp"
#include "orchestrator/script/criterion.hpp"
#include "orchestrator/script/wording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace consort {

std::vector<std::string> metrics_of(const std::string& text) {
  const Criterion criterion(text);
  std::vector<std::string> out;
  for (const auto& named : criterion.names()) out.push_back(named.metric);
  std::sort(out.begin(), out.end());
  return out;
}

void check_criterion(const std::string& text, std::span<const std::string> known, std::span<const std::string> with_runs) {
  const Criterion criterion(text);
  const auto is_among = [](std::span<const std::string> names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  for (const auto& [name, column] : criterion.names()) {
    if (is_among(known, name)) continue;
    if (is_among(with_runs, name))
      throw ConfigError(
          fmt::format("criterion: found '{}' (column {}) in '{}', which a single run does not have; allowed: with several "
                      "runs, such as 'runs: 20' or --runs 20",
                      name, column, text));
    throw ConfigError(fmt::format("criterion: found the unknown metric '{}' (column {}) in '{}'; allowed: {}{}", name, column, text,
                                  listed(known), did_you_mean(name, known)));
  }
}

std::vector<CriterionResult> judge(std::span<const std::string> criteria, const Metrics& metrics) {
  std::vector<CriterionResult> out;
  for (const auto& text : criteria) {
    const Criterion criterion(text);
    const auto verdict = criterion.judge(metrics);
    CriterionResult& result = out.emplace_back(CriterionResult{text, verdict.met, verdict.value, std::string(verdict.undefined)});
    for (const auto& named : criterion.names()) {
      const auto found = metrics.find(named.metric), share = metrics.find(named.metric + ".share");
      result.metrics[named.metric] = found == metrics.end() ? std::numeric_limits<double>::quiet_NaN() : found->second;
      if (share != metrics.end() && share->second < 1.0) result.metrics[share->first] = share->second;
    }
  }
  return out;
}

}  // namespace consort
