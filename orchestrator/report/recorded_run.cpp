#include "orchestrator/report/recorded_run.hpp"

#include "core/errors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace consort {
namespace {

// Several protocols share the table, so the order of its columns is not that of each layout: kind by kind, field by field as the protocol
// lists them, matrices column by column.
void put_in_order(std::vector<RecordedColumn>& columns, const ProtocolEntry& protocol) {
  const auto kind = [](const RecordedColumn& c) { return c.kind == "estimate" ? 0 : c.kind == "state" ? 1 : 2; };
  std::map<std::pair<int, std::string>, std::size_t> rank;
  for (const auto docs : {protocol.estimate, protocol.recorded})
    for (const ValueDoc& doc : docs)
      rank.try_emplace({docs.data() == protocol.estimate.data() ? 0 : 1, std::string(doc.name)}, rank.size());
  for (const RecordedColumn& c : columns) rank.try_emplace({kind(c), c.field}, rank.size());
  std::stable_sort(columns.begin(), columns.end(), [&](const RecordedColumn& a, const RecordedColumn& b) {
    return std::tuple(kind(a), rank.at({kind(a), a.field}), a.column, a.row) <
           std::tuple(kind(b), rank.at({kind(b), b.field}), b.column, b.row);
  });
}

}  // namespace

RecordedRun::RecordedRun(Database& database, std::int64_t number, double most_numbers) : run(number), database_(&database) {
  Statement facts = database.prepare("SELECT protocol, seed, agents FROM runs WHERE run = ?");
  facts.bind(0, run);
  if (!facts.step()) throw RunError(fmt::format("the record has no run {}", run));
  protocol = facts.text(0);
  seed = facts.text(1);
  agents = static_cast<std::size_t>(facts.integer(2));

  Statement column = database.prepare(
      "SELECT t.name, c.kind, c.field, c.field_row, c.field_column, c.meaning FROM pragma_table_info('estimates') t JOIN columns c ON "
      "c.name = t.name AND c.protocol = ? ORDER BY t.cid");
  column.bind(0, std::string_view(protocol));
  while (column.step())
    columns.push_back({column.text(0), column.text(1), column.text(2), static_cast<std::size_t>(column.integer(3)),
                       static_cast<std::size_t>(column.integer(4)), column.text(5)});

  put_in_order(columns, entry());

  Statement extent = database.prepare(
      "SELECT count(*), max(round), (SELECT report_every FROM experiment) FROM (SELECT DISTINCT round FROM estimates WHERE run = ?)");
  extent.bind(0, run);
  if (!extent.step() || extent.integer(0) == 0) return;
  const auto all = static_cast<std::size_t>(extent.integer(0));
  last_ = static_cast<Round>(extent.integer(1));
  interval_ = static_cast<Round>(std::max<std::int64_t>(1, extent.integer(2)));
  const double numbers = static_cast<double>(all) * static_cast<double>(agents) * static_cast<double>(columns.size());
  every = static_cast<std::size_t>(std::max(1.0, std::ceil(numbers / most_numbers)));
  const Round step = interval_ * static_cast<Round>(every);
  reports = every == 1 ? all : last_ / step + 1 + (last_ % step == 0 ? 0 : 1);
}

const ProtocolEntry& RecordedRun::entry() const { return find_protocol(protocol.substr(0, protocol.find('.'))); }

std::vector<std::size_t> RecordedRun::of_kind(std::string_view kind) const {
  std::vector<std::size_t> found;
  for (std::size_t c = 0; c < columns.size(); ++c)
    if (columns[c].kind == kind) found.push_back(c);
  return found;
}

void RecordedRun::for_each(const std::function<void(Round, std::span<const double>)>& use) const {
  if (reports == 0 || columns.empty()) return;
  std::string names;
  for (const RecordedColumn& column : columns) names += ", " + sql_identifier(column.name);
  Statement row = database_->prepare(
      fmt::format("SELECT round, agent{} FROM estimates WHERE run = ? AND round <= ? AND (round % ? = 0 OR round = ? OR ? = 1) ORDER BY "
                  "round, agent",
                  names));
  row.bind(0, run);
  row.bind(1, static_cast<std::int64_t>(last_));
  row.bind(2, static_cast<std::int64_t>(interval_) * static_cast<std::int64_t>(every));
  row.bind(3, static_cast<std::int64_t>(last_));
  row.bind(4, static_cast<std::int64_t>(every));
  const std::size_t width = columns.size();
  std::vector<double> numbers(agents * width, kAbsent);
  bool any = false;
  Round round = 0;
  const auto give = [&] {
    if (any) use(round, numbers);
    std::fill(numbers.begin(), numbers.end(), kAbsent);
  };
  while (row.step()) {
    const auto k = static_cast<Round>(row.integer(0));
    if (any && k != round) give();
    any = true;
    round = k;
    const auto agent = static_cast<std::size_t>(row.integer(1));
    if (agent < 1 || agent > agents) continue;
    for (std::size_t c = 0; c < width; ++c)
      if (const int at = static_cast<int>(c) + 2; !row.is_null(at)) numbers[(agent - 1) * width + c] = row.real(at);
  }
  give();
}

}  // namespace consort
