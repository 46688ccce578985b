#include "orchestrator/report/page_run.hpp"

#include "core/stop.hpp"
#include "orchestrator/report/curves.hpp"
#include "orchestrator/report/page_nees.hpp"
#include "orchestrator/report/page_plane.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

namespace consort {
namespace {

using Json = nlohmann::ordered_json;
using Numbers = std::span<const double>;  // of one report: agents x columns

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMostCharts = 12;
constexpr std::array kShares{0.05, 0.5, 0.95};

// A number of each agent, over time.
struct Plot {
  std::string title, meaning;
  bool logarithmic = false;
  std::function<double(std::size_t agent, Numbers)> value;
  std::function<double(Numbers)> truth;  // one for all; empty: none
  Json lines = Json::array();            // [{name, value}]: levels that theory or somebody who knows all names
};

class RunPage {
 public:
  RunPage(const RecordedRun& run, Seconds dt, const RunValues& values)
      : run_(run), dt_(dt), values_(values), outline_(outline_of(run)), plane_(run, outline_.truth) {
    plan();
  }

  Json write(std::size_t numbers) {
    std::size_t curves = 0;
    for (const Plot& plot : plots_) curves += drawn().size() + (banded() ? kShares.size() : 0) + (plot.truth ? 1 : 0);
    const std::size_t most = std::clamp<std::size_t>(numbers / std::max<std::size_t>(1, curves), 24, 1500);
    Decimation decimation(curves, run_.reports, most);
    std::vector<double> row(curves), all(run_.agents);
    run_.for_each([&](Round k, Numbers report_numbers) {
      std::size_t at = 0;
      for (const Plot& plot : plots_) {
        for (std::size_t i = 0; i < run_.agents; ++i) all[i] = value_or_nothing(plot.value(i, report_numbers));
        for (const std::size_t i : drawn()) row[at++] = all[i];
        if (plot.truth) row[at++] = value_or_nothing(plot.truth(report_numbers));
        if (banded()) {
          std::vector<double> copy = all;
          for (const double q : quantiles(copy, kShares)) row[at++] = q;
        }
      }
      const double time = k * dt_;
      decimation.add(time, row);
      add_presence(time, report_numbers);
      plane_.add(time, report_numbers);
    });
    Curves done = decimation.finish();
    Json json{{"run", run_.run},         {"protocol", run_.protocol}, {"seed", run_.seed},  {"agents", run_.agents},
              {"every", run_.every},     {"thinned", done.thinned},   {"x", done.x},        {"y", done.y},
              {"charts", Json::array()}, {"strips", strips()},        {"undrawn", undrawn_}};
    std::size_t at = 0;
    for (const Plot& plot : plots_) json["charts"].push_back(chart(plot, at));
    if (Json plane = plane_.finish(); !plane.is_null()) json["plane"] = std::move(plane);
    return json;
  }

 private:
  static double value_or_nothing(double value) { return std::isfinite(value) ? value : kNothing; }
  [[nodiscard]] double at(Numbers all, std::size_t agent, std::size_t column) const { return all[agent * run_.columns.size() + column]; }
  [[nodiscard]] bool banded() const { return run_.agents > kMostCurves; }
  // Agents with a curve of their own, as indices.
  [[nodiscard]] std::vector<std::size_t> drawn() const {
    std::vector<std::size_t> agents;
    const std::size_t n = run_.agents;
    if (banded()) return {0, n / 3, 2 * n / 3, n - 1};
    for (std::size_t i = 0; i < n; ++i) agents.push_back(i);
    return agents;
  }

  void plan() {
    const bool estimates = outline_.truth != Truth::none;
    if (estimates) plan_errors();
    if (outline_.agrees_on_states) plan_fields("plant");
    plan_fields("estimate");
    plan_fields("state");
    if (!estimates && !outline_.agrees_on_states) plan_fields("plant");
  }

  void plan_errors() {
    const auto estimate = run_.of_kind("estimate"), plant = run_.of_kind("plant");
    if (plant.empty()) return;
    const auto error = [=, this](std::size_t i, Numbers all) {
      std::vector<double> x, z;
      double sum = 0.0;
      for (std::size_t j = 0; j < (outline_.truth == Truth::everybody ? run_.agents : 1); ++j) {
        const std::size_t owner = outline_.truth == Truth::everybody ? j : i;
        x.clear();
        z.clear();
        for (std::size_t c = 0; c < plant.size(); ++c) {
          x.push_back(at(all, owner, plant[c]));
          z.push_back(at(all, i, estimate[j * plant.size() + c]));
        }
        if (!is_absent(x.front())) sum += squared_error(z, x);
      }
      return is_absent(at(all, i, estimate.front())) && is_absent(at(all, i, plant.front())) ? kNothing : std::sqrt(sum);
    };
    const char* what = outline_.truth == Truth::everybody ? "norm of its errors about everybody" : "norm of its error";
    add({"estimation error", what, true, error, {}});
    if (outline_.truth == Truth::state) plan_consistency(estimate, plant);
  }

  // Whether the covariance that an estimator claims is that of its error.
  void plan_consistency(const std::vector<std::size_t>& estimate, const std::vector<std::size_t>& plant) {
    std::vector<std::size_t> claimed;
    for (const std::size_t c : estimate)
      if (run_.columns[c].field == "P") claimed.push_back(c);
    if (claimed.size() != plant.size() * plant.size()) return;
    const auto value = [=, this](std::size_t i, Numbers all) {
      std::vector<double> error, covariance;
      for (std::size_t c = 0; c < plant.size(); ++c) error.push_back(at(all, i, estimate[c]) - at(all, i, plant[c]));
      for (const std::size_t c : claimed) covariance.push_back(at(all, i, c));
      return nees(error, covariance);
    };
    const auto [low, high] = nees_band(plant.size());
    add({"NEES",
         "e^T P^-1 e; 95 % lie between the lines where P is the covariance of the error e",
         true,
         value,
         {},
         Json::array({Json{{"name", "2.5 %"}, {"value", low}}, Json{{"name", "97.5 %"}, {"value", high}}})});
  }

  void plan_fields(std::string_view kind) {
    std::set<std::string> done;
    for (const std::size_t c : run_.of_kind(kind)) {
      const RecordedColumn& column = run_.columns[c];
      std::vector<std::size_t> members;
      std::size_t rows = 0, columns = 0;
      for (const std::size_t other : run_.of_kind(kind)) {
        if (run_.columns[other].field != column.field) continue;
        members.push_back(other);
        rows = std::max(rows, run_.columns[other].row + 1);
        columns = std::max(columns, run_.columns[other].column + 1);
      }
      const bool covariance = rows == columns && (column.field == "P" || column.field == "Y");
      const bool of_everybody = kind == "estimate" && outline_.truth == Truth::everybody && columns > 1;
      if (of_everybody) continue;  // their errors are drawn
      if (covariance) {
        if (done.insert(column.field).second)
          add({"trace of " + column.field,
               column.meaning,
               true,
               [=, this](std::size_t i, Numbers all) {
                 double sum = 0.0;
                 for (const std::size_t m : members)
                   if (run_.columns[m].row == run_.columns[m].column) sum += at(all, i, m);
                 return sum;
               },
               {}});
        continue;
      }
      Plot plot{column.name, column.meaning, false, [=, this](std::size_t i, Numbers all) { return at(all, i, c); }, {}};
      if (kind == "estimate" && outline_.truth == Truth::state) plot.truth = truth_of(column);
      const bool agreed =
          outline_.truth == Truth::none && (kind == "plant" ? outline_.agrees_on_states : kind == "estimate" && column.field == "x");
      if (agreed)
        add_levels(plot, members.size(), static_cast<std::size_t>(std::find(members.begin(), members.end(), c) - members.begin()));
      add(std::move(plot));
    }
  }

  // The true value of what a column estimates, where all agents look at one plant.
  [[nodiscard]] std::function<double(Numbers)> truth_of(const RecordedColumn& column) const {
    const auto plant = run_.of_kind("plant"), estimate = run_.of_kind("estimate");
    for (std::size_t c = 0; c < plant.size() && c < estimate.size(); ++c)
      if (run_.columns[estimate[c]].name == column.name)
        return [=, this](Numbers all) {
          double common = kNothing;
          for (std::size_t i = 0; i < run_.agents; ++i) {
            const double value = at(all, i, plant[c]);
            if (is_absent(value)) continue;
            if (!std::isnan(common) && common != value) return kNothing;
            common = value;
          }
          return common;
        };
    return {};
  }

  void add_levels(Plot& plot, std::size_t components, std::size_t component) const {
    for (const auto& [metric, name] :
         {std::pair{"consensus_value", "consensus value"}, {"centralised_value", "centralised"}, {"predicted_value", "predicted"}}) {
      const auto found = values_.find(components == 1 ? metric : fmt::format("{}[{}]", metric, component));
      if (found != values_.end() && std::isfinite(found->second)) plot.lines.push_back(Json{{"name", name}, {"value", found->second}});
    }
  }

  void add(Plot plot) {
    if (plots_.size() < kMostCharts)
      plots_.push_back(std::move(plot));
    else
      undrawn_.push_back(plot.title);
  }

  // Where its curves are among y; `at` moves on.
  [[nodiscard]] Json chart(const Plot& plot, std::size_t& at) const {
    Json curves = Json::array();
    for (const std::size_t i : drawn()) curves.push_back(Json{{"name", fmt::format("agent {}", i + 1)}, {"at", at++}});
    Json json{{"title", plot.title}, {"meaning", plot.meaning}, {"log", plot.logarithmic}, {"lines", plot.lines}};
    if (plot.truth) json["truth"] = at++;
    json["curves"] = std::move(curves);
    if (banded()) {
      json["band"] = {{"low", at}, {"mid", at + 1}, {"high", at + 2}};
      at += kShares.size();
    }
    return json;
  }

  // --- who is there ----------------------------------------------------------------------------------------------------

  void add_presence(double time, Numbers all) {
    if (presence_.empty()) presence_.resize(run_.agents);
    for (std::size_t i = 0; i < run_.agents; ++i) {
      const bool there = std::any_of(run_.columns.begin(), run_.columns.end(),
                                     [&, c = std::size_t{0}](const RecordedColumn&) mutable { return !is_absent(at(all, i, c++)); });
      auto& spans = presence_[i];
      if (there && (spans.empty() || spans.back().second)) spans.push_back({{time, time}, false});
      if (there) spans.back().first.second = time;
      if (!there && !spans.empty()) spans.back().second = true;
    }
    ends_ = time;
  }

  // [[first, last], ...] by agent; empty where everybody was there all the time.
  [[nodiscard]] Json strips() const {
    const auto always = [&](const auto& spans) { return spans.size() == 1 && spans[0].first == std::pair(0.0, ends_); };
    if (presence_.size() > 200 || std::all_of(presence_.begin(), presence_.end(), always)) return Json::array();
    Json all = Json::array();
    for (const auto& spans : presence_) {
      Json one = Json::array();
      for (const auto& [span, over] : spans) one.push_back({span.first, span.second});
      all.push_back(std::move(one));
    }
    return all;
  }

  const RecordedRun& run_;
  Seconds dt_;
  const RunValues& values_;
  Trace outline_;
  std::vector<Plot> plots_;
  Json undrawn_ = Json::array();
  std::vector<std::vector<std::pair<std::pair<double, double>, bool>>> presence_;  // by agent: spans, and whether it is over
  double ends_ = 0.0;
  PagePlane plane_;
};

}  // namespace

nlohmann::ordered_json page_run(const RecordedRun& run, Seconds dt, std::size_t numbers, const RunValues& values) {
  return RunPage(run, dt, values).write(numbers);
}

}  // namespace consort
