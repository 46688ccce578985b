#include "orchestrator/report/first_difference.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace consort {
namespace {

std::vector<std::string> columns_recorded(Database& database, const std::string& protocol) {
  Statement column = database.prepare(
      "SELECT t.name FROM pragma_table_info('estimates') t JOIN columns c ON c.name = t.name AND c.protocol = ? ORDER BY t.cid");
  column.bind(0, std::string_view(protocol));
  std::vector<std::string> names;
  while (column.step()) names.push_back(column.text(0));
  return names;
}

// The reports of a run, row by row.
class Reports {
 public:
  Reports(Database& database, std::int64_t run, const std::vector<std::string>& columns)
      : rows_(database.prepare("SELECT round, agent" + listed(columns) + " FROM estimates WHERE run = ? ORDER BY round, agent")) {
    rows_.bind(0, run);
    next();
  }
  void next() {
    there_ = rows_.step();
    if (there_) place_ = {rows_.integer(0), rows_.integer(1)};
  }
  [[nodiscard]] bool there() const { return there_; }
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> place() const { return place_; }
  [[nodiscard]] std::optional<double> value(std::size_t column) const {
    const int at = static_cast<int>(column) + 2;
    return rows_.is_null(at) ? std::nullopt : std::optional(rows_.real(at));
  }

 private:
  static std::string listed(const std::vector<std::string>& columns) {
    std::string names;
    for (const std::string& column : columns) names += ", " + sql_identifier(column);
    return names;
  }

  Statement rows_;
  bool there_ = false;
  std::pair<std::int64_t, std::int64_t> place_;  // round, agent
};

}  // namespace

ReportsCompared compare_reports(Database& a, std::int64_t run_a, Database& b, std::int64_t run_b, const std::string& protocol) {
  std::vector<std::string> columns = columns_recorded(a, protocol);
  const std::vector<std::string> others = columns_recorded(b, protocol);
  std::erase_if(columns, [&](const std::string& name) { return std::find(others.begin(), others.end(), name) == others.end(); });
  Reports left(a, run_a, columns), right(b, run_b, columns);
  ReportsCompared compared;
  std::int64_t lonely = -1;
  while (left.there() && right.there()) {
    if (left.place() != right.place()) {
      Reports& behind = left.place() < right.place() ? left : right;
      if (behind.place().first != lonely) ++compared.only_one;
      lonely = behind.place().first;
      behind.next();
      continue;
    }
    const auto [round, agent] = left.place();
    if (round != compared.last) ++compared.compared;
    compared.last = round;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (left.value(c) == right.value(c)) continue;
      compared.first = FirstDifference{round, agent, columns[c], left.value(c), right.value(c)};
      return compared;
    }
    left.next();
    right.next();
  }
  return compared;
}

}  // namespace consort
