#include "orchestrator/report/study_page.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

namespace consort {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostCharts = 12, kMostSeries = 24, kMostRows = 2000;
constexpr std::size_t kMostNumbers = 60'000;  // in all charts together: a number takes up to 20 characters

// What is drawn from left to right: the first key with values that are all numbers, else the first.
struct Axis {
  std::size_t key = 0;
  bool numbers = false;
  std::vector<double> at;           // ascending
  std::vector<std::string> labels;  // of each, where they are no numbers
};

std::set<double> numbers_of(const StudyPlan& plan, std::size_t key) {
  std::set<double> values;
  for (const PlannedCell& cell : plan.cells) {
    const auto& number = cell.cell.settings[key].number;
    if (!number) return {};
    values.insert(*number);
  }
  return values;
}

Axis axis_of(const StudyPlan& plan) {
  Axis axis;
  for (std::size_t key = 0; key < plan.keys.size(); ++key) {
    const std::set<double> values = numbers_of(plan, key);
    if (values.empty()) continue;
    return {key, true, {values.begin(), values.end()}, {}};
  }
  for (const PlannedCell& cell : plan.cells) {
    const std::string label = text_of(cell.cell.settings[0]);
    if (std::find(axis.labels.begin(), axis.labels.end(), label) == axis.labels.end()) axis.labels.push_back(label);
  }
  for (std::size_t i = 0; i < axis.labels.size(); ++i) axis.at.push_back(static_cast<double>(i + 1));
  return axis;
}

std::size_t place_of(const Axis& axis, const Setting& setting) {
  if (axis.numbers) return static_cast<std::size_t>(std::lower_bound(axis.at.begin(), axis.at.end(), *setting.number) - axis.at.begin());
  return static_cast<std::size_t>(std::find(axis.labels.begin(), axis.labels.end(), text_of(setting)) - axis.labels.begin());
}

// The names of the curves that rows are of: the protocol, and so much of what else is swept that no two rows are one point.
std::vector<std::string> curves_of(const StudyPlan& plan, const Axis& axis, const StudyTable& table) {
  std::vector<std::string> names;
  for (const StudyRow& row : table.rows) names.push_back(row.protocol);
  const auto settings = [&](std::size_t i) -> const std::vector<Setting>& { return plan.cells[table.rows[i].cell].cell.settings; };
  for (std::size_t key = 0; key < plan.keys.size(); ++key) {
    std::set<std::pair<std::string, std::size_t>> points;
    for (std::size_t i = 0; i < names.size(); ++i) points.emplace(names[i], place_of(axis, settings(i)[axis.key]));
    if (points.size() == names.size()) break;
    if (key == axis.key) continue;
    const std::string last = plan.keys[key].substr(plan.keys[key].rfind('.') + 1);
    for (std::size_t i = 0; i < names.size(); ++i) names[i] += ", " + last + " " + text_of(settings(i)[key]);
  }
  return names;
}

Json value_of(const Spread& spread) {
  if (!std::isfinite(spread.mean)) return {};
  if (!std::isfinite(spread.low)) return spread.mean;
  return {spread.low, spread.mean, spread.high};
}

Json chart_of(const StudyPlan& plan, const StudyTable& table, const Axis& axis, std::span<const std::string> curves,
              const std::string& metric) {
  Json series = Json::array();
  std::map<std::string, std::size_t> known;
  bool several = false, any = false;
  const std::size_t most = std::clamp<std::size_t>(kMostNumbers / (3 * kMostCharts * axis.at.size()), 1, kMostSeries);
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const StudyRow& row = table.rows[i];
    const auto found = row.spreads.find(metric);
    if (found == row.spreads.end()) continue;
    const std::string& name = curves[i];
    if (!known.contains(name)) {
      if (known.size() == most) continue;
      known.emplace(name, known.size());
      series.push_back({{"name", name}, {"values", std::vector<Json>(axis.at.size())}});
    }
    several = several || found->second.count > 1;
    any = any || std::isfinite(found->second.mean);
    series[known[name]]["values"][place_of(axis, plan.cells[row.cell].cell.settings[axis.key])] = value_of(found->second);
  }
  if (!any) return {};
  return {{"name", metric}, {"several", several}, {"series", std::move(series)}};
}

// Those of the table first, then what else is a single number.
std::vector<std::string> charted(const StudyTable& table) {
  std::vector<std::string> names = table.metrics;
  for (const StudyRow& row : table.rows)
    for (const auto& [name, spread] : row.spreads)
      if (name.find_first_of("[.") == std::string::npos && std::find(names.begin(), names.end(), name) == names.end())
        names.push_back(name);
  if (names.size() > kMostCharts) names.resize(kMostCharts);
  return names;
}

// How far the runs of some cells were from what they are for, over the rounds; from as many cells as a picture holds.
Json curves_over_rounds(const StudyTable& table) {
  constexpr std::size_t kMostCurves = 12;
  std::vector<const StudyRow*> rows;
  for (const StudyRow& row : table.rows)
    if (row.curve && !row.curve->rounds.empty()) rows.push_back(&row);
  const std::size_t step = (rows.size() + kMostCurves - 1) / kMostCurves;
  Json curves = Json::array();
  for (std::size_t i = 0; i < rows.size(); i += step) {
    const CellCurve& curve = *rows[i]->curve;
    Json bands = Json::array();
    for (std::size_t p = 0; p < curve.rounds.size(); ++p) {
      const bool known = std::isfinite(curve.low[p]) && std::isfinite(curve.high[p]);
      bands.push_back(known ? Json{curve.low[p], curve.median[p], curve.high[p]} : Json());
    }
    curves.push_back({{"name", curve.protocol}, {"rounds", curve.rounds}, {"bands", std::move(bands)}});
  }
  if (curves.empty()) return {};
  return {
      {"title", rows.front()->curve->of_error ? "estimation error" : "disagreement"}, {"of", rows.size()}, {"curves", std::move(curves)}};
}

Json rows_of(const StudyPlan& plan, const StudyTable& table) {
  Json rows = Json::array();
  for (const StudyRow& row : table.rows) {
    if (rows.size() == kMostRows) break;
    Json cells = Json::array({row.cell + 1});
    for (const Setting& setting : plan.cells[row.cell].cell.settings) cells.push_back(text_of(setting));
    cells.push_back(row.protocol);
    cells.push_back(std::to_string(row.result.converged) + " of " + std::to_string(row.result.runs));
    for (const std::string& metric : table.metrics) {
      const auto found = row.spreads.find(metric);
      if (found == row.spreads.end()) {
        cells.insert(cells.end(), {nullptr, nullptr, nullptr});
        continue;
      }
      for (const double value : {found->second.mean, found->second.low, found->second.high})
        cells.push_back(std::isfinite(value) ? Json(value) : Json());
    }
    rows.push_back(std::move(cells));
  }
  return rows;
}

}  // namespace

bool is_study_folder(const std::filesystem::path& folder) { return std::filesystem::exists(folder / "plan.json"); }

Json page_study(const StudyPlan& plan, const StudyTable& table) {
  const Axis axis = axis_of(plan);
  Json json{{"cells", plan.cells.size()},     {"axis", {{"key", plan.keys[axis.key]}, {"at", axis.at}, {"labels", axis.labels}}},
            {"metrics", Json::array()},       {"over_rounds", curves_over_rounds(table)},
            {"heads", Json::array({"cell"})}, {"rows", rows_of(plan, table)},
            {"of", table.rows.size()}};
  const auto curves = curves_of(plan, axis, table);
  for (const std::string& metric : charted(table))
    if (Json chart = chart_of(plan, table, axis, curves, metric); !chart.is_null()) json["metrics"].push_back(std::move(chart));
  for (const std::string& key : plan.keys) json["heads"].push_back(key.substr(key.rfind('.') + 1));
  json["heads"].insert(json["heads"].end(), {"protocol", "converged"});
  for (const std::string& metric : table.metrics) json["heads"].insert(json["heads"].end(), {metric, "95 % from", "to"});
  return json;
}

}  // namespace consort
