#pragma once
/// What one cell of a study came to: small enough to keep thousands of, complete enough to make the study's table from.

#include "core/errors.hpp"
#include "core/metrics/divergence.hpp"
#include "core/metrics/metrics.hpp"
#include "core/trace.hpp"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace consort {

struct CellRun {
  std::string protocol;  ///< with the cell's label
  Seed seed;
  std::size_t agents = 0;
  Round rounds = 0;
  bool converged = false;
  AgentCounters totals;
  std::uint64_t trace_hash = 0;
  double seconds = 0.0;  ///< wall clock; nothing that is compared is made of it
  Metrics metrics = {};
  std::optional<Divergence> diverged = {};
};

/// How far the runs of one protocol were from what they are for, over the rounds: quantiles over the seeds.
struct CellCurve {
  std::string protocol;   ///< with the cell's label
  bool of_error = false;  ///< estimators: the estimation error; else the disagreement
  std::vector<Round> rounds;
  std::vector<double> low, median, high;  ///< 5 %, 50 %, 95 %, to five digits; of a run that has ended, its last value
};

/// Gathers such a curve from the traces of a protocol's runs, one after the other.
class CurveOverSeeds {
 public:
  void add(const Trace& trace);
  [[nodiscard]] CellCurve curve(const std::string& protocol) const;

 private:
  struct Run {
    std::vector<Round> rounds;
    std::vector<double> values;
  };
  std::vector<Run> runs_;
  bool of_error_ = false;
};

struct CellResult {
  std::uint64_t hash = 0;  ///< of the experiment and the program that ran it: PlannedCell::hash
  std::vector<CellRun> runs;
  std::vector<CellCurve> curves;  ///< where they were asked for
  Exit exit = Exit::ok;
  std::string error;  ///< empty: it came to its end
  [[nodiscard]] bool done() const { return error.empty(); }
};

/// Numbers come back bit for bit, those that are none or infinite, too.
nlohmann::ordered_json to_json(const CellResult& result);
/// nullopt: it is no such thing, or of a program that writes others.
std::optional<CellResult> cell_result_of(const nlohmann::ordered_json& json);

std::string hex(std::uint64_t word);  ///< 16 digits

}  // namespace consort
