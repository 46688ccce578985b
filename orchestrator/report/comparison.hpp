#pragma once
/// Two results folders held against each other: bits, metrics, criteria, and what was different beforehand.

#include "orchestrator/report/first_difference.hpp"
#include "orchestrator/report/kept_results.hpp"
#include "orchestrator/report/terminal.hpp"
#include "orchestrator/report/tolerance.hpp"

#include <nlohmann/json.hpp>

#include <span>
#include <string>
#include <vector>

namespace consort {

/// A run in both.
struct RunCompared {
  enum class Bits { equal, differ, unreported, length, unended, only_a, only_b };
  std::string protocol, seed;  ///< with another seed in b: both seeds
  Bits bits = Bits::equal;
  ReportsCompared reports;
  std::optional<std::int64_t> rounds_a, rounds_b;
};
/// What becomes of hashes and lengths, and of what is reported of both; pure.
RunCompared::Bits judge_bits(const KeptRun& a, const KeptRun& b, const ReportsCompared& reports);

struct MetricCompared {
  std::string name;
  std::optional<double> a, b;  ///< nothing: it is not there; NaN: not a number
  double allowed = 0.0;
  bool within = true;
};

struct CriterionCompared {
  std::string text;
  std::string a, b;  ///< met, not met, open (the run is not complete), not there
};

struct KeyCompared {
  std::string key;
  std::optional<std::string> a, b;  ///< nothing: it is not there
};

struct Comparison {
  std::string a, b;                               ///< the folders
  std::vector<RunCompared> runs;                  ///< all of them, as in a, then those that b alone has
  std::vector<MetricCompared> metrics;            ///< all of them, ascending
  std::vector<CriterionCompared> flipped;         ///< whose verdict is another, or that one alone has
  std::vector<KeyCompared> file, host, versions;  ///< keys that differ
  bool tolerant = false;                          ///< the verdict is that of metrics and criteria alone
  [[nodiscard]] bool same_bits() const;
  [[nodiscard]] bool same_metrics() const;
  [[nodiscard]] bool equal() const { return (tolerant || same_bits()) && same_metrics() && flipped.empty(); }
};

/// Which run of b each of a is held against, by index: that with its protocol and seed; else the next of its protocol that is left; pure.
std::vector<std::optional<std::size_t>> pair_runs(std::span<const KeptRun> a, std::span<const KeptRun> b);

/// All but the runs; pure.
Comparison compare_values(const KeptResults& a, const KeptResults& b, std::span<const Tolerance> tolerances);
/// With any tolerance the verdict is that of metrics and criteria. Throws what kept_results() does.
Comparison compare_folders(const std::filesystem::path& a, const std::filesystem::path& b, std::span<const Tolerance> tolerances);

/// The keys of two YAML texts that differ, as in agents.initial.x[3]; pure.
std::vector<KeyCompared> keys_that_differ(const std::string& yaml_a, const std::string& yaml_b);

std::string render(const Comparison& comparison, const TextStyle& style);
nlohmann::ordered_json to_json(const Comparison& comparison);

}  // namespace consort
