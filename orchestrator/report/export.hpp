#pragma once
/// The record as plain text for other programs.

#include <filesystem>
#include <string>
#include <vector>

namespace consort {

struct ExportedTable {
  std::filesystem::path file;
  std::size_t rows = 0;
};

struct Exported {
  int format = 0;  ///< of the record
  std::vector<ExportedTable> tables;
  std::vector<std::string> remarks;  ///< what a reader should know: runs that did not end, words of older formats that mean something else
};

/// Writes every table of `folder`/record.sqlite to `folder`/csv/<table>.csv (RFC 4180, a header line, numbers that read back exactly, NULL
/// as nothing). Throws ConfigError if `folder` holds no record, or one of a format that is not known here; RunError if reading or writing
/// fails.
Exported export_csv(const std::filesystem::path& folder);

}  // namespace consort
