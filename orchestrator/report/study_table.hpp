#pragma once
/// The table of a study: a row per cell and protocol, made of what is kept of the cells and of nothing else.

#include "orchestrator/report/cell_result.hpp"
#include "orchestrator/report/results.hpp"
#include "orchestrator/report/spread.hpp"
#include "orchestrator/report/study_plan.hpp"

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace consort {

struct StudyRow {
  std::size_t cell = 0;   ///< index in the plan
  std::string protocol;   ///< its name alone
  ProtocolResult result;  ///< of all seeds, called with the cell's label
  std::map<std::string, Spread> spreads;
  std::optional<CellCurve> curve = {};
};

struct StudyTable {
  std::vector<StudyRow> rows;                    ///< in the order of the plan; of a cell that is not there: none
  std::vector<std::string> metrics;              ///< those that are shown side by side
  std::size_t missing = 0;                       ///< cells
  std::vector<std::string> failures;             ///< "cell 3 (dt = 0.1): why"
  Exit failed = Exit::ok;                        ///< how the first of those ended
  std::optional<std::uint64_t> trace_hash = {};  ///< over the hashes of all runs, in order
};

StudyTable table_of(const StudyPlan& plan, std::span<const std::optional<CellResult>> results);

/// What came of the study: its metrics are those of all cells, called <protocol>.<cell>.<metric>, with .std and .share over several seeds;
/// its criteria are judged over them. `signal`: it was ended by that.
Summary summary_of(const StudyPlan& plan, const StudyTable& table, const std::filesystem::path& folder, int signal);

/// One value of a key, for a table.
std::string text_of(const Setting& setting);

std::string table_csv(const StudyPlan& plan, const StudyTable& table);       ///< a row per cell, protocol and metric
std::string table_tex(const StudyPlan& plan, const StudyTable& table);       ///< for booktabs; the metrics that are shown
std::string table_markdown(const StudyPlan& plan, const StudyTable& table);  ///< the same

}  // namespace consort
