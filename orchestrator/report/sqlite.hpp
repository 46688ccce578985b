#pragma once
/// The little of SQLite that the record needs: a connection and prepared statements that own their resources.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace consort {

/// A prepared statement. Failures throw RunError with SQLite's words and the path of the database. Parameters and columns count from 0.
class Statement {
 public:
  void bind(int parameter, std::int64_t value);
  void bind(int parameter, double value);  ///< NaN is stored as NULL
  void bind(int parameter, std::string_view text);
  bool step();     ///< true: there is a row to read
  void execute();  ///< runs to the end and makes the statement ready for the next binding

  [[nodiscard]] int columns() const;
  [[nodiscard]] std::string name(int column) const;
  [[nodiscard]] bool is_null(int column) const;
  [[nodiscard]] bool is_real(int column) const;
  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] double real(int column) const;
  [[nodiscard]] std::string text(int column) const;

 private:
  friend class Database;
  struct Finalise {
    void operator()(sqlite3_stmt* statement) const;
  };
  std::unique_ptr<sqlite3_stmt, Finalise> statement_;
};

class Database {
 public:
  enum class Open { create, read };  ///< create: the file must not exist; read: it must
  Database(const std::filesystem::path& file, Open how);

  void run(const std::string& sql);  ///< one or more statements without result
  [[nodiscard]] Statement prepare(const std::string& sql);

 private:
  struct Close {
    void operator()(sqlite3* connection) const;
  };
  std::unique_ptr<sqlite3, Close> connection_;
};

/// `name` as an SQL identifier, quoted.
std::string sql_identifier(std::string_view name);

}  // namespace consort
