#include "orchestrator/report/tables.hpp"

#include "core/number_text.hpp"
#include "orchestrator/report/recorded_run.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace consort {
namespace {

constexpr double kAllNumbers = std::numeric_limits<double>::infinity();  // none is left out

std::vector<std::int64_t> runs_of(Database& database) {
  std::vector<std::int64_t> runs;
  for (Statement row = database.prepare("SELECT run FROM runs ORDER BY run"); row.step();) runs.push_back(row.integer(0));
  return runs;
}

double dt_of(Database& database) {
  Statement row = database.prepare("SELECT dt FROM experiment");
  return row.step() ? row.real(0) : 1.0;
}

// Of a column that is no text by its declaration, as of seeds.
TableCell number_or_text(const Statement& row, int column) {
  if (row.is_real(column)) return row.real(column);
  const std::string text = row.text(column);
  const auto number = parse_number<std::int64_t>(text);
  return number ? TableCell(*number) : TableCell(text);
}

TableCell present(double value) { return std::isnan(value) ? TableCell() : TableCell(value); }

}  // namespace

WrittenTable write_table(Database& database, const std::string& table, TableSink& sink) {
  std::vector<bool> text;
  std::vector<std::string> names;
  Statement row = database.prepare("SELECT * FROM " + sql_identifier(table));
  for (int column = 0; column < row.columns(); ++column) names.push_back(row.name(column));
  for (const std::string& name : names) {
    Statement type = database.prepare("SELECT type = 'TEXT' FROM pragma_table_xinfo(?) WHERE name = ?");
    type.bind(0, std::string_view(table));
    type.bind(1, std::string_view(name));
    text.push_back(type.step() && type.integer(0) != 0);
  }
  WrittenTable written{sink.begin(table, names)};
  std::vector<TableCell> cells(names.size());
  for (; row.step(); ++written.rows) {
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const int column = static_cast<int>(c);
      cells[c] = row.is_null(column) ? TableCell() : text[c] ? TableCell(row.text(column)) : number_or_text(row, column);
    }
    sink.row(cells);
  }
  sink.end();
  return written;
}

WrittenTable write_long(Database& database, TableSink& sink) {
  WrittenTable written{sink.begin("long", {"run", "protocol", "seed", "round", "time", "agent", "component", "value"})};
  const double dt = dt_of(database);
  for (const std::int64_t number : runs_of(database)) {
    const RecordedRun run(database, number, kAllNumbers);
    const auto seed = parse_number<std::int64_t>(run.seed);
    std::vector<TableCell> cells{run.run, run.protocol, seed ? TableCell(*seed) : TableCell(run.seed), {}, {}, {}, {}, {}};
    run.for_each([&](Round round, std::span<const double> numbers) {
      cells[3] = static_cast<std::int64_t>(round);
      cells[4] = static_cast<double>(round) * dt;
      for (std::size_t i = 0; i < numbers.size(); ++i) {
        if (std::isnan(numbers[i])) continue;
        cells[5] = static_cast<std::int64_t>(i / run.columns.size() + 1);
        cells[6] = run.columns[i % run.columns.size()].name;
        cells[7] = numbers[i];
        sink.row(cells);
        ++written.rows;
      }
    });
  }
  sink.end();
  return written;
}

std::vector<WrittenTable> write_wide(Database& database, TableSink& sink) {
  std::vector<WrittenTable> all;
  const double dt = dt_of(database);
  for (const std::int64_t number : runs_of(database)) {
    const RecordedRun run(database, number, kAllNumbers);
    const std::size_t width = run.columns.size();
    std::vector<std::string> names{"round", "time"};
    for (const RecordedColumn& column : run.columns)
      for (std::size_t agent = 1; agent <= run.agents; ++agent) names.push_back(fmt::format("agent{}_{}", agent, column.name));
    WrittenTable& written = all.emplace_back(WrittenTable{sink.begin(fmt::format("wide_{}", number), names)});
    std::vector<TableCell> cells(names.size());
    run.for_each([&](Round round, std::span<const double> numbers) {
      cells[0] = static_cast<std::int64_t>(round);
      cells[1] = static_cast<double>(round) * dt;
      for (std::size_t c = 0; c < width; ++c)
        for (std::size_t agent = 0; agent < run.agents; ++agent) cells[2 + c * run.agents + agent] = present(numbers[agent * width + c]);
      sink.row(cells);
      ++written.rows;
    });
    sink.end();
  }
  return all;
}

}  // namespace consort
