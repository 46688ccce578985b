#include "orchestrator/report/comparison.hpp"

#include "core/counted.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

namespace consort {
namespace {

using Bits = RunCompared::Bits;

constexpr std::size_t kMostShown = 20;  // lines of one kind; --json has all
constexpr std::size_t kWidestValue = 40;

std::string number(const std::optional<double>& value) {
  if (!value) return "nothing";
  return std::isnan(*value) ? "no number" : fmt::format("{}", *value);  // the shortest text that reads back exactly
}

std::string name_of(const RunCompared& run) { return fmt::format("{}, seed {}", run.protocol, run.seed); }

// What is to be said of one run.
std::string told(const RunCompared& run) {
  const auto length = [](const std::optional<std::int64_t>& rounds) {
    return rounds ? "ended after round " + std::to_string(*rounds) : std::string("did not end");
  };
  const std::string so_far = run.reports.last < 0 ? "they have no reported round in common"
                                                  : fmt::format("equal up to round {}, the last that both reported", run.reports.last);
  switch (run.bits) {
    case Bits::equal:
      return "equal bit for bit";
    case Bits::differ:
      return fmt::format("first in round {}, agent {}, {}: {} in A, {} in B", run.reports.first->round, run.reports.first->agent,
                         run.reports.first->field, number(run.reports.first->a), number(run.reports.first->b));
    case Bits::unreported:
      return "every round that both reported is equal, but not their hashes: they differ in rounds between (telemetry: {every: 1} shows)";
    case Bits::length:
    case Bits::unended:
      return fmt::format("A {}, B {}; {}", length(run.rounds_a), length(run.rounds_b), so_far);
    case Bits::only_a:
      return "in A only";
    case Bits::only_b:
      return "in B only";
  }
  return {};
}

std::string cut(const std::optional<std::string>& value) { return value ? clipped(*value, kWidestValue) : std::string("nothing"); }

class ComparisonLines {
 public:
  explicit ComparisonLines(const TextStyle& style) : style_(style) {}

  void mark(bool good, const std::string& text) {
    const std::string sign = style_.unicode ? (good ? "✓" : "✗") : (good ? "same  " : "DIFFER");
    out_ += fmt::format("  {} {}\n", toned(sign, good ? Tone::good : Tone::bad, style_), text);
  }
  void title(const std::string& text) { out_ += fmt::format("\n  {}\n", toned(text, Tone::strong, style_)); }
  void line(const std::string& text) { out_ += fmt::format("    {}\n", text); }
  void more(std::size_t all) {
    if (all > kMostShown) line(toned(fmt::format("and {} more; --json tells all", all - kMostShown), Tone::faint, style_));
  }
  [[nodiscard]] const std::string& text() const { return out_; }

 private:
  const TextStyle& style_;
  std::string out_;
};

void add_runs(const Comparison& comparison, ComparisonLines& text) {
  std::vector<const RunCompared*> different;
  std::int64_t most = 0;
  for (const RunCompared& run : comparison.runs) {
    if (run.bits != Bits::equal) different.push_back(&run);
    most = std::max(most, run.rounds_a.value_or(0));
  }
  if (comparison.runs.empty()) return text.mark(false, "neither has begun a run");
  if (different.empty())
    return text.mark(true, fmt::format("equal bit for bit: {}, {}", counted(comparison.runs.size(), "run"),
                                       counted(static_cast<std::uint64_t>(most), "round")));
  text.mark(false, fmt::format("{} of {} not equal bit for bit", different.size(), counted(comparison.runs.size(), "run")));
  for (std::size_t i = 0; i < std::min(different.size(), kMostShown); ++i)
    text.line(fmt::format("{}: {}", name_of(*different[i]), told(*different[i])));
  text.more(different.size());
}

void add_metrics(const Comparison& comparison, ComparisonLines& text) {
  std::vector<const MetricCompared*> shown;
  std::size_t outside = 0;
  for (const MetricCompared& metric : comparison.metrics) {
    const bool same = metric.within && (!metric.a || std::isnan(*metric.a) || *metric.a == *metric.b);
    if (!same) shown.push_back(&metric);
    if (!metric.within) ++outside;
  }
  std::stable_sort(shown.begin(), shown.end(), [](const auto* a, const auto* b) { return !a->within && b->within; });
  const std::string all = counted(comparison.metrics.size(), "metric");
  const std::string of = comparison.tolerant ? "within tolerances" : "equal";
  text.mark(outside == 0, outside == 0 ? fmt::format("{} {}", all, of) : fmt::format("{} of {} not {}", outside, all, of));
  for (std::size_t i = 0; i < std::min(shown.size(), kMostShown); ++i) {
    const MetricCompared& metric = *shown[i];
    std::string line = fmt::format("{}: {} in A, {} in B", metric.name, number(metric.a), number(metric.b));
    if (metric.a && metric.b && std::isfinite(*metric.b - *metric.a)) line += fmt::format(", difference {:.3g}", *metric.b - *metric.a);
    if (comparison.tolerant) line += fmt::format(", allowed {:.3g}{}", metric.allowed, metric.within ? "" : ": outside");
    text.line(line);
  }
  text.more(shown.size());
}

void add_keys(const std::string& title, const std::vector<KeyCompared>& keys, ComparisonLines& text) {
  if (keys.empty()) return;
  text.title(title);
  for (std::size_t i = 0; i < std::min(keys.size(), kMostShown); ++i)
    text.line(fmt::format("{}: {} in A, {} in B", keys[i].key, cut(keys[i].a), cut(keys[i].b)));
  text.more(keys.size());
}

nlohmann::ordered_json listed(const std::vector<KeyCompared>& keys) {
  auto out = nlohmann::ordered_json::array();
  for (const KeyCompared& key : keys) {
    nlohmann::ordered_json entry{{"key", key.key}, {"a", nullptr}, {"b", nullptr}};
    if (key.a) entry["a"] = *key.a;
    if (key.b) entry["b"] = *key.b;
    out.push_back(std::move(entry));
  }
  return out;
}

// NaN becomes null as JSON is written.
nlohmann::ordered_json value_of(const std::optional<double>& value) { return value ? nlohmann::ordered_json(*value) : nullptr; }

}  // namespace

std::string render(const Comparison& comparison, const TextStyle& style) {
  ComparisonLines text(style);
  add_runs(comparison, text);
  add_metrics(comparison, text);
  text.mark(comparison.flipped.empty(), comparison.flipped.empty()
                                            ? "every criterion as before"
                                            : fmt::format("{} {} judged otherwise", comparison.flipped.size(),
                                                          comparison.flipped.size() == 1 ? "criterion" : "criteria"));
  for (const CriterionCompared& flip : comparison.flipped) text.line(fmt::format("{}: {} in A, {} in B", flip.text, flip.a, flip.b));
  add_keys("What differs in the experiment", comparison.file, text);
  add_keys("What differs in the host", comparison.host, text);
  add_keys("What differs in the versions", comparison.versions, text);
  return fmt::format("\n  A  {}\n  B  {}\n\n{}\n", comparison.a, comparison.b, text.text());
}

nlohmann::ordered_json to_json(const Comparison& comparison) {
  static constexpr std::array words{"equal", "differ", "unreported", "length", "unended", "only_a", "only_b"};
  nlohmann::ordered_json json{{"equal", comparison.equal()},
                              {"a", comparison.a},
                              {"b", comparison.b},
                              {"bit_for_bit", comparison.same_bits()},
                              {"runs", nlohmann::ordered_json::array()},
                              {"metrics", nlohmann::ordered_json::array()},
                              {"flipped", nlohmann::ordered_json::array()}};
  for (const RunCompared& run : comparison.runs) {
    nlohmann::ordered_json entry{{"protocol", run.protocol}, {"seed", run.seed}, {"bits", words.at(static_cast<std::size_t>(run.bits))}};
    if (run.reports.first)
      entry["first"] = {{"round", run.reports.first->round},
                        {"agent", run.reports.first->agent},
                        {"field", run.reports.first->field},
                        {"a", value_of(run.reports.first->a)},
                        {"b", value_of(run.reports.first->b)}};
    entry["rounds_compared"] = run.reports.compared;
    json["runs"].push_back(std::move(entry));
  }
  for (const MetricCompared& metric : comparison.metrics) {
    const bool both = metric.a && metric.b;
    json["metrics"].push_back({{"name", metric.name},
                               {"a", value_of(metric.a)},
                               {"b", value_of(metric.b)},
                               {"difference", both ? nlohmann::ordered_json(*metric.b - *metric.a) : nullptr},
                               {"allowed", metric.allowed},
                               {"within", metric.within}});
  }
  for (const CriterionCompared& flip : comparison.flipped) json["flipped"].push_back({{"text", flip.text}, {"a", flip.a}, {"b", flip.b}});
  json["file"] = listed(comparison.file);
  json["host"] = listed(comparison.host);
  json["versions"] = listed(comparison.versions);
  return json;
}

}  // namespace consort
