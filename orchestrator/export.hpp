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

/// Writes every table of `folder`/record.sqlite to `folder`/csv/<table>.csv (RFC 4180, a header line, numbers that read back exactly, NULL
/// as nothing). Throws ConfigError if `folder` holds no record, RunError if reading or writing fails.
std::vector<ExportedTable> export_csv(const std::filesystem::path& folder);

}  // namespace consort
