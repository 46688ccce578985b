#include "orchestrator/report/text_tables.hpp"

#include <fmt/format.h>

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

class CsvTables : public TextTables {
 public:
  explicit CsvTables(std::filesystem::path folder) : TextTables(std::move(folder), ".csv") {}

  std::filesystem::path begin(const std::string& table, const std::vector<std::string>& columns) override {
    open(table);
    for (std::size_t c = 0; c < columns.size(); ++c) text_ += (c > 0 ? "," : "") + csv_text(columns[c]);
    text_ += '\n';
    return file();
  }

  void row(std::span<const TableCell> cells) override {
    for (std::size_t c = 0; c < cells.size(); ++c) {
      if (c > 0) text_ += ',';
      if (const auto* text = std::get_if<std::string>(&cells[c])) text_ += csv_text(*text);
      if (const auto* whole = std::get_if<std::int64_t>(&cells[c])) fmt::format_to(std::back_inserter(text_), "{}", *whole);
      // The shortest text that reads back exactly.
      if (const auto* real = std::get_if<double>(&cells[c])) fmt::format_to(std::back_inserter(text_), "{}", *real);
    }
    text_ += '\n';
    flush_if_much();
  }
};

}  // namespace

std::unique_ptr<TableSink> csv_tables(std::filesystem::path folder) { return std::make_unique<CsvTables>(std::move(folder)); }

}  // namespace consort
