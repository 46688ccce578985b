#include "orchestrator/report/sqlite.hpp"

#include "core/errors.hpp"

#include <sqlite3.h>

#include <cstring>

namespace consort {
namespace {

// `doing`: for a person, so not in SQL.
[[noreturn]] void fail(sqlite3* connection, std::string_view doing = "") {
  const char* file = connection != nullptr ? sqlite3_db_filename(connection, "main") : nullptr;
  std::string text = "record " + std::string(file != nullptr ? file : "") + ": " + std::string(doing) + (doing.empty() ? "" : ": ") +
                     (connection != nullptr ? sqlite3_errmsg(connection) : "out of memory");
  const int reason = connection != nullptr ? sqlite3_system_errno(connection) : 0;
  const int code = connection != nullptr ? sqlite3_errcode(connection) : SQLITE_NOMEM;
  if (code == SQLITE_NOTADB)
    throw ConfigError(std::string(file != nullptr ? file : "") +
                      ": is no record of consort, nor any SQLite database; allowed: the record.sqlite of an output folder");
  if (reason != 0 && (code == SQLITE_IOERR || code == SQLITE_FULL)) text += std::string(" (") + std::strerror(reason) + ")";
  throw RunError(text);
}

void require(int code, sqlite3_stmt* statement, std::string_view doing) {
  if (code != SQLITE_OK) fail(sqlite3_db_handle(statement), doing);
}

}  // namespace

void Statement::Finalise::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
void Database::Close::operator()(sqlite3* connection) const { sqlite3_close(connection); }

void Statement::bind(int parameter, std::int64_t value) {
  require(sqlite3_bind_int64(statement_.get(), parameter + 1, value), statement_.get(), "binding a number");
}
void Statement::bind(int parameter, double value) {
  require(sqlite3_bind_double(statement_.get(), parameter + 1, value), statement_.get(), "binding a number");
}
void Statement::bind(int parameter, std::string_view text) {
  require(sqlite3_bind_text(statement_.get(), parameter + 1, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT),
          statement_.get(), "binding a text");
}

bool Statement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code != SQLITE_ROW && code != SQLITE_DONE) fail(sqlite3_db_handle(statement_.get()));
  return code == SQLITE_ROW;
}

void Statement::execute() {
  while (step()) {
  }
  require(sqlite3_reset(statement_.get()), statement_.get(), "resetting a statement");
}

int Statement::columns() const { return sqlite3_column_count(statement_.get()); }
std::string Statement::name(int column) const { return sqlite3_column_name(statement_.get(), column); }
bool Statement::is_null(int column) const { return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL; }
bool Statement::is_real(int column) const { return sqlite3_column_type(statement_.get(), column) == SQLITE_FLOAT; }
std::int64_t Statement::integer(int column) const { return sqlite3_column_int64(statement_.get(), column); }
double Statement::real(int column) const { return sqlite3_column_double(statement_.get(), column); }
std::string Statement::text(int column) const {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  return text != nullptr ? std::string(text, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))) : std::string();
}

Database::Database(const std::filesystem::path& file, Open how) {
  const bool there = std::filesystem::exists(file);
  if (how == Open::create && there) throw RunError("record " + file.string() + ": exists already; a record is never overwritten");
  if (how == Open::read && !there) throw RunError("record " + file.string() + ": no such file");
  sqlite3* connection = nullptr;
  // Reading needs write access as well: what a crashed run has left in the write-ahead log is recovered on opening.
  const int code =
      sqlite3_open_v2(file.c_str(), &connection, SQLITE_OPEN_READWRITE | (how == Open::create ? SQLITE_OPEN_CREATE : 0), nullptr);
  connection_.reset(connection);
  if (code != SQLITE_OK) throw RunError("record " + file.string() + ": " + sqlite3_errstr(code));
  sqlite3_busy_timeout(connection, 5000);  // a reader, or its check-pointing, may hold the lock for a moment
}

void Database::run(const std::string& sql) {
  if (sqlite3_exec(connection_.get(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) fail(connection_.get());
}

Statement Database::prepare(const std::string& sql) {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(connection_.get(), sql.c_str(), static_cast<int>(sql.size()), &statement, nullptr) != SQLITE_OK)
    fail(connection_.get());
  Statement result;
  result.statement_.reset(statement);
  return result;
}

std::string sql_identifier(std::string_view name) {
  std::string result = "\"";
  for (const char c : name) {
    if (c == '"') result += '"';
    result += c;
  }
  return result + '"';
}

}  // namespace consort
