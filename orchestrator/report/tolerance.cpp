#include "orchestrator/report/tolerance.hpp"

#include "core/errors.hpp"
#include "core/number_text.hpp"

#include <fmt/format.h>

#include <cmath>

namespace consort {
namespace {

bool speaks_of(const Tolerance& tolerance, std::string_view metric) {
  std::string_view name = tolerance.metric;
  if (name.empty()) return true;
  if (name.ends_with('*')) {
    name.remove_suffix(1);
    return metric.starts_with(name) || metric.find("." + std::string(name)) != std::string_view::npos;
  }
  return metric == name || metric.ends_with("." + std::string(name));
}

}  // namespace

Tolerance parse_tolerance(const std::string& option, const std::string& text) {
  Tolerance tolerance;
  std::string_view amount = text;
  const std::size_t equals = text.rfind('=');
  if (equals != std::string::npos) {
    tolerance.metric = text.substr(0, equals);
    amount = amount.substr(equals + 1);
  }
  tolerance.relative = amount.ends_with('%');
  if (tolerance.relative) amount.remove_suffix(1);
  const auto value = parse_number<double>(amount);
  if (!value || !(*value >= 0.0) || equals == 0)
    throw ConfigError(
        fmt::format("{}: found '{}'; allowed: a number from 0, as 0.01, or a share, as 5%, of every metric or of one, as "
                    "bias=0.01 or 'error*=5%'",
                    option, text));
  tolerance.amount = tolerance.relative ? *value / 100.0 : *value;
  return tolerance;
}

double allowed(std::span<const Tolerance> tolerances, std::string_view metric, double reference) {
  double amount = 0.0;
  for (const Tolerance& tolerance : tolerances)
    if (speaks_of(tolerance, metric)) amount = tolerance.relative ? tolerance.amount * std::abs(reference) : tolerance.amount;
  return std::isnan(amount) ? 0.0 : amount;
}

}  // namespace consort
