#pragma once
/// The tables of a record, and what has become of them. docs/guide/record.md describes every table and column.

#include "core/types.hpp"
#include "orchestrator/report/sqlite.hpp"

#include <string>
#include <vector>

namespace consort {

/// Of the records that are written now: PRAGMA user_version, and `format` in the table experiment.
inline constexpr int kRecordFormat = 2;

/// SQL that makes the tables; `dt` is the length of a round. Its comments stay in the file.
std::string record_schema(Seconds dt);

/// The format of a record that is read. Throws ConfigError if this program does not know it; `file` begins the text.
int record_format(Database& database, const std::string& file);

/// Where a record of an older format says something else by the same name, or does not say what newer ones do.
std::vector<std::string> changes_since(int format);

}  // namespace consort
