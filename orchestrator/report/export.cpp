#include "orchestrator/report/export.hpp"

#include "core/errors.hpp"
#include "orchestrator/report/record_schema.hpp"
#include "orchestrator/report/sqlite.hpp"

#include <fmt/format.h>

#include <fstream>
#include <iterator>

namespace consort {
namespace {

std::string csv_text(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"') result += '"';
    result += c;
  }
  return result + '"';
}

void append_row(fmt::memory_buffer& out, const Statement& row) {
  for (int column = 0; column < row.columns(); ++column) {
    if (column > 0) out.push_back(',');
    if (row.is_null(column)) continue;
    if (row.is_real(column))
      fmt::format_to(std::back_inserter(out), "{}", row.real(column));  // the shortest text that reads back exactly
    else
      fmt::format_to(std::back_inserter(out), "{}", csv_text(row.text(column)));
  }
  out.push_back('\n');
}

std::size_t write_table(Database& database, const std::string& table, const std::filesystem::path& file) {
  Statement row = database.prepare("SELECT * FROM " + sql_identifier(table));
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  fmt::memory_buffer buffer;
  const auto flush = [&] {
    out.write(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    buffer.clear();
  };
  for (int column = 0; column < row.columns(); ++column)
    fmt::format_to(std::back_inserter(buffer), "{}{}", column > 0 ? "," : "", csv_text(row.name(column)));
  buffer.push_back('\n');
  std::size_t rows = 0;
  for (; row.step(); ++rows) {
    append_row(buffer, row);
    if (buffer.size() > (1u << 20)) flush();
  }
  flush();
  out.close();
  if (!out) throw RunError("cannot write " + file.string());
  return rows;
}

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

}  // namespace

Exported export_csv(const std::filesystem::path& folder) {
  const auto record = folder / "record.sqlite";
  if (!std::filesystem::exists(record))
    throw ConfigError(fmt::format("{}: holds no record.sqlite; allowed: an output folder of `consort run`", folder.string()));
  Database database(record, Database::Open::read);
  Exported exported{record_format(database, record.string()), {}, {}};
  std::vector<std::string> tables;
  Statement table = database.prepare("SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY rootpage");
  while (table.step()) tables.push_back(table.text(0));
  std::error_code failure;
  std::filesystem::create_directory(folder / "csv", failure);
  if (failure) throw RunError(fmt::format("cannot create the folder {}: {}", (folder / "csv").string(), failure.message()));
  for (const auto& name : tables) {
    const auto file = folder / "csv" / (name + ".csv");
    exported.tables.push_back({file, write_table(database, name, file)});
  }
  exported.remarks = changes_since(exported.format);
  remark_on_unfinished(database, exported.remarks);
  return exported;
}

}  // namespace consort
