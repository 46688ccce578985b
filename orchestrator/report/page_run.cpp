#include "orchestrator/report/page_run.hpp"

#include "core/stop.hpp"
#include "orchestrator/report/curves.hpp"

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
constexpr std::size_t kMostFrames = 120, kMostInPlane = 100, kMostEstimatesInPlane = 12;
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
  RunPage(const RecordedRun& run, Seconds dt, const RunValues& values) : run_(run), dt_(dt), values_(values), outline_(outline_of(run)) {
    plan();
  }

  Json write(std::size_t numbers) {
    std::size_t curves = 0;
    for (const Plot& plot : plots_) curves += drawn().size() + (banded() ? kShares.size() : 0) + (plot.truth ? 1 : 0);
    const std::size_t most = std::clamp<std::size_t>(numbers / std::max<std::size_t>(1, curves), 24, 1500);
    Decimation decimation(curves, run_.reports, most);
    std::vector<double> row(curves), all(run_.agents);
    std::size_t report = 0;
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
      note_frame(report++, time, report_numbers);
    });
    Curves done = decimation.finish();
    Json json{{"run", run_.run},         {"protocol", run_.protocol}, {"seed", run_.seed},  {"agents", run_.agents},
              {"every", run_.every},     {"thinned", done.thinned},   {"x", done.x},        {"y", done.y},
              {"charts", Json::array()}, {"strips", strips()},        {"undrawn", undrawn_}};
    std::size_t at = 0;
    for (const Plot& plot : plots_) json["charts"].push_back(chart(plot, at));
    if (!frames_.empty()) json["plane"] = plane();
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

  // --- the plane -------------------------------------------------------------------------------------------------------

  void note_frame(std::size_t report, double time, Numbers all) {
    if (report == 0) plan_plane();
    if (position_.size() != 2) return;
    const std::size_t stride = std::max<std::size_t>(1, (run_.reports + kMostFrames - 1) / kMostFrames);
    if (report % stride != 0 && report + 1 != run_.reports) return;
    Json truth = Json::array(), seen = Json::array();
    const auto point = [&](std::size_t i, std::size_t x, std::size_t y) {
      const double a = at(all, i, x), b = at(all, i, y);
      return std::isfinite(a) && std::isfinite(b) ? Json{a, b} : Json();
    };
    for (std::size_t i = 0; i < run_.agents; ++i) {
      truth.push_back(point(i, position_[0], position_[1]));
      if (estimates_.empty()) continue;
      Json of_one = Json::array();
      for (const auto& [x, y] : estimates_) of_one.push_back(point(i, x, y));
      seen.push_back(std::move(of_one));
    }
    Json frame{{"time", time}, {"truth", std::move(truth)}};
    if (!estimates_.empty()) frame["seen"] = std::move(seen);
    frames_.push_back(std::move(frame));
  }

  // A plant with a position of two coordinates lies in the plane; so do estimates of two numbers where there is no plant.
  void plan_plane() {
    if (run_.agents > kMostInPlane) return;
    const auto plant = run_.of_kind("plant"), estimate = run_.of_kind("estimate");
    std::vector<std::size_t> places;  // among the plant's numbers
    for (std::size_t c = 0; c < plant.size(); ++c)
      if (run_.columns[plant[c]].field == "position") places.push_back(c);
    if (places.size() == 2) {
      position_ = {plant[places[0]], plant[places[1]]};
      if (outline_.truth == Truth::state) estimates_.emplace_back(estimate[places[0]], estimate[places[1]]);
      if (outline_.truth == Truth::everybody && run_.agents <= kMostEstimatesInPlane)
        for (std::size_t j = 0; j < run_.agents; ++j)
          estimates_.emplace_back(estimate[j * plant.size() + places[0]], estimate[j * plant.size() + places[1]]);
    } else if (plant.empty()) {
      std::vector<std::size_t> x;
      for (const std::size_t c : estimate)
        if (run_.columns[c].field == "x") x.push_back(c);
      if (x.size() == 2) position_ = x;
    }
  }

  [[nodiscard]] Json plane() const {
    return {{"truth", !run_.of_kind("plant").empty()}, {"everybody", outline_.truth == Truth::everybody}, {"frames", frames_}};
  }

  const RecordedRun& run_;
  Seconds dt_;
  const RunValues& values_;
  Trace outline_;
  std::vector<Plot> plots_;
  Json undrawn_ = Json::array();
  std::vector<std::vector<std::pair<std::pair<double, double>, bool>>> presence_;  // by agent: spans, and whether it is over
  double ends_ = 0.0;
  std::vector<std::size_t> position_;
  std::vector<std::pair<std::size_t, std::size_t>> estimates_;
  std::vector<Json> frames_;
};

}  // namespace

nlohmann::ordered_json page_run(const RecordedRun& run, Seconds dt, std::size_t numbers, const RunValues& values) {
  return RunPage(run, dt, values).write(numbers);
}

}  // namespace consort
