#include "orchestrator/criteria.hpp"

#include "core/errors.hpp"
#include "orchestrator/wording.hpp"

#include <fmt/format.h>
#include <muParser.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace consort {

namespace {

constexpr std::string_view kAllowed = "a comparison over metric names, such as 'abs(bias) < 1e-6'";

mu::Parser parser_of(const std::string& text) {
  mu::Parser parser;
  parser.DefineNameChars("0123456789_.[]abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ");
  parser.SetExpr(text);
  return parser;
}

// Where the first comparison outside all parentheses begins.
std::optional<std::size_t> first_comparison(std::string_view text) {
  int depth = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '(') ++depth;
    if (text[i] == ')') --depth;
    if (depth != 0) continue;
    const std::string_view two = text.substr(i, 2);
    if (text[i] == '<' || text[i] == '>' || two == "==" || two == "!=") return i;
  }
  return std::nullopt;
}

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw ConfigError(fmt::format("criterion: found '{}' ({}); allowed: {}", text, why, kAllowed));
}

std::size_t comparison_in(const std::string& text) {
  // muParser knows assignment; here it can only be a mistyped comparison.
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '=') continue;
    const bool second = i > 0 && std::string_view("<>=!").find(text[i - 1]) != std::string_view::npos;
    const bool first = i + 1 < text.size() && text[i + 1] == '=';
    if (!second && !first) refuse(text, "'=' assigns; '==' compares");
  }
  const auto at = first_comparison(text);
  if (!at) refuse(text, "no comparison");
  return *at;
}

std::vector<std::string> names_in(mu::Parser& parser, const std::string& text) {
  try {
    std::vector<std::string> names;
    for (const auto& [name, address] : parser.GetUsedVar()) names.push_back(name);
    return names;
  } catch (const mu::Parser::exception_type& error) {
    refuse(text, error.GetMsg());
  }
}

double evaluate(const std::string& text, Metrics& metrics) {
  mu::Parser parser = parser_of(text);
  for (const auto& name : names_in(parser, text)) parser.DefineVar(name, &metrics.at(name));
  return parser.Eval();
}

}  // namespace

std::vector<std::string> metrics_of(const std::string& criterion) {
  const std::size_t comparison = comparison_in(criterion);
  mu::Parser whole = parser_of(criterion);
  auto names = names_in(whole, criterion);
  mu::Parser left = parser_of(criterion.substr(0, comparison));
  const auto left_names = names_in(left, criterion);
  if (names.empty()) refuse(criterion, "it names no metric");
  try {
    // Evaluated once with ones in the place of metrics: muParser finds some mistakes only then.
    Metrics ones;
    for (const auto& name : names) ones[name] = 1.0;
    evaluate(criterion, ones);
  } catch (const mu::Parser::exception_type& error) {
    refuse(criterion, error.GetMsg());
  }
  return names;
}

void check_criterion(const std::string& criterion, std::span<const std::string> known) {
  for (const auto& name : metrics_of(criterion)) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    throw ConfigError(fmt::format("criterion: found the unknown metric '{}' in '{}'; allowed: {}{}", name, criterion, listed(known),
                                  did_you_mean(name, known)));
  }
}

std::vector<CriterionResult> judge(std::span<const std::string> criteria, const Metrics& metrics) {
  std::vector<std::string> known;
  for (const auto& [name, value] : metrics) known.push_back(name);
  Metrics values = metrics;
  std::vector<CriterionResult> out;
  for (const auto& text : criteria) {
    check_criterion(text, known);
    const auto names = metrics_of(text);
    const bool numbers =
        std::none_of(names.begin(), names.end(), [&values](const std::string& name) { return std::isnan(values.at(name)); });
    const double left = evaluate(text.substr(0, comparison_in(text)), values);
    const double truth = evaluate(text, values);
    out.push_back({text, numbers && !std::isnan(left) && !std::isnan(truth) && truth != 0.0, left});
  }
  return out;
}

}  // namespace consort
