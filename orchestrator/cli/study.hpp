#pragma once
/// A study from its file to its table: plan, cells, what is collected of them.

#include "orchestrator/report/cell_result.hpp"
#include "orchestrator/report/results.hpp"
#include "orchestrator/report/study_plan.hpp"

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

namespace consort {

/// How a study is run, apart from what it is.
struct StudyOptions {
  std::optional<std::size_t> jobs;  ///< cells at once; nullopt: simulate: one per core, else one
  bool fail_fast = false;           ///< no further cell once one has failed
  bool no_report = false;
  std::function<void(std::size_t done, std::size_t all)> tell = {};
};

/// Every cell is read once; what is wrong with one is a ConfigError that names it. `name` stands for the file.
StudyPlan make_plan(const std::string& text, const std::string& name, const StudyAsked& asked);
/// experiment.yaml, plan.json and host.json in `folder`.
void begin_study(const std::filesystem::path& folder, const std::string& text, const StudyPlan& plan,
                 const std::vector<std::string>& command_line);
/// As it was planned in `folder`, or, where the program or a file it names has changed, planned anew.
StudyPlan resumed_plan(const std::filesystem::path& folder);

/// Runs the cells that are not done. What came of them is in the folder.
void run_study(const std::filesystem::path& folder, const StudyPlan& plan, const StudyOptions& options);
/// Runs one, from 0, in a folder of its own. Throws ConfigError if it is not the one that was planned.
CellResult run_planned_cell(const std::filesystem::path& folder, const StudyPlan& plan, std::size_t cell);
/// Table, record, page and summary of what there is in `folder`.
struct Collected {
  Summary summary;
  std::string table;  ///< Markdown
  std::string page;   ///< its file; empty: none
};
Collected collect_study(const std::filesystem::path& folder, bool no_report, int signal = 0);

}  // namespace consort
