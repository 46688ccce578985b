#pragma once
/// Where the results of a study's cells are kept: in its record, which they share, or each in a folder of its own. A killed program leaves
/// each cell whole or not at all.

#include "orchestrator/report/cell_result.hpp"
#include "orchestrator/report/sqlite.hpp"
#include "orchestrator/report/study_plan.hpp"

#include <filesystem>
#include <mutex>
#include <optional>
#include <vector>

namespace consort {

class CellStore {
 public:
  /// Of the study in `folder`; its record is made if it is not there. Throws RunError.
  explicit CellStore(const std::filesystem::path& folder);
  /// In the shared record. May be called by several threads.
  void keep(std::size_t cell, const CellResult& result);
  /// By cell of the plan: what came of it, or failed, by this experiment and this program; nothing: neither is there.
  std::vector<std::optional<CellResult>> results(const StudyPlan& plan);
  [[nodiscard]] Database& database() { return database_; }

 private:
  std::filesystem::path folder_;
  std::mutex mutex_;
  Database database_;
};

/// What a cell with a folder of its own has left there; nothing: it has not ended, or is of another experiment or program.
std::optional<CellResult> result_in(const std::filesystem::path& cell, std::uint64_t hash);

}  // namespace consort
