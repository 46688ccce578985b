#include "orchestrator/script/study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace consort::script {
namespace {

constexpr std::size_t kLongestLabel = 64, kMostSwept = 1000;

bool fits_metric(const std::string& label) {
  return !label.empty() && label.size() <= kLongestLabel && std::all_of(label.begin(), label.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.';
  });
}

// linspace and logspace: what stands in their brackets, and whether the values are in the same ratio to each other.
struct Spaced {
  std::vector<double> numbers;
  bool logarithmic = false;
};

std::optional<Spaced> spaced_text(const std::string& text) {
  for (const bool logarithmic : {false, true}) {
    const std::string head = logarithmic ? "logspace(" : "linspace(";
    if (!text.starts_with(head) || !text.ends_with(')')) continue;
    Spaced out{{}, logarithmic};
    std::string inside = text.substr(head.size(), text.size() - head.size() - 1) + ",";
    for (std::size_t comma = 0; (comma = inside.find(',')) != std::string::npos; inside.erase(0, comma + 1)) {
      std::string one = inside.substr(0, comma);
      std::erase(one, ' ');
      out.numbers.push_back(finite_number(one).value_or(NAN));
    }
    return out;
  }
  return std::nullopt;
}

std::optional<Spaced> spaced(const YAML::Node& node) {
  if (node.IsScalar()) return spaced_text(node.Scalar());
  if (!node.IsMap() || node.size() != 1 || !node.begin()->first.IsScalar()) return std::nullopt;
  const std::string& name = node.begin()->first.Scalar();
  if (name != "linspace" && name != "logspace") return std::nullopt;
  Spaced out{{}, name == "logspace"};
  if (const YAML::Node list = node.begin()->second; list.IsSequence())
    for (const auto& entry : list) out.numbers.push_back(plain_number(entry).value_or(NAN));
  return out;
}

// To twelve digits, so that 0.1 times 3 is 0.3.
std::vector<std::string> texts_of(Mistakes& mistakes, const YAML::Node& node, const std::string& what, const Spaced& spaced) {
  const auto& n = spaced.numbers;
  const bool numbers = n.size() == 3 && std::isfinite(n[0]) && std::isfinite(n[1]) && n[2] == std::floor(n[2]);
  if (!numbers || n[2] < 2 || n[2] > kMostSwept || (spaced.logarithmic && !(n[0] > 0 && n[1] > 0))) {
    mistakes.add(
        node, fmt::format("{}: found {}; allowed: {}(first, last, how many), two to {} numbers{}", what, describe(node),
                          spaced.logarithmic ? "logspace" : "linspace", kMostSwept, spaced.logarithmic ? ", first and last above 0" : ""));
    return {};
  }
  std::vector<std::string> texts;
  for (double i = 0; i < n[2]; ++i) {
    const double share = i / (n[2] - 1);
    texts.push_back(fmt::format("{:.12g}", spaced.logarithmic ? n[0] * std::pow(n[1] / n[0], share) : n[0] + (n[1] - n[0]) * share));
  }
  return texts;
}

}  // namespace

std::vector<SweptValue> swept_values(Mistakes& mistakes, const YAML::Node& node, const std::string& what, const std::string& key,
                                     std::size_t least, bool again) {
  std::vector<SweptValue> out;
  std::set<std::string> labels;
  const auto add = [&](const YAML::Node& place, std::string label, const YAML::Node& value) {
    if (!fits_metric(label) || (!labels.insert(label).second && !again))
      mistakes.add(place, fmt::format("{}: found the name '{}'{}; allowed: up to {} letters, digits and '_', each name once", what,
                                      shown(label), fits_metric(label) ? " a second time" : "", kLongestLabel));
    out.push_back({std::move(label), value});
  };
  const std::string last = key.substr(key.rfind('.') + 1);
  const auto add_next = [&](const YAML::Node& value) {
    const bool plain = value.IsScalar() && fits_metric(value.Scalar());
    add(value, last + "_" + (plain ? value.Scalar() : std::to_string(out.size() + 1)), value);
  };
  if (const auto numbers = spaced(node)) {
    for (const std::string& text : texts_of(mistakes, node, what, *numbers)) add_next(placed(text, node.Mark().line, node.Mark().column));
    if (out.empty()) return out;
  } else if (node.IsSequence()) {
    for (const auto& value : node) add_next(value);
  } else if (node.IsMap()) {
    for (const auto& entry : node) add(entry.first, entry.first.Scalar(), entry.second);
  }
  if (out.size() < least || out.size() > kMostSwept)
    mistakes.add(node, fmt::format("{}: found {}; allowed: {} or more (at most {}), as a list or as a mapping from names to values", what,
                                   describe(node), least == 1 ? "a value" : "two values", kMostSwept));
  if (out.size() > kMostSwept) out.clear();
  return out;
}

std::optional<double> number_in(const YAML::Node& value) {
  if (value.IsMap() && value.size() == 1) return number_in(value.begin()->second);
  if (const auto number = plain_number(value)) return number;
  Mistakes trial("");
  const auto seconds = read_duration(trial, value, "");
  return trial.none() ? seconds : std::nullopt;
}

}  // namespace consort::script
