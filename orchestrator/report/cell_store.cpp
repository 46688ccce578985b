#include "orchestrator/report/cell_store.hpp"

#include "orchestrator/report/kept_results.hpp"
#include "orchestrator/report/record_schema.hpp"

namespace consort {
namespace {

// What is there is complete: it was made under another name.
std::filesystem::path made_record(const std::filesystem::path& folder) {
  const auto file = folder / "record.sqlite";
  if (std::filesystem::exists(file)) return file;
  const auto unfinished = folder / "record.sqlite.part";
  std::filesystem::remove(unfinished);
  {
    Database database(unfinished, Database::Open::create);
    database.run(record_schema(plan_in(folder).dt));
    database.run(
        "CREATE TABLE cells (             -- of a study: what came of each cell, whatever else is recorded of it\n"
        "  cell INTEGER PRIMARY KEY,      -- 1, 2, ... as in plan.json\n"
        "  hash TEXT NOT NULL,            -- as in plan.json, if it is of that plan\n"
        "  result TEXT NOT NULL           -- JSON\n"
        ")");
  }
  std::filesystem::rename(unfinished, file);
  return file;
}

}  // namespace

CellStore::CellStore(const std::filesystem::path& folder) : folder_(folder), database_(made_record(folder), Database::Open::read) {}

void CellStore::keep(std::size_t cell, const CellResult& result) {
  const std::string text = to_json(result).dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  const std::lock_guard lock(mutex_);
  Statement row = database_.prepare("INSERT OR REPLACE INTO cells VALUES (?, ?, ?)");
  row.bind(0, static_cast<std::int64_t>(cell + 1));
  row.bind(1, hex(result.hash));
  row.bind(2, text);
  row.execute();
}

std::vector<std::optional<CellResult>> CellStore::results(const StudyPlan& plan) {
  std::vector<std::optional<CellResult>> all(plan.cells.size());
  for (Statement row = database_.prepare("SELECT cell, hash, result FROM cells"); row.step();) {
    const auto cell = static_cast<std::size_t>(row.integer(0)) - 1;
    if (cell >= all.size() || row.text(1) != hex(plan.cells[cell].hash)) continue;
    all[cell] = cell_result_of(nlohmann::ordered_json::parse(row.text(2), nullptr, false));
  }
  if (!std::filesystem::exists(folder_ / "cells")) return all;
  for (std::size_t cell = 0; cell < all.size(); ++cell)
    if (auto result = result_in(cell_folder(folder_, cell), plan.cells[cell].hash); result && (result->done() || !all[cell]))
      all[cell] = std::move(result);
  return all;
}

std::optional<CellResult> result_in(const std::filesystem::path& cell, std::uint64_t hash) {
  const auto summary = json_in(cell / "summary.json");
  if (!summary.is_object() || !summary.contains("cell")) return std::nullopt;
  auto result = cell_result_of(summary["cell"]);
  return result && result->hash == hash ? std::move(result) : std::nullopt;
}

}  // namespace consort
