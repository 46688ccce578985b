#include "orchestrator/report/study_table.hpp"

#include "core/counted.hpp"
#include "orchestrator/script/criteria.hpp"
#include "orchestrator/script/study_criteria.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <limits>

namespace consort {
namespace {

ProtocolResult result_of(const std::string& title, const CellResult& cell) {
  ProtocolResult out;
  out.name = title;
  for (const CellRun& run : cell.runs) {
    if (run.protocol != title) continue;
    out.fewest_rounds = out.runs == 0 ? run.rounds : std::min(out.fewest_rounds, run.rounds);
    out.most_rounds = std::max(out.most_rounds, run.rounds);
    out.rounds += run.rounds;
    out.converged += run.converged ? 1 : 0;
    out.totals += run.totals;
    out.seconds += run.seconds;
    ++out.runs;
    out.per_run.push_back({run.seed, run.metrics, run.diverged});
  }
  summarise(out);
  return out;
}

std::map<std::string, Spread> spreads_of(const ProtocolResult& result) {
  std::map<std::string, Spread> out;
  for (const auto& [name, mean] : result.mean) {
    std::vector<double> values;
    for (const RunMetrics& run : result.per_run)
      if (const auto found = run.metrics.find(name); found != run.metrics.end() && !std::isnan(found->second))
        values.push_back(found->second);
    out[name] = spread_of(values);
  }
  return out;
}

std::vector<std::string> shown_metrics(const StudyPlan& plan, const StudyTable& table) {
  static const std::vector<std::string> usual{"bias", "disagreement", "error", "rounds_to_convergence"};
  std::vector<std::string> shown;
  for (const std::string& name : plan.metrics.empty() ? usual : plan.metrics) {
    const auto has = [&](const StudyRow& row) { return row.spreads.contains(name); };
    if (std::any_of(table.rows.begin(), table.rows.end(), has)) shown.push_back(name);
  }
  return shown;
}

// A cell's metrics as a run of it alone would call them.
Metrics metrics_of_cell(const StudyPlan& plan, const StudyTable& table, std::size_t cell) {
  Metrics out;
  for (const StudyRow& row : table.rows) {
    if (row.cell != cell) continue;
    const std::string prefix = plan.cells[cell].protocols.size() > 1 ? row.protocol + "." : "";
    for (const auto& [name, value] : row.result.mean) {
      out[prefix + name] = value;
      if (plan.cells[cell].runs == 1) continue;
      out[prefix + name + ".std"] = row.result.deviation.at(name);
      out[prefix + name + ".share"] = row.result.share.at(name);
    }
  }
  return out;
}

// Met where every cell meets it; else as the first that does not.
CriterionResult judge_in_cells(const std::string& criterion, const StudyPlan& plan, const StudyTable& table) {
  std::optional<CriterionResult> first;
  for (std::size_t i = 0; i < plan.cells.size(); ++i) {
    const Metrics metrics = metrics_of_cell(plan, table, i);
    if (metrics.empty()) continue;  // it has not come to its end
    CriterionResult result = judge(std::span(&criterion, 1), metrics).front();
    if (first && result.met) continue;
    Metrics named;
    for (const auto& [name, value] : result.metrics) named[plan.cells[i].cell.label() + ": " + name] = value;
    result.metrics = std::move(named);
    const bool last = !result.met;
    first = std::move(result);
    if (last) break;
  }
  return first.value_or(CriterionResult{criterion, false, std::numeric_limits<double>::quiet_NaN(), "not a number"});
}

// Of a study that did not come to its end, some metrics are not known.
std::vector<CriterionResult> judged(const StudyPlan& plan, const StudyTable& table, const Summary& summary) {
  CellTitles titles;
  for (std::size_t i = 0; i < plan.cells.size(); ++i)
    for (const std::string& title : plan.cells[i].protocols) titles.emplace(title, i);
  std::vector<CriterionResult> all;
  for (const auto& criterion : plan.criteria) {
    if (!names_a_cell(criterion.text, titles)) {
      all.push_back(judge_in_cells(criterion.text, plan, table));
      continue;
    }
    const auto names = metrics_of(criterion.text);
    const auto is_there = [&](const std::string& name) { return summary.metrics.contains(name); };
    if (summary.complete || std::all_of(names.begin(), names.end(), is_there))
      all.push_back(judge(std::span(&criterion.text, 1), summary.metrics).front());
  }
  return all;
}

void conclude(const StudyPlan& plan, const StudyTable& table, int signal, Summary& summary) {
  if (table.missing > 0 || !table.failures.empty()) {
    summary.complete = false;
    summary.ending = signal != 0 ? Ending::signal : Ending::failure;
    const std::size_t open = table.missing + table.failures.size();
    summary.incomplete = fmt::format("{} of {} did not come to their end", open, counted(plan.cells.size(), "cell"));
    if (!table.failures.empty()) summary.incomplete += "; " + table.failures.front();
    summary.exit = table.failed == Exit::ok ? Exit::run_failed : table.failed;
    if (signal != 0) summary.exit = signal == SIGINT ? Exit::interrupted : Exit::terminated;
    summary.error = summary.incomplete;
  }
  summary.criteria = judged(plan, table, summary);
  const bool all = std::all_of(summary.criteria.begin(), summary.criteria.end(), [](const auto& criterion) { return criterion.met; });
  if (summary.complete && !all) summary.exit = Exit::criterion_not_met;
}

void add_row(const StudyRow& row, bool several, Summary& summary) {
  const ProtocolResult& result = row.result;
  for (const auto& [name, value] : result.mean) {
    const std::string full = result.name + "." + name;
    summary.metrics[full] = value;
    if (!several) continue;
    summary.metrics[full + ".std"] = result.deviation.at(name);
    summary.metrics[full + ".share"] = result.share.at(name);
  }
  summary.rounds = std::max(summary.rounds, result.most_rounds);
  summary.totals += result.totals;
  summary.protocols.push_back(result);
}

}  // namespace

StudyTable table_of(const StudyPlan& plan, std::span<const std::optional<CellResult>> results) {
  StudyTable table;
  HistoryHash hash;
  for (std::size_t i = 0; i < plan.cells.size(); ++i) {
    const PlannedCell& planned = plan.cells[i];
    if (!results[i]) {
      ++table.missing;
      continue;
    }
    if (!results[i]->done()) {
      if (table.failures.empty()) table.failed = results[i]->exit;
      table.failures.push_back(fmt::format("cell {} ({}): {}", i + 1, planned.cell.shown(), results[i]->error));
      continue;
    }
    for (const CellRun& run : results[i]->runs) hash.mix(run.trace_hash);
    for (const std::string& title : planned.protocols) {
      StudyRow row{
          i, title.substr(0, title.size() - std::min(title.size(), planned.cell.label().size() + 1)), result_of(title, *results[i]), {}};
      row.spreads = spreads_of(row.result);
      for (const CellCurve& curve : results[i]->curves)
        if (curve.protocol == title) row.curve = curve;
      table.rows.push_back(std::move(row));
    }
  }
  table.metrics = shown_metrics(plan, table);
  if (!table.rows.empty()) table.trace_hash = hash.value();
  return table;
}

Summary summary_of(const StudyPlan& plan, const StudyTable& table, const std::filesystem::path& folder, int signal) {
  Summary summary;
  summary.experiment = plan.experiment;
  summary.output = folder;
  summary.mode = plan.mode;
  const PlannedCell& first = plan.cells.at(0);
  summary.seed = first.seed;
  summary.agents = first.agents;
  summary.runs = first.runs;
  double seconds = 0.0;
  std::uint64_t rounds = 0;
  for (const StudyRow& row : table.rows) {
    add_row(row, plan.cells[row.cell].runs > 1, summary);
    seconds += row.result.seconds;
    rounds += row.result.rounds;
  }
  summary.rounds_per_second = seconds > 0.0 ? static_cast<double>(rounds) / seconds : 0.0;
  summary.trace_hash = table.trace_hash;
  conclude(plan, table, signal, summary);
  return summary;
}

std::string text_of(const Setting& setting) {
  const std::string last = setting.key.substr(setting.key.rfind('.') + 1);
  constexpr std::size_t kLong = 20;
  return setting.label.starts_with(last + "_") && setting.value.size() <= kLong ? setting.value : setting.label;
}

}  // namespace consort
