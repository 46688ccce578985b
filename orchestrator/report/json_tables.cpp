#include "orchestrator/report/text_tables.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <iterator>

namespace consort {
namespace {

std::string json_text(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

class JsonTables : public TextTables {
 public:
  explicit JsonTables(std::filesystem::path folder) : TextTables(std::move(folder), ".json") {}

  std::filesystem::path begin(const std::string& table, const std::vector<std::string>& columns) override {
    open(table);
    text_ += "{\"columns\": [";
    for (std::size_t c = 0; c < columns.size(); ++c) text_ += (c > 0 ? ", " : "") + json_text(columns[c]);
    text_ += "],\n\"data\": [";
    first_ = true;
    return file();
  }

  void row(std::span<const TableCell> cells) override {
    text_ += first_ ? "\n[" : ",\n[";
    first_ = false;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      if (c > 0) text_ += ", ";
      append(cells[c]);
    }
    text_ += ']';
    flush_if_much();
  }

  void end() override {
    text_ += "\n]}\n";
    TextTables::end();
  }

 private:
  void append(const TableCell& cell) {
    if (const auto* text = std::get_if<std::string>(&cell))
      text_ += json_text(*text);
    else if (const auto* whole = std::get_if<std::int64_t>(&cell))
      fmt::format_to(std::back_inserter(text_), "{}", *whole);
    else if (const auto* real = std::get_if<double>(&cell); real != nullptr && std::isfinite(*real))
      fmt::format_to(std::back_inserter(text_), "{}", *real);
    else
      text_ += "null";
  }
  bool first_ = true;
};

}  // namespace

std::unique_ptr<TableSink> json_tables(std::filesystem::path folder) { return std::make_unique<JsonTables>(std::move(folder)); }

}  // namespace consort
