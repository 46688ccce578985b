#pragma once
/// Small readings of traces and samples that several tests share.

#include "core/trace.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace consort {

/// The scalar estimates of all agents in one report.
inline std::vector<double> scalars_at(const Trace& trace, std::size_t report) {
  const auto row = trace.estimates[report];
  return {row.begin(), row.end()};
}
inline std::vector<double> finals(const Trace& trace) { return scalars_at(trace, trace.rounds.size() - 1); }

inline double spread(const std::vector<double>& values) {
  const auto [smallest, largest] = std::minmax_element(values.begin(), values.end());
  return *largest - *smallest;
}
inline double spread_at(const Trace& trace, std::size_t report) { return spread(scalars_at(trace, report)); }

inline double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}
/// Sample standard deviation.
inline double deviation(const std::vector<double>& values) {
  const double m = mean(values);
  double sum = 0.0;
  for (const double value : values) sum += (value - m) * (value - m);
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

}  // namespace consort
