#include "orchestrator/cli/study.hpp"

#include "core/build.hpp"
#include "core/errors.hpp"
#include "orchestrator/cli/cell.hpp"
#include "orchestrator/cli/child_runs.hpp"
#include "orchestrator/cli/signals.hpp"
#include "orchestrator/cli/threads.hpp"
#include "orchestrator/report/cell_store.hpp"
#include "orchestrator/report/page.hpp"
#include "orchestrator/report/study_record.hpp"
#include "orchestrator/report/study_table.hpp"
#include "orchestrator/run/host.hpp"
#include "orchestrator/script/study_criteria.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <thread>

namespace consort {
namespace {

constexpr auto kReplace = nlohmann::ordered_json::error_handler_t::replace;

std::size_t cores() { return std::max(1u, std::thread::hardware_concurrency()); }

// A study's file, read for one cell after the other.
class CellReader {
 public:
  CellReader(std::string text, std::string name, const StudyAsked& asked)
      : text_(std::move(text)), name_(std::move(name)), directory_(asked.directory), overrides_(asked.overrides) {}

  Experiment operator()(std::size_t number, const Cell& cell, std::vector<Host>* hosts = nullptr) const {
    ScriptOverrides overrides = overrides_;
    overrides.cell = cell;
    try {
      return parse_experiment(text_, name_, directory_, overrides, hosts);
    } catch (const ConfigError& error) {
      throw ConfigError(fmt::format("cell {} ({}): {}", number + 1, cell.shown(), error.what()));
    }
  }

 private:
  std::string text_, name_;
  std::filesystem::path directory_;
  ScriptOverrides overrides_;
};

CellReader reader_in(const std::filesystem::path& folder, const StudyPlan& plan) {
  const auto file = folder / "experiment.yaml";
  return {experiment_text(file), file.string(), plan.asked};
}

// Nobody else runs a study's cells while this is there (but for those who run one by its number).
class Claim {
 public:
  explicit Claim(const std::filesystem::path& folder) : folder_(::open(folder.c_str(), O_RDONLY | O_CLOEXEC)) {
    if (folder_ < 0 || ::flock(folder_, LOCK_EX | LOCK_NB) == 0) return;
    ::close(folder_);
    throw ConfigError(fmt::format("{}: somebody else is running this study; allowed: when that has ended", folder.string()));
  }
  ~Claim() {
    if (folder_ >= 0) ::close(folder_);
  }
  Claim(const Claim&) = delete;
  Claim& operator=(const Claim&) = delete;

 private:
  int folder_;
};

// Of more cells nobody would look at them.
bool has_curves(const StudyPlan& plan) {
  constexpr std::size_t kMostWithCurves = 100;
  return plan.cells.size() <= kMostWithCurves;
}

RunOptions run_options(const StudyPlan& plan, std::vector<Host> hosts) {
  RunOptions options;
  options.run_name = random_run_name(plan.experiment);
  options.key = run_key();
  options.agent_executable = program_folder() / "consort-agent";
  options.hosts = std::move(hosts);
  options.interrupt = &caught_signal();
  return options;
}

// Counts what has ended, and says whether to go on.
class Tally {
 public:
  Tally(const StudyPlan& plan, std::size_t done, const StudyOptions& options) : options_(options), all_(plan.cells.size()), done_(done) {}
  void ended(bool well) {
    if (!well) failed_ = true;
    const std::lock_guard lock(mutex_);
    ++done_;
    if (options_.tell) options_.tell(done_, all_);
  }
  [[nodiscard]] bool go_on() const { return caught_signal().load() == 0 && !(failed_ && options_.fail_fast); }

 private:
  const StudyOptions& options_;
  std::mutex mutex_;
  std::size_t all_, done_;
  std::atomic<bool> failed_ = false;
};

// In this process, a cell a thread; where cells are few, each on several.
void simulate_cells(const std::filesystem::path& folder, const StudyPlan& plan, const std::vector<std::size_t>& remaining, CellStore& store,
                    const StudyOptions& options, Tally& tally) {
  const CellReader read = reader_in(folder, plan);
  const std::size_t jobs = options.jobs.value_or(cores()), at_once = std::min(jobs, remaining.size());
  CellOptions of_cell{run_options(plan, {}), {}, plan.asked.full, has_curves(plan), plan.asked.force};
  of_cell.run.threads = std::max<std::size_t>(1, jobs / at_once);
  on_threads(at_once, remaining.size(), [&](std::size_t i) {
    if (!tally.go_on()) return;
    const std::size_t cell = remaining[i];
    CellOptions own = of_cell;
    if (own.full) own.folder = cell_folder(folder, cell);
    const CellResult result = run_cell(read(cell, plan.cells[cell].cell), own);
    if (caught_signal().load() != 0) return;  // it may not have come to its end
    if (!own.full) store.keep(cell, result);
    tally.ended(result.done());
  });
}

// Each in a process of its own, which starts those of its agents.
void run_cells_as_children(const std::filesystem::path& folder, const std::vector<std::size_t>& remaining, const StudyOptions& options,
                           Tally& tally) {
  std::vector<std::vector<std::string>> commands;
  for (const std::size_t cell : remaining)
    commands.push_back({"run", "--resume", folder.string(), "--cell", std::to_string(cell + 1), "--quiet"});
  const int signal = run_children(commands, {options.jobs.value_or(1), true, [&] { return tally.go_on(); }},
                                  [&](std::size_t, const ChildAnswer& answer) { tally.ended(answer.exit == 0); });
  if (signal != 0) ::raise(signal);  // as if it had come while nobody waited for it
}

}  // namespace

StudyPlan make_plan(const std::string& text, const std::string& name, const StudyAsked& asked) {
  StudyPlan plan;
  plan.asked = asked;
  const Study study = study_of(text, name, asked.sets, asked.zipped);
  plan.asked.overrides.settings = study.fixed;
  plan.program = version_text("consort");
  plan.keys = study.keys;
  plan.criteria = study.criteria;
  plan.cells.resize(study.cells.size());
  const CellReader read(text, name, plan.asked);
  on_threads(cores(), study.cells.size(), [&](std::size_t i) {
    const Experiment experiment = read(i, study.cells[i]);
    plan.cells[i] = planned(study.cells[i], experiment);
    if (i > 0) return;
    plan.experiment = experiment.name;
    plan.description = experiment.description;
    plan.mode = experiment.mode;
    plan.dt = experiment.dt;
    plan.metrics = experiment.metrics;
  });
  CellTitles titles;
  for (std::size_t i = 0; i < plan.cells.size(); ++i)
    for (const std::string& title : plan.cells[i].protocols) titles.emplace(title, i);
  check_study_criteria(study, name, titles, [&](std::size_t i) { return read(i, study.cells[i]); });
  return plan;
}

void begin_study(const std::filesystem::path& folder, const std::string& text, const StudyPlan& plan,
                 const std::vector<std::string>& command_line) {
  write_file(folder / "experiment.yaml", text);
  const Experiment first = CellReader(text, "experiment.yaml", plan.asked)(0, plan.cells.front().cell);
  write_file(folder / "host.json", host_facts(first, command_line).dump(2, ' ', false, kReplace) + "\n");
  write_file(folder / "plan.json", to_json(plan).dump(1, ' ', false, kReplace) + "\n");
}

StudyPlan resumed_plan(const std::filesystem::path& folder) {
  const StudyPlan before = plan_in(folder);
  const auto file = folder / "experiment.yaml";
  StudyPlan plan = make_plan(experiment_text(file), file.string(), before.asked);
  if (const auto now = to_json(plan); now != to_json(before)) write_file(folder / "plan.json", now.dump(1, ' ', false, kReplace) + "\n");
  return plan;
}

void run_study(const std::filesystem::path& folder, const StudyPlan& plan, const StudyOptions& options) {
  const Claim claim(folder);
  CellStore store(folder);
  const auto results = store.results(plan);
  std::vector<std::size_t> remaining;
  for (std::size_t i = 0; i < results.size(); ++i)
    if (!results[i] || !results[i]->done()) remaining.push_back(i);
  if (remaining.empty()) return;
  Tally tally(plan, results.size() - remaining.size(), options);
  if (plan.mode == Mode::simulate)
    simulate_cells(folder, plan, remaining, store, options, tally);
  else
    run_cells_as_children(folder, remaining, options, tally);
}

CellResult run_planned_cell(const std::filesystem::path& folder, const StudyPlan& plan, std::size_t cell) {
  const PlannedCell& planned = plan.cells.at(cell);
  const auto own = cell_folder(folder, cell);
  if (auto done = result_in(own, planned.hash); done && done->done()) return *done;
  std::vector<Host> hosts;
  const Experiment experiment = reader_in(folder, plan)(cell, planned.cell, &hosts);
  if (cell_hash(experiment) != planned.hash)
    throw ConfigError(
        fmt::format("cell {}: is not what was planned, as this program or a file that the experiment names is another; allowed: after "
                    "`consort run --resume {} --plan`",
                    cell + 1, folder.string()));
  return run_cell(experiment, {run_options(plan, std::move(hosts)), own, plan.asked.full, has_curves(plan), plan.asked.force});
}

Collected collect_study(const std::filesystem::path& folder, bool no_report, int signal) {
  const StudyPlan plan = plan_in(folder);
  CellStore store(folder);
  const auto results = store.results(plan);
  const StudyTable table = table_of(plan, results);
  Collected out{summary_of(plan, table, folder, signal), table_markdown(plan, table), {}};
  write_study_record(store, plan, results, out.summary, experiment_text(folder / "experiment.yaml"));
  write_file(folder / "table.csv", table_csv(plan, table));
  write_file(folder / "table.tex", table_tex(plan, table));
  write_file(folder / "table.md", out.table);
  write_file(folder / "summary.json", to_json(out.summary));
  if (!no_report) {
    out.page = (folder / "report.html").string();
    write_file(out.page, page_of({folder}));
  }
  return out;
}

}  // namespace consort
