#pragma once
/// Tables as text, a file each.

#include "core/errors.hpp"
#include "orchestrator/report/tables.hpp"

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>

namespace consort {

/// Whoever derives appends to `text_` what a table is; it goes to the disk in large pieces.
class TextTables : public TableSink {
 public:
  void end() override {
    flush();
    out_.close();
    if (!out_) throw RunError("cannot write " + file_.string());
  }

 protected:
  /// `extension`: of the files, such as ".csv".
  TextTables(std::filesystem::path folder, std::string extension) : folder_(std::move(folder)), extension_(std::move(extension)) {}
  void open(const std::string& table) {
    file_ = folder_ / (table + extension_);
    out_.open(file_, std::ios::binary | std::ios::trunc);
  }
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  void flush_if_much() {
    if (text_.size() > (1U << 20U)) flush();
  }

  std::string text_;

 private:
  void flush() {
    out_.write(text_.data(), static_cast<std::streamsize>(text_.size()));
    text_.clear();
  }

  std::filesystem::path folder_, file_;
  std::string extension_;
  std::ofstream out_;
};

}  // namespace consort
