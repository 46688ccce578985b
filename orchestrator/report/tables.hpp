#pragma once
/// The tables of a record, and its estimates in long and wide form, row by row for whoever writes them down.

#include "orchestrator/report/sqlite.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace consort {

using TableCell = std::variant<std::monostate, std::int64_t, double, std::string>;  ///< nothing: NULL

/// Takes tables, one after the other.
class TableSink {
 public:
  TableSink() = default;
  virtual ~TableSink() = default;
  TableSink(const TableSink&) = delete;
  TableSink& operator=(const TableSink&) = delete;
  /// Gives the file that the table goes into.
  virtual std::filesystem::path begin(const std::string& table, const std::vector<std::string>& columns) = 0;
  virtual void row(std::span<const TableCell> cells) = 0;
  virtual void end() = 0;  ///< of the table. Throws RunError if it could not be written
};

/// DIR/<table>.csv: RFC 4180, a header line, numbers that read back exactly, NULL as nothing.
std::unique_ptr<TableSink> csv_tables(std::filesystem::path folder);
/// DIR/<table>.json: {"columns": [names], "data": [[row], ...]}; NULL and what is not finite as null.
std::unique_ptr<TableSink> json_tables(std::filesystem::path folder);
/// DIR/<table>.mat (level 5): a struct called <table>, a field per column: a column of doubles (NULL: NaN), or a cell of texts.
std::unique_ptr<TableSink> mat_tables(std::filesystem::path folder);

struct WrittenTable {
  std::filesystem::path file;
  std::size_t rows = 0;
};

WrittenTable write_table(Database& database, const std::string& table, TableSink& sink);
/// `long`: run, protocol, seed, round, time, agent, component, value; no row where an agent is not there.
WrittenTable write_long(Database& database, TableSink& sink);
/// `wide_<run>` of each run: round, time, then agent1_x, agent2_x, ...: a row per reported round.
std::vector<WrittenTable> write_wide(Database& database, TableSink& sink);

}  // namespace consort
