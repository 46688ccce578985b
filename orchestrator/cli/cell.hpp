#pragma once
/// One cell of a study is run.

#include "core/experiment.hpp"
#include "orchestrator/report/cell_result.hpp"
#include "orchestrator/run/run.hpp"

#include <filesystem>

namespace consort {

struct CellOptions {
  RunOptions run;
  std::filesystem::path folder;  ///< its own; empty: it leaves nothing but what is returned
  bool full = false;             ///< with record, page and all else that a run leaves
  bool curves = false;           ///< how far the runs were from what they are for, over the rounds
  bool force = false;            ///< also what theory refuses
};

/// What came of it. A failure is part of that; nothing is thrown but what the folder objects to.
CellResult run_cell(const Experiment& experiment, const CellOptions& options);

}  // namespace consort
