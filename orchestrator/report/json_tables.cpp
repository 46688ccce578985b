#include "orchestrator/report/tables.hpp"

#include "core/errors.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <fstream>
#include <iterator>

namespace consort {
namespace {

std::string json_text(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

class JsonTables : public TableSink {
 public:
  explicit JsonTables(std::filesystem::path folder) : folder_(std::move(folder)) {}

  std::filesystem::path begin(const std::string& table, const std::vector<std::string>& columns) override {
    file_ = folder_ / (table + ".json");
    out_.open(file_, std::ios::binary | std::ios::trunc);
    text_ = "{\"columns\": [";
    for (std::size_t c = 0; c < columns.size(); ++c) text_ += (c > 0 ? ", " : "") + json_text(columns[c]);
    text_ += "],\n\"data\": [";
    first_ = true;
    return file_;
  }

  void row(std::span<const TableCell> cells) override {
    text_ += first_ ? "\n[" : ",\n[";
    first_ = false;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      if (c > 0) text_ += ", ";
      append(cells[c]);
    }
    text_ += ']';
    if (text_.size() > (1U << 20U)) flush();
  }

  void end() override {
    text_ += "\n]}\n";
    flush();
    out_.close();
    if (!out_) throw RunError("cannot write " + file_.string());
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
  void flush() {
    out_.write(text_.data(), static_cast<std::streamsize>(text_.size()));
    text_.clear();
  }

  std::filesystem::path folder_, file_;
  std::ofstream out_;
  std::string text_;
  bool first_ = true;
};

}  // namespace

std::unique_ptr<TableSink> json_tables(std::filesystem::path folder) { return std::make_unique<JsonTables>(std::move(folder)); }

}  // namespace consort
