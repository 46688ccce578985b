#pragma once
/// The criteria of a study name metrics of its cells.

#include "core/experiment.hpp"
#include "orchestrator/script/study.hpp"

#include <functional>
#include <map>
#include <string>

namespace consort {

/// By protocol with the cell's label, the number of the cell.
using CellTitles = std::map<std::string, std::size_t>;

/// Names the criterion a cell? If not, it is one of every cell, which names metrics as that would alone.
bool names_a_cell(const std::string& criterion, const CellTitles& cells);

/// Throws ConfigError that names the place in `file` of each criterion that cannot be read or names what no cell has.
/// `read` gives a cell's experiment.
void check_study_criteria(const Study& study, const std::string& file, const CellTitles& cells,
                          const std::function<Experiment(std::size_t)>& read);

}  // namespace consort
