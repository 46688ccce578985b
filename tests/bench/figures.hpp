#pragma once
/// Figures: a table for people, bench.json for programs.

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

namespace consort::bench {

/// What issue or design ask of a figure: a least ratio to its raw twin, a least value, or a largest value.
struct Aim {
  enum class Of { nothing, ratio_at_least, value_at_least, value_at_most } of = Of::nothing;
  double bound = 0.0;
};

struct Figure {
  std::string name;
  std::optional<double> value;  ///< none: the run failed
  std::string unit;
  std::optional<double> raw;  ///< the same figure of the raw twin
  Aim aim;
  std::optional<double> ratio() const { return value && raw && *raw != 0.0 ? std::optional(*value / *raw) : std::nullopt; }
};

/// Middle value; none of none.
inline std::optional<double> median(std::vector<double> values) {
  if (values.empty()) return std::nullopt;
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

namespace detail {

inline std::string number(const std::optional<double>& value, const char* absent) {
  if (!value) return absent;
  if (*value >= 1000) return fmt::format("{:.0f}", *value);
  return *value >= 10 ? fmt::format("{:.1f}", *value) : fmt::format("{:.3g}", *value);
}

inline std::string aim_text(const Figure& figure) {
  switch (figure.aim.of) {
    case Aim::Of::ratio_at_least:
      return fmt::format(">= {} x raw", figure.aim.bound);
    case Aim::Of::value_at_least:
      return fmt::format(">= {:g}", figure.aim.bound);
    case Aim::Of::value_at_most:
      return fmt::format("<= {:g}", figure.aim.bound);
    case Aim::Of::nothing:
      break;
  }
  return "";
}

inline std::string verdict(const Figure& figure) {
  std::optional<bool> met;
  switch (figure.aim.of) {
    case Aim::Of::ratio_at_least:
      if (figure.ratio()) met = *figure.ratio() >= figure.aim.bound;
      break;
    case Aim::Of::value_at_least:
      if (figure.value) met = *figure.value >= figure.aim.bound;
      break;
    case Aim::Of::value_at_most:
      if (figure.value) met = *figure.value <= figure.aim.bound;
      break;
    case Aim::Of::nothing:
      return "";
  }
  if (!met) return "unknown";
  return *met ? "met" : "short";
}

}  // namespace detail

/// One line per figure, as measured.
inline std::string table(const std::vector<Figure>& figures) {
  std::string text = fmt::format("{:<48}{:>12}  {:<10}{:>12}{:>9}  {:<14}{}\n", "figure", "Consort", "unit", "raw", "ratio", "asked", "");
  for (const Figure& figure : figures) {
    text += fmt::format("{:<48}{:>12}  {:<10}{:>12}{:>9}  {:<14}{}\n", figure.name, detail::number(figure.value, "failed"), figure.unit,
                        detail::number(figure.raw, "-"), detail::number(figure.ratio(), "-"), detail::aim_text(figure),
                        detail::verdict(figure));
  }
  return text;
}

/// A list of {name, value, unit, raw, ratio}; what is not known is null.
inline nlohmann::json as_json(const std::vector<Figure>& figures) {
  const auto or_null = [](const std::optional<double>& value) { return value ? nlohmann::json(*value) : nlohmann::json(nullptr); };
  nlohmann::json list = nlohmann::json::array();
  for (const Figure& figure : figures) {
    list.push_back({{"name", figure.name},
                    {"value", or_null(figure.value)},
                    {"unit", figure.unit},
                    {"raw", or_null(figure.raw)},
                    {"ratio", or_null(figure.ratio())}});
  }
  return list;
}

}  // namespace consort::bench
