#include "core/stop.hpp"
#include "orchestrator/report/cell_result.hpp"
#include "orchestrator/report/spread.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace consort {
namespace {

constexpr std::size_t kPoints = 60, kPointsOfARun = 240;
constexpr double kMostWork = 4e6;  // pairs of agents looked at, of one run

double short_number(double value) { return std::isfinite(value) ? std::strtod(fmt::format("{:.5g}", value).c_str(), nullptr) : value; }

}  // namespace

void CurveOverSeeds::add(const Trace& trace) {
  if (trace.rounds.empty()) return;
  of_error_ = trace.truth != Truth::none;
  const auto n = static_cast<double>(trace.agents);
  const double work = !of_error_ && trace.agreed_dimension() > 1 ? n * n : n;
  const auto most = static_cast<std::size_t>(std::clamp(kMostWork / work, 20.0, static_cast<double>(kPointsOfARun)));
  const std::size_t reports = trace.rounds.size(), points = std::min(most, reports);
  Run run;
  for (std::size_t p = 0; p < points; ++p) {
    const std::size_t at = points == 1 ? 0 : p * (reports - 1) / (points - 1);
    run.rounds.push_back(trace.rounds[at]);
    run.values.push_back(deviation(trace, trace.report(at)));
  }
  runs_.push_back(std::move(run));
}

CellCurve CurveOverSeeds::curve(const std::string& protocol) const {
  CellCurve curve{protocol, of_error_, {}, {}, {}, {}};
  Round last = 0;
  for (const Run& run : runs_) last = std::max(last, run.rounds.back());
  const std::size_t points = std::min<std::size_t>(kPoints, std::size_t{last} + 1);
  for (std::size_t p = 0; p < points; ++p) {
    const auto round = static_cast<Round>(points == 1 ? 0 : p * std::size_t{last} / (points - 1));
    std::vector<double> values;
    for (const Run& run : runs_) {
      const auto after = std::upper_bound(run.rounds.begin(), run.rounds.end(), round) - run.rounds.begin();
      if (const double value = run.values[static_cast<std::size_t>(after - 1)]; std::isfinite(value)) values.push_back(value);
    }
    const Spread spread = spread_of(values);
    curve.rounds.push_back(round);
    curve.low.push_back(short_number(spread.q05));
    curve.median.push_back(short_number(spread.median));
    curve.high.push_back(short_number(spread.q95));
  }
  return curve;
}

}  // namespace consort
