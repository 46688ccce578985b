#pragma once
/// The record of a study: the tables of any record, as far as a study has something for them.

#include "orchestrator/report/cell_store.hpp"
#include "orchestrator/report/results.hpp"

namespace consort {

/// Runs, metrics, results and criteria of all cells, in the order of the plan, instead of what was there; no estimates. `text`: the
/// experiment.
void write_study_record(CellStore& store, const StudyPlan& plan, std::span<const std::optional<CellResult>> results, const Summary& summary,
                        const std::string& text);

}  // namespace consort
