#include "orchestrator/report/page.hpp"

#include "core/errors.hpp"
#include "orchestrator/report/cell_store.hpp"
#include "orchestrator/report/page_network.hpp"
#include "orchestrator/report/page_run.hpp"
#include "orchestrator/report/record_schema.hpp"
#include "orchestrator/report/study_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

namespace consort {

// Made by CMake of the files in orchestrator/report/page/ and of dygraphs.
extern const char* const kPageHtml;
extern const char* const kPageCss;
extern const char* const kPageScript;
extern const char* const kDygraphScript;
extern const char* const kDygraphCss;

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostRunsCompared = 60;  // curves of how far each run is, in one picture
constexpr std::size_t kMostRunsShown = 8;      // with curves of their own
constexpr std::size_t kCurveNumbers = 45'000;  // in all of them: a number takes up to 20 characters
constexpr std::size_t kComparisonNumbers = 16'000;
constexpr double kMostRead = 3e7;  // numbers read of a run: some seconds
constexpr std::size_t kMostEvents = 500, kMostMetrics = 400;

// A file of the folder, parsed; null where it is not there (yet) or is none.
Json parsed(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) return {};
  Json json = Json::parse(in, nullptr, false);
  return json.is_discarded() ? Json() : json;
}

Json value_of(const Statement& row, int column) {
  if (row.is_null(column)) return {};
  if (row.is_real(column)) return row.real(column);
  return row.text(column);
}

// The one row of the table experiment, by column.
Json experiment_of(Database& database) {
  Statement row = database.prepare(
      "SELECT name, description, mode, seed, runs, agents, rounds, dt, report_every, plant, sweep_key, program, began, ended, exit, error, "
      "trace_hash, startup_seconds, rounds_per_second FROM experiment");
  Json json;
  if (row.step())
    for (int c = 0; c < row.columns(); ++c) json[row.name(c)] = value_of(row, c);
  return json;
}

RunValues values_of(Database& database, std::int64_t run) {
  Statement row = database.prepare("SELECT name, value FROM metrics WHERE run = ? AND value IS NOT NULL");
  row.bind(0, run);
  RunValues values;
  while (row.step()) values[row.text(0)] = row.real(1);
  return values;
}

Json criteria_of(Database& database) {
  Statement row = database.prepare("SELECT text, met, value FROM criteria ORDER BY number");
  Json all = Json::array();
  while (row.step())
    all.push_back(Json{{"text", row.text(0)},
                       {"met", row.is_null(1) ? Json() : Json(row.integer(1) != 0)},
                       {"value", row.is_null(2) ? Json() : Json(row.real(2))}});
  return all;
}

Json metrics_of(Database& database) {
  Statement row = database.prepare("SELECT name, value FROM results ORDER BY name LIMIT ?");
  row.bind(0, static_cast<std::int64_t>(kMostMetrics));
  Json all = Json::array();
  while (row.step()) all.push_back({row.text(0), row.is_null(1) ? Json() : Json(row.real(1))});
  return all;
}

Json events_of(Database& database, std::int64_t run) {
  Statement row = database.prepare("SELECT round, time, kind, text FROM events WHERE run = ? ORDER BY rowid LIMIT ?");
  row.bind(0, run);
  row.bind(1, static_cast<std::int64_t>(kMostEvents));
  Json all = Json::array();
  while (row.step()) all.push_back(Json{{"round", row.integer(0)}, {"time", row.real(1)}, {"kind", row.text(2)}, {"text", row.text(3)}});
  return all;
}

// The first run of each protocol, then others, as many as are shown.
std::vector<std::int64_t> first_runs(Database& database) {
  Statement row = database.prepare("SELECT min(run) FROM runs GROUP BY protocol ORDER BY min(run) LIMIT ?");
  row.bind(0, static_cast<std::int64_t>(kMostRunsShown));
  std::vector<std::int64_t> runs;
  while (row.step()) runs.push_back(row.integer(0));
  return runs;
}

// How far each run is from what it is for, all of them in one picture.
Json comparison(Database& database, Seconds dt) {
  std::vector<std::int64_t> runs;
  Statement row = database.prepare("SELECT run, (SELECT count(*) FROM runs) FROM runs ORDER BY run LIMIT ?");
  row.bind(0, static_cast<std::int64_t>(kMostRunsCompared));
  std::int64_t all = 0;
  while (row.step()) {
    runs.push_back(row.integer(0));
    all = row.integer(1);
  }
  if (runs.empty()) return {};
  const std::size_t most = std::clamp<std::size_t>(kComparisonNumbers / (2 * runs.size()), 40, 1200);
  Json curves = Json::array();
  bool errors = false;
  for (const std::int64_t number : runs) {
    const RecordedRun run(database, number, kMostRead / static_cast<double>(runs.size()));
    if (run.reports == 0 || run.agents < 1) continue;
    DeviationCurve curve = deviation_curve(run, dt, most);
    errors = errors || run.entry().truth != Truth::none;
    curves.push_back(Json{{"protocol", run.protocol}, {"seed", run.seed}, {"x", std::move(curve.time)}, {"y", std::move(curve.value)}});
  }
  if (curves.empty()) return {};
  return {{"title", errors ? "estimation error" : "disagreement"},
          {"meaning", errors ? "norm of all agents' errors, stacked" : "largest distance between two agents"},
          {"of", all},
          {"curves", std::move(curves)}};
}

void replace(std::string& text, std::string_view what, std::string_view by) {
  const std::size_t at = text.find(what);
  check(at != std::string::npos, "the page has a place for everything");
  text.replace(at, what.size(), by);
}

// As the content of a script element, which nothing in it can end.
std::string embedded(const Json& json) {
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) {
    if (c == '<')
      safe += "\\u003c";
    else
      safe += c;
  }
  return safe;
}

std::string html_text(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    if (c == '<')
      safe += "&lt;";
    else if (c == '&')
      safe += "&amp;";
    else
      safe += c;
  }
  return safe;
}

}  // namespace

Json page_data(const std::filesystem::path& folder) {
  const auto file = folder / "record.sqlite";
  if (!std::filesystem::exists(file))
    throw ConfigError(fmt::format("{}: holds no record.sqlite; allowed: an output folder of `consort run`", folder.string()));
  Database database(file, Database::Open::read);
  if (record_format(database, file.string()) < 2)
    throw ConfigError(
        fmt::format("{}: a record of format 1 does not say enough of itself for a page; `consort export` reads it", file.string()));
  Json json{{"folder", std::filesystem::weakly_canonical(folder).string()}, {"experiment", experiment_of(database)}};
  const Seconds dt = json["experiment"].value("dt", 1.0);
  json["summary"] = parsed(folder / "summary.json");
  json["host"] = parsed(folder / "host.json");
  json["theory"] = parsed(folder / "theory.json");
  json["criteria"] = criteria_of(database);
  json["metrics"] = metrics_of(database);
  json["runs"] = Json::array();
  if (is_study_folder(folder)) {
    const StudyPlan plan = plan_in(folder);
    json["study"] = page_study(plan, table_of(plan, CellStore(folder).results(plan)));
    if (json["summary"].is_object())  // its table has them
      for (const char* much : {"per_run", "metrics", "diverged"}) json["summary"].erase(much);
    return json;
  }
  json["comparison"] = comparison(database, dt);
  const auto runs = first_runs(database);
  for (const std::int64_t number : runs) {
    const RecordedRun run(database, number, kMostRead);
    if (run.agents == 0) continue;
    Json one = page_run(run, dt, kCurveNumbers / std::max<std::size_t>(1, runs.size()), values_of(database, number));
    one["events"] = events_of(database, number);
    one["messages"] = page_messages(database, number);
    json["runs"].push_back(std::move(one));
  }
  if (!runs.empty()) json["graphs"] = page_graphs(database, runs.front(), RecordedRun(database, runs.front(), kMostRead).agents);
  return json;
}

std::string page_of(const std::vector<std::filesystem::path>& folders, bool live) {
  Json data = Json::array();
  std::string title;
  for (const auto& folder : folders) {
    data.push_back(page_data(folder));
    title += (title.empty() ? "" : ", ") + data.back()["experiment"].value("name", "run");
  }
  std::string page = kPageHtml;
  replace(page, "{{live}}", live ? " data-live=\"yes\"" : "");
  replace(page, "{{title}}", html_text(title));
  replace(page, "{{connect}}", live ? "'self'" : "'none'");
  replace(page, "{{style}}", std::string(kDygraphCss) + kPageCss);
  replace(page, "{{dygraphs}}", kDygraphScript);
  replace(page, "{{script}}", kPageScript);
  replace(page, "{{data}}", embedded(data));
  return page;
}

}  // namespace consort
