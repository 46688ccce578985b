#pragma once
/// Where two records of a run part: the first reported round, agent and number that differ.

#include "orchestrator/report/sqlite.hpp"

#include <cstdint>
#include <optional>
#include <string>

namespace consort {

struct FirstDifference {
  std::int64_t round = 0, agent = 0;
  std::string field;           ///< column of estimates
  std::optional<double> a, b;  ///< nothing: the agent is not there
};

struct ReportsCompared {
  std::optional<FirstDifference> first;
  std::int64_t compared = 0;  ///< rounds that both have reported, up to the first difference
  std::int64_t only_one = 0;  ///< rounds that one alone has reported, up to there
  std::int64_t last = -1;     ///< last round that both have reported
};

/// Compares what both have recorded of a run of `protocol`, round by round, agents ascending, columns as in the first record.
ReportsCompared compare_reports(Database& a, std::int64_t run_a, Database& b, std::int64_t run_b, const std::string& protocol);

}  // namespace consort
