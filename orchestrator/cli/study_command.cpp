#include "orchestrator/cli/study_command.hpp"

#include "core/counted.hpp"
#include "core/option_text.hpp"
#include "io/standard_streams.hpp"
#include "orchestrator/cli/signals.hpp"
#include "orchestrator/report/study_table.hpp"
#include "orchestrator/report/table.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <sstream>
#include <utility>

namespace consort {
namespace {

// How many cells have ended, for whoever waits: in one line of a terminal, else a line a second.
class CellsTold {
 public:
  explicit CellsTold(const TextStyle& style) : style_(style) {}
  CellsTold(const CellsTold&) = delete;
  CellsTold& operator=(const CellsTold&) = delete;
  ~CellsTold() {
    if (style_.terminal && told_) streams::tell("\r\x1b[K");
  }
  void operator()(std::size_t done, std::size_t all) {
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < (style_.terminal ? std::chrono::milliseconds(100) : std::chrono::milliseconds(1000))) return;
    last_ = now;
    told_ = true;
    const std::string text = fmt::format("cell {} of {}", done, all);
    streams::tell(style_.terminal ? "\r\x1b[K  " + text : text + "\n");
  }

 private:
  TextStyle style_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  bool told_ = false;
};

// As much of the table as somebody would read on a terminal.
std::string shown_table(const Collected& collected) {
  constexpr std::size_t kMostLines = 60;
  std::istringstream lines(collected.table);
  std::string table;
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count)
    if (count < kMostLines) table += line.empty() ? "\n" : "  " + line + "\n";
  if (count > kMostLines)
    table += fmt::format("  ... and {}, see {}\n", counted(count - kMostLines, "line"), (collected.summary.output / "table.md").string());
  return table;
}

}  // namespace

Exit show_study(const Collected& collected, const Show& show) {
  Summary told = collected.summary;
  told.protocols.clear();  // the table has them
  const std::string table = shown_table(collected);
  show("\n" + table + render(told, style_of(STDOUT_FILENO)) + (collected.page.empty() ? "" : fmt::format("  {}\n", collected.page)),
       to_json(collected.summary));
  return collected.summary.exit;
}

void StudyCommand::add_options(CLI::App& app) {
  app.add_option("--set", sets_,
                 "Another value for a key of the file, as dt=0.1 or agents.protocol.Q=2; of several, as links.loss=0,0.1,0.2 or "
                 "dt='linspace(0.1, 1, 4)' or 'logspace(...)', each is a cell of a study. May be given several times: each with each.")
      ->type_name("KEY=VALUES")
      ->allow_extra_args(false);
  app.add_flag("--zip", zipped_, "The keys that are set take their values together: first with first, second with second.");
  app.add_option_function<std::string>(
         "--jobs", [this](const std::string& text) { jobs_ = whole_option<std::size_t>("--jobs", text, 1, 10'000); },
         "Cells of a study at once. Default: simulate: one per core; else 1, as processes that keep time disturb each other.")
      ->type_name("N");
  app.add_option("--resume", folder_, "Instead of FILE: the folder of a study, of which the cells are run that are not done.")
      ->type_name("DIR");
  app.add_flag("--plan", plan_only_, "Of a study, write the plan (plan.json) and run nothing.");
  app.add_option_function<std::string>(
         "--cell", [this](const std::string& text) { cell_ = whole_option<std::size_t>("--cell", text, 1, kMostCells); },
         "With --resume: run this cell alone, as plan.json numbers them; `consort collect DIR` makes the table.")
      ->type_name("I");
  app.add_flag("--keep-going", keep_going_, "A cell that fails ends no other (default).");
  app.add_flag("--fail-fast", fail_fast_, "Once a cell has failed, no further one begins.");
  app.add_flag("--full-cells", full_, "Each cell of a study leaves all that a run leaves, in cells/; else their table is all.");
}

bool StudyCommand::is_study(const std::string& text, const std::string& name, ScriptOverrides& overrides) const {
  Study study = study_of(text, name, sets_, zipped_);
  const bool asked = jobs_ || plan_only_ || full_ || fail_fast_ || keep_going_;
  if (study.cells.empty() && asked)
    throw ConfigError(
        fmt::format("{}: found no sweep, and --set with one value at most; allowed: --jobs, --plan, --full-cells, --fail-fast "
                    "and --keep-going with a study",
                    name));
  if (study.within_a_run && !asked) {
    overrides.settings = std::move(study.fixed);
    return false;
  }
  return true;
}

std::filesystem::path StudyCommand::begin(const StudySetting& setting, const std::string& text) const {
  StudyAsked asked{std::filesystem::absolute(setting.file).parent_path(), sets_, zipped_, full_, setting.force, setting.overrides};
  const StudyPlan plan = make_plan(text, setting.file.string(), asked);
  std::filesystem::path folder = setting.output;
  if (folder.empty())
    folder = create_results_folder("results", plan.experiment, std::time(nullptr));
  else
    claim_output_folder(folder);
  begin_study(folder, text, plan, setting.command_line);
  return folder;
}

Exit StudyCommand::run_one(const std::filesystem::path& folder, const Show& show) const {
  const StudyPlan plan = plan_in(folder);
  if (*cell_ > plan.cells.size()) throw ConfigError(fmt::format("--cell: found {}; allowed: 1 to {}", *cell_, plan.cells.size()));
  catch_signals();
  const CellResult result = run_planned_cell(folder, plan, *cell_ - 1);
  const std::string name = fmt::format("cell {} ({})", *cell_, plan.cells[*cell_ - 1].cell.shown());
  if (!result.done()) {
    const std::string error = name + ": " + result.error;
    switch (result.exit) {
      case Exit::bad_input:
        throw ConfigError(error);
      case Exit::timed_out:
        throw TimeoutError(error);
      case Exit::interrupted:
      case Exit::terminated:
        return result.exit;
      default:
        throw RunError(error);
    }
  }
  show(fmt::format("  {}: done\n  {}\n", name, cell_folder(folder, *cell_ - 1).string()), to_json(result).dump(2) + "\n");
  return Exit::ok;
}

Exit StudyCommand::execute(const StudySetting& setting, const std::string& text, const Show& show) const {
  if (keep_going_ && fail_fast_) throw ConfigError("--fail-fast: found --keep-going, too; allowed: one of them");
  if (cell_ && !resumes()) throw ConfigError("--cell: found no --resume; allowed: both, of a folder that --plan has made");
  if (resumes() && (!sets_.empty() || zipped_ || full_ || !setting.output.empty()))
    throw ConfigError("--resume: found --set, --zip, --full-cells or --output; allowed: what the study was begun with stands in its plan");
  if (cell_) return run_one(folder_, show);
  const std::filesystem::path folder = resumes() ? folder_ : begin(setting, text);
  const StudyPlan plan = resumes() ? resumed_plan(folder) : plan_in(folder);
  if (plan_only_) {
    show(fmt::format("  {}\n  {}\n", counted(plan.cells.size(), "cell"), folder.string()), to_json(plan).dump(2) + "\n");
    return Exit::ok;
  }
  catch_signals();
  StudyOptions options{jobs_, fail_fast_, setting.no_report, {}};
  {
    const auto told = setting.quiet ? nullptr : std::make_shared<CellsTold>(style_of(STDERR_FILENO));
    if (told) options.tell = [told](std::size_t done, std::size_t all) { (*told)(done, all); };
    run_study(folder, plan, options);
    options.tell = {};
  }
  return show_study(collect_study(folder, setting.no_report, caught_signal().load()), show);
}

}  // namespace consort
