#include "orchestrator/report/tested.hpp"

#include "core/counted.hpp"
#include "core/errors.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace consort {
namespace {

using Outcome = TestCase::Outcome;

// The last thing it complained of, or said at all.
std::string complaint(const std::string& err) {
  std::string last, complained;
  for (std::size_t at = 0; at < err.size();) {
    const std::size_t end = std::min(err.find('\n', at), err.size());
    const std::string line = err.substr(at, end - at);
    if (!line.empty()) last = line;
    if (line.starts_with("consort: ")) complained = line.substr(9);
    at = end + 1;
  }
  return complained.empty() ? last : complained;
}

TestCase judged(const nlohmann::ordered_json& criterion) {
  TestCase test{criterion.value("text", ""), Outcome::passed, {}};
  if (!criterion.contains("met") || criterion["met"].is_null()) {
    test.outcome = Outcome::skipped;
    test.message = "the run is incomplete";
  } else if (!criterion["met"].get<bool>()) {
    test.outcome = Outcome::failed;
    test.message = "value " + (criterion.contains("value") ? criterion["value"].dump() : "null");
    if (criterion.contains("undefined")) test.message = "something in it is " + criterion["undefined"].get<std::string>();
    const auto metrics = criterion.value("metrics", nlohmann::ordered_json::object());
    if (metrics.size() > 1)
      for (const auto& [name, value] : metrics.items()) test.message += fmt::format(", {} {}", name, value.dump());
  }
  return test;
}

std::string_view word(Outcome outcome) {
  switch (outcome) {
    case Outcome::passed:
      return "passed";
    case Outcome::failed:
      return "failed";
    case Outcome::error:
      return "error";
    case Outcome::skipped:
      return "skipped";
  }
  return {};
}

bool passed(const TestedExperiment& tested) { return tested.count(Outcome::passed) == tested.cases.size(); }

}  // namespace

std::size_t TestedExperiment::count(TestCase::Outcome outcome) const {
  return static_cast<std::size_t>(std::count_if(cases.begin(), cases.end(), [&](const TestCase& test) { return test.outcome == outcome; }));
}

double TestedExperiment::seconds() const {
  double sum = 0.0;
  for (const TestCase& test : cases) sum += test.seconds;
  return sum;
}

void add_cases(TestedExperiment& tested, double seconds, const nlohmann::ordered_json& summary) {
  TestCase& run = tested.cases.emplace_back(TestCase{"runs to its end", Outcome::passed, {}, seconds});
  const bool ended = tested.exit == static_cast<int>(Exit::ok) || tested.exit == static_cast<int>(Exit::criterion_not_met);
  if (!ended || summary.is_null()) {
    run.outcome = Outcome::error;
    run.message = fmt::format("exit code {}: {}", tested.exit, complaint(tested.err));
  }
  if (!summary.is_object() || !summary.contains("criteria")) return;
  for (const auto& criterion : summary["criteria"]) tested.cases.push_back(judged(criterion));
}

TestCase baseline_case(const Comparison& comparison) {
  TestCase test{"as the baseline", Outcome::passed, {}};
  if (comparison.equal()) return test;
  test.outcome = Outcome::failed;
  std::vector<std::string> words;
  std::size_t outside = 0;
  for (const MetricCompared& metric : comparison.metrics) {
    if (metric.within || ++outside > 3) continue;
    const auto number = [](const std::optional<double>& value) { return value ? fmt::format("{:g}", *value) : std::string("nothing"); };
    words.push_back(fmt::format("{} {} instead of {}", metric.name, number(metric.b), number(metric.a)));
  }
  if (outside > 3) words.push_back(fmt::format("{} outside in all", counted(outside, "metric")));
  for (const CriterionCompared& flip : comparison.flipped) words.push_back(flip.text + " is judged otherwise");
  if (!comparison.tolerant && !comparison.same_bits()) words.emplace_back("not equal bit for bit");
  test.message = fmt::format("{}; see consort diff {} {}", fmt::join(words, ", "), comparison.a, comparison.b);
  return test;
}

std::string render(const TestedExperiment& tested, const TextStyle& style) {
  const bool good = passed(tested);
  const std::string sign = style.unicode ? (good ? "✓" : "✗") : (good ? "passed" : "FAILED");
  std::string out = fmt::format("  {} {}  {} of {}, {:.2f} s\n", toned(sign, good ? Tone::good : Tone::bad, style), tested.name,
                                tested.count(Outcome::passed), counted(tested.cases.size(), "case"), tested.seconds());
  for (const TestCase& test : tested.cases)
    if (test.outcome != Outcome::passed) out += fmt::format("      {}: {}: {}\n", word(test.outcome), test.name, test.message);
  return out;
}

std::string render_totals(std::span<const TestedExperiment> all, const TextStyle& style) {
  std::size_t cases = 0, failed = 0, errors = 0, skipped = 0;
  for (const TestedExperiment& tested : all) {
    cases += tested.cases.size();
    failed += tested.count(Outcome::failed);
    errors += tested.count(Outcome::error);
    skipped += tested.count(Outcome::skipped);
  }
  const bool good = failed + errors + skipped == 0;
  return toned(fmt::format("  {}, {}: {} passed, {} failed, {}, {} skipped", counted(all.size(), "experiment"), counted(cases, "case"),
                           cases - failed - errors - skipped, failed, counted(errors, "error"), skipped),
               good ? Tone::good : Tone::bad, style) +
         "\n";
}

nlohmann::ordered_json to_json(std::span<const TestedExperiment> all) {
  auto out = nlohmann::ordered_json::array();
  for (const TestedExperiment& tested : all) {
    nlohmann::ordered_json entry{{"experiment", tested.name}, {"passed", passed(tested)},    {"exit", tested.exit},
                                 {"began", tested.began},     {"seconds", tested.seconds()}, {"cases", nlohmann::ordered_json::array()}};
    for (const TestCase& test : tested.cases)
      entry["cases"].push_back({{"name", test.name}, {"outcome", word(test.outcome)}, {"message", test.message}});
    out.push_back(std::move(entry));
  }
  return out;
}

}  // namespace consort
