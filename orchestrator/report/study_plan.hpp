#pragma once
/// The plan of a study, kept as plan.json in its folder: what is to be run, in which order, and by what a result is known to be of it.

#include "core/experiment.hpp"
#include "orchestrator/script/script.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace consort {

/// What somebody asked for: all that resuming needs to know.
struct StudyAsked {
  std::filesystem::path directory = {};  ///< relative data files of the experiment are found from here
  std::vector<std::string> sets = {};    ///< KEY=VALUES
  bool zipped = false;
  bool full = false;   ///< a record and a page for each cell
  bool force = false;  ///< what theory refuses is run, too
  ScriptOverrides overrides = {};
};

struct PlannedCell {
  Cell cell;
  std::vector<std::string> protocols;  ///< with the cell's label
  Seed seed;
  std::size_t runs = 1, agents = 0;
  std::uint64_t hash = 0;  ///< of the resolved experiment, what files it names hold among it, and of the program
};

struct StudyPlan {
  std::string experiment, description, program;
  Mode mode = Mode::simulate;
  Seconds dt = 1.0;
  std::vector<std::string> keys, metrics;
  std::vector<Study::Judged> criteria;
  std::vector<PlannedCell> cells;
  StudyAsked asked;
};

/// By what a cell's result is known to be of this experiment and this build of Consort.
std::uint64_t cell_hash(const Experiment& experiment);
PlannedCell planned(const Cell& cell, const Experiment& experiment);

nlohmann::ordered_json to_json(const StudyPlan& plan);
/// Of a folder. Throws ConfigError where it holds no plan.
StudyPlan plan_in(const std::filesystem::path& folder);

/// cells/0007 of it.
std::filesystem::path cell_folder(const std::filesystem::path& folder, std::size_t cell);

}  // namespace consort
