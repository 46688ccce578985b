#pragma once
/// What a page shows of one run: curves per agent, how far the agents are from what the run is for, who was there, the plane.

#include "core/trace.hpp"
#include "orchestrator/report/recorded_run.hpp"

#include <nlohmann/json.hpp>

#include <map>

namespace consort {

/// Up to so many agents have a curve each; of more, quantiles are drawn and a few of them.
constexpr std::size_t kMostCurves = 50;

/// Metrics of one run, by name.
using RunValues = std::map<std::string, double>;

/// {run, protocol, seed, every, x: [s], y: [curve: [...]], charts: [...], strips: [...], plane: {...}, undrawn: [...]}; a curve that is not
/// there is null. `numbers`: about how many the page may have for it. `values`: the run's metrics, for the lines beside the curves.
nlohmann::ordered_json page_run(const RecordedRun& run, Seconds dt, std::size_t numbers, const RunValues& values);

/// Enough of a trace for core/stop.hpp: what the numbers of a report are, without reports.
Trace outline_of(const RecordedRun& run);

/// How far each report of a run is from what it is for: the disagreement, or of estimators the error, as the stop rule has it.
struct DeviationCurve {
  std::vector<double> time, value;  ///< s
};
/// At most `most` points, of every m-th report where the comparison of all agents would take long.
DeviationCurve deviation_curve(const RecordedRun& run, Seconds dt, std::size_t most);

}  // namespace consort
