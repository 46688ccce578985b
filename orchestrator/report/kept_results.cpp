#include "orchestrator/report/kept_results.hpp"

#include "core/errors.hpp"
#include "orchestrator/report/record_schema.hpp"
#include "orchestrator/report/sqlite.hpp"

#include <fmt/format.h>

#include <fstream>
#include <limits>

namespace consort {
namespace {

double number_or_nan(const Statement& row, int column) {
  return row.is_null(column) ? std::numeric_limits<double>::quiet_NaN() : row.real(column);
}

}  // namespace

std::filesystem::path record_of(const std::filesystem::path& folder) {
  const auto record = folder / "record.sqlite";
  if (!std::filesystem::exists(record))
    throw ConfigError(fmt::format("{}: holds no record.sqlite; allowed: an output folder of `consort run`", folder.string()));
  return record;
}

nlohmann::ordered_json json_in(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) return {};
  auto json = nlohmann::ordered_json::parse(in, nullptr, false);
  return json.is_discarded() ? nlohmann::ordered_json() : json;
}

KeptResults kept_results(const std::filesystem::path& folder) {
  const auto record = record_of(folder);
  Database database(record, Database::Open::read);
  if (const int format = record_format(database, record.string()); format < 2)
    throw ConfigError(fmt::format("{}: found a record of format {}, which holds neither experiment nor metrics; allowed: format 2 or later",
                                  record.string(), format));
  KeptResults kept;
  kept.folder = folder;
  kept.host = json_in(folder / "host.json");
  if (Statement row = database.prepare("SELECT text FROM experiment"); row.step()) kept.text = row.text(0);
  for (Statement row = database.prepare("SELECT run, protocol, seed, run_hash, rounds, ended FROM runs ORDER BY run"); row.step();) {
    KeptRun& run = kept.runs.emplace_back(KeptRun{row.integer(0), row.text(1), row.text(2), {}, {}});
    if (row.is_null(5)) continue;
    run.hash = row.text(3);
    if (!row.is_null(4)) run.rounds = row.integer(4);
  }
  for (Statement row = database.prepare("SELECT name, value FROM results"); row.step();) kept.metrics[row.text(0)] = number_or_nan(row, 1);
  for (Statement row = database.prepare("SELECT text, met, value FROM criteria ORDER BY number"); row.step();) {
    KeptCriterion& criterion = kept.criteria.emplace_back(KeptCriterion{row.text(0), {}, number_or_nan(row, 2)});
    if (!row.is_null(1)) criterion.met = row.integer(1) != 0;
  }
  return kept;
}

}  // namespace consort
