#pragma once
/// An experiment as a test: its run, each criterion and its baseline are cases.

#include "orchestrator/report/comparison.hpp"
#include "orchestrator/report/terminal.hpp"

#include <nlohmann/json.hpp>

#include <span>
#include <string>
#include <vector>

namespace consort {

struct TestCase {
  enum class Outcome { passed, failed, error, skipped };
  std::string name;
  Outcome outcome = Outcome::passed;
  std::string message;   ///< of what did not pass: why, in a line
  double seconds = 0.0;  ///< the run has the time; what is judged by it takes none
};

struct TestedExperiment {
  std::string name;      ///< the file, as it was asked for
  std::string began;     ///< UTC, ISO 8601
  int exit = 0;          ///< of its run
  std::string out, err;  ///< what its run said: the table; progress and mistakes
  std::vector<TestCase> cases;
  [[nodiscard]] std::size_t count(TestCase::Outcome outcome) const;
  [[nodiscard]] double seconds() const;
};

/// What a run that ended with `exit` after `seconds` came to; `summary` is its summary.json, or null. Pure.
void add_cases(TestedExperiment& tested, double seconds, const nlohmann::ordered_json& summary);
/// The case "baseline": A of the comparison is the baseline. Pure.
TestCase baseline_case(const Comparison& comparison);

/// A line per experiment, and below it what did not pass.
std::string render(const TestedExperiment& tested, const TextStyle& style);
std::string render_totals(std::span<const TestedExperiment> all, const TextStyle& style);
nlohmann::ordered_json to_json(std::span<const TestedExperiment> all);

/// The text of a JUnit report, well-formed whatever the names and outputs hold.
std::string junit(std::span<const TestedExperiment> all);
/// Text as XML 1.0 can hold it: what is not UTF-8, or a character that no document may hold, becomes U+FFFD.
std::string xml_text(std::string_view text);

}  // namespace consort
