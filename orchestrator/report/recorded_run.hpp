#pragma once
/// One run of a record, report by report.

#include "core/types.hpp"
#include "orchestrator/report/sqlite.hpp"
#include "protocols/registry.hpp"

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace consort {

/// A column of the table estimates.
struct RecordedColumn {
  std::string name;
  std::string kind;  ///< estimate, state or plant
  std::string field;
  std::size_t row = 0, column = 0;  ///< where in the field
  std::string meaning;
};

class RecordedRun {
 public:
  /// Reads at most `most_numbers` numbers: of a longer run every m-th report, and the last one.
  RecordedRun(Database& database, std::int64_t run, double most_numbers);

  std::int64_t run = 0;
  std::string protocol;  ///< of a sweep, with the name of its value
  std::string seed;
  std::size_t agents = 0;
  std::vector<RecordedColumn> columns;  ///< in the order of the protocol's layouts: estimate, then what is recorded, then the plant
  std::size_t reports = 0;              ///< that for_each() will give
  std::size_t every = 1;                ///< it gives every m-th report

  [[nodiscard]] const ProtocolEntry& entry() const;
  /// Columns of one kind, as indices, in the order of their layout.
  [[nodiscard]] std::vector<std::size_t> of_kind(std::string_view kind) const;

  /// Calls use(round, numbers) for each report, ascending; numbers: agents x columns, agent after agent, kAbsent where nothing is recorded.
  void for_each(const std::function<void(Round, std::span<const double>)>& use) const;

 private:
  Database* database_;
  Round last_ = 0, interval_ = 1;
};

}  // namespace consort
