#include "orchestrator/report/tables.hpp"

#include "core/errors.hpp"

#include <fmt/format.h>
#include <matio.h>

#include <array>
#include <cmath>
#include <limits>

namespace consort {
namespace {

constexpr std::int64_t kExactly = std::int64_t{1} << 53;  // up to there a double holds every whole number

struct MatColumn {
  std::vector<double> numbers;
  std::vector<std::string> texts;  // as long as numbers, from the first cell on that is no number
  bool text = false;
};

void add(MatColumn& column, const TableCell& cell) {
  const auto* whole = std::get_if<std::int64_t>(&cell);
  const auto* real = std::get_if<double>(&cell);
  const auto* word = std::get_if<std::string>(&cell);
  if (!column.text && (word != nullptr || (whole != nullptr && (*whole > kExactly || *whole < -kExactly)))) {
    column.text = true;
    for (const double number : column.numbers) column.texts.push_back(std::isnan(number) ? "" : fmt::format("{}", number));
  }
  if (column.text)
    column.texts.push_back(word != nullptr    ? *word
                           : whole != nullptr ? fmt::format("{}", *whole)
                           : real != nullptr  ? fmt::format("{}", *real)
                                              : "");
  else
    column.numbers.push_back(whole != nullptr  ? static_cast<double>(*whole)
                             : real != nullptr ? *real
                                               : std::numeric_limits<double>::quiet_NaN());
}

struct CloseMat {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

// What is made of data that matio copies.
matvar_t* numbers_of(const std::vector<double>& numbers) {
  std::array<std::size_t, 2> size{numbers.size(), 1};
  // It takes a pointer that is not to const, and copies what is there.
  return Mat_VarCreate(nullptr, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, size.data(), const_cast<double*>(numbers.data()), 0);
}

matvar_t* text_of_cell(const std::string& text) {
  std::array<std::size_t, 2> size{text.empty() ? 0U : 1U, text.size()};
  return Mat_VarCreate(nullptr, MAT_C_CHAR, MAT_T_UTF8, 2, size.data(), const_cast<char*>(text.data()), 0);
}

matvar_t* cells_of(const std::vector<std::string>& texts) {
  std::array<std::size_t, 2> size{texts.size(), 1};
  Variable cells(Mat_VarCreate(nullptr, MAT_C_CELL, MAT_T_CELL, 2, size.data(), nullptr, 0));
  for (std::size_t i = 0; cells != nullptr && i < texts.size(); ++i)
    Mat_VarSetCell(cells.get(), static_cast<int>(i), text_of_cell(texts[i]));
  return cells.release();
}

class MatTables : public TableSink {
 public:
  explicit MatTables(std::filesystem::path folder) : folder_(std::move(folder)) {}

  std::filesystem::path begin(const std::string& table, const std::vector<std::string>& columns) override {
    table_ = table;
    names_ = columns;
    columns_.assign(columns.size(), {});
    return folder_ / (table + ".mat");
  }

  void row(std::span<const TableCell> cells) override {
    for (std::size_t c = 0; c < cells.size(); ++c) add(columns_[c], cells[c]);
  }

  void end() override {
    const auto file = folder_ / (table_ + ".mat");
    const std::unique_ptr<mat_t, CloseMat> out(Mat_CreateVer(file.c_str(), nullptr, MAT_FT_MAT5));
    std::vector<const char*> fields;
    for (const std::string& name : names_) fields.push_back(name.c_str());
    std::array<std::size_t, 2> size{1, 1};
    const Variable table(Mat_VarCreateStruct(table_.c_str(), 2, size.data(), fields.data(), static_cast<unsigned>(fields.size())));
    if (out == nullptr || table == nullptr) throw RunError("cannot write " + file.string());
    for (std::size_t c = 0; c < columns_.size(); ++c)
      Mat_VarSetStructFieldByName(table.get(), fields[c], 0,
                                  columns_[c].text ? cells_of(columns_[c].texts) : numbers_of(columns_[c].numbers));
    if (Mat_VarWrite(out.get(), table.get(), MAT_COMPRESSION_ZLIB) != 0) throw RunError("cannot write " + file.string());
    columns_.clear();
  }

 private:
  std::filesystem::path folder_;
  std::string table_;
  std::vector<std::string> names_;
  std::vector<MatColumn> columns_;
};

}  // namespace

std::unique_ptr<TableSink> mat_tables(std::filesystem::path folder) { return std::make_unique<MatTables>(std::move(folder)); }

}  // namespace consort
