#pragma once
/// The record for other programs.

#include "orchestrator/report/tables.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace consort {

enum class ExportFormat { csv, json, mat, graphml };
/// tables: as the record has them; tall: a row per number of an agent and round; wide: a row per round, a column per number of an agent.
enum class ExportShape { tables, tall, wide };

struct Exported {
  int format = 0;  ///< of the record
  std::vector<WrittenTable> tables;
  std::vector<std::string> remarks;  ///< what a reader should know: runs that did not end, words of older formats that mean something else
};

/// Writes `folder`/record.sqlite to `folder`/csv, json, mat or graphml, one file per table or graph (see the sinks of tables.hpp). Throws
/// ConfigError if `folder` holds no record, one of a format that is not known here, or one that does not hold what the shape needs;
/// RunError if reading or writing fails.
Exported export_record(const std::filesystem::path& folder, ExportFormat format = ExportFormat::csv,
                       ExportShape shape = ExportShape::tables);

}  // namespace consort
