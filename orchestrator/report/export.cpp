#include "orchestrator/report/export.hpp"

#include "core/errors.hpp"
#include "orchestrator/report/graphml.hpp"
#include "orchestrator/report/kept_results.hpp"
#include "orchestrator/report/record_schema.hpp"
#include "orchestrator/report/sqlite.hpp"

#include <fmt/format.h>

namespace consort {
namespace {

// Runs that did not reach their end, and how far their record goes.
void remark_on_unfinished(Database& database, std::vector<std::string>& remarks) {
  Statement run = database.prepare(
      "SELECT run, protocol, seed, (SELECT max(round) FROM estimates WHERE estimates.run = runs.run) FROM runs WHERE ended IS NULL ORDER "
      "BY "
      "run");
  while (run.step())
    remarks.push_back(fmt::format("run {} ({}, seed {}) did not reach its end; {}", run.integer(0), run.text(1), run.text(2),
                                  run.is_null(3) ? "nothing of it is recorded" : "it is recorded up to round " + run.text(3)));
}

const char* folder_of(ExportFormat format) {
  switch (format) {
    case ExportFormat::csv:
      return "csv";
    case ExportFormat::json:
      return "json";
    case ExportFormat::mat:
      return "mat";
    case ExportFormat::graphml:
      return "graphml";
  }
  return "";
}

std::vector<WrittenTable> write_all(Database& database, ExportShape shape, TableSink& sink) {
  if (shape == ExportShape::tall) return {write_long(database, sink)};
  if (shape == ExportShape::wide) return write_wide(database, sink);
  std::vector<std::string> tables;
  for (Statement table = database.prepare("SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY rootpage"); table.step();)
    tables.push_back(table.text(0));
  std::vector<WrittenTable> written;
  for (const std::string& table : tables) written.push_back(write_table(database, table, sink));
  return written;
}

}  // namespace

Exported export_record(const std::filesystem::path& folder, ExportFormat format, ExportShape shape) {
  const auto record = record_of(folder);
  Database database(record, Database::Open::read);
  Exported exported{record_format(database, record.string()), {}, {}};
  if (exported.format < 2 && (format == ExportFormat::graphml || shape != ExportShape::tables))
    throw ConfigError(
        fmt::format("{}: found a record of format {}, which knows neither its columns nor its graphs; allowed: --shape tables",
                    record.string(), exported.format));
  const auto target = folder / folder_of(format);
  std::error_code failure;
  std::filesystem::create_directory(target, failure);
  if (failure) throw RunError(fmt::format("cannot create the folder {}: {}", target.string(), failure.message()));
  if (format == ExportFormat::graphml)
    exported.tables = write_graphs(database, target);
  else
    exported.tables = write_all(database, shape,
                                *(format == ExportFormat::csv    ? csv_tables(target)
                                  : format == ExportFormat::json ? json_tables(target)
                                                                 : mat_tables(target)));
  exported.remarks = changes_since(exported.format);
  remark_on_unfinished(database, exported.remarks);
  return exported;
}

}  // namespace consort
