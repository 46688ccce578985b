#include "orchestrator/script/study_criteria.hpp"

#include "core/errors.hpp"
#include "orchestrator/script/criteria.hpp"
#include "orchestrator/script/trial.hpp"
#include "orchestrator/script/wording.hpp"
#include "orchestrator/script/yaml.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace consort {
namespace {

using Cells = CellTitles;

// The longest name of a protocol and cell that `metric` begins with.
Cells::const_iterator cell_of(const Cells& cells, const std::string& metric) {
  for (std::size_t dot = metric.rfind('.'); dot != std::string::npos && dot > 0; dot = metric.rfind('.', dot - 1))
    if (const auto found = cells.find(metric.substr(0, dot)); found != cells.end()) return found;
  return cells.end();
}

std::vector<std::string> names_in(Experiment experiment, std::size_t runs) {
  experiment.runs = runs;
  auto names = script::metric_names(experiment);
  if (experiment.protocols.size() == 1)
    for (std::string& name : names) name.insert(0, experiment.protocols.front().title() + ".");
  return names;
}

// What is no metric of any cell may have been meant to be one of a certain cell.
void check_alone(const std::string& text, std::span<const std::string> known, std::span<const std::string> with_runs, const Cells& cells) {
  try {
    check_criterion(text, known, with_runs);
  } catch (const ConfigError& error) {
    throw ConfigError(fmt::format("{}; or of a cell, behind its name: {}.<metric>", error.what(), cells.begin()->first));
  }
}

// As a run of one cell would call them.
std::vector<std::string> names_alone(Experiment experiment, std::size_t runs) {
  experiment.runs = runs;
  for (ProtocolChoice& choice : experiment.protocols) choice.variant.reset();
  return script::metric_names(experiment);
}

void check(const std::string& text, const Cells& cells, const std::function<Experiment(std::size_t)>& read) {
  if (!names_a_cell(text, cells)) {
    const Experiment first = read(0);
    const auto known = names_alone(first, first.runs);
    const auto used = metrics_of(text);
    const auto is_known = [&](const std::string& name) { return std::find(known.begin(), known.end(), name) != known.end(); };
    if (first.runs > 1 || std::all_of(used.begin(), used.end(), is_known)) return check_alone(text, known, {}, cells);
    return check_alone(text, known, names_alone(first, 2), cells);
  }
  std::set<std::size_t> named;
  for (const std::string& metric : metrics_of(text)) {
    const auto found = cell_of(cells, metric);
    if (found != cells.end()) {
      named.insert(found->second);
      continue;
    }
    std::vector<std::string> titles;
    for (const auto& [title, cell] : cells) titles.push_back(title);
    const std::string meant = did_you_mean(metric, titles);
    constexpr std::size_t kTold = 20;
    if (titles.size() > kTold) titles.resize(kTold);
    throw ConfigError(fmt::format("found '{}', which is of no cell; allowed: metrics behind the name of a cell and a dot: {}{}{}",
                                  script::shown(metric), listed(titles), cells.size() > kTold ? ", ..." : "", meant));
  }
  std::vector<std::string> known, with_runs;
  for (const std::size_t cell : named) {
    const Experiment experiment = read(cell);
    for (std::string& name : names_in(experiment, experiment.runs)) known.push_back(std::move(name));
    for (std::string& name : names_in(experiment, 2)) with_runs.push_back(std::move(name));
  }
  check_criterion(text, known, with_runs);
}

}  // namespace

bool names_a_cell(const std::string& criterion, const CellTitles& cells) {
  const auto names = metrics_of(criterion);
  return std::any_of(names.begin(), names.end(), [&](const std::string& name) { return cell_of(cells, name) != cells.end(); });
}

void check_study_criteria(const Study& study, const std::string& file, const Cells& cells,
                          const std::function<Experiment(std::size_t)>& read) {
  script::Mistakes mistakes(file);
  for (std::size_t i = 0; i < study.criteria.size(); ++i) {
    const Study::Judged& criterion = study.criteria[i];
    try {
      check(criterion.text, cells, read);
    } catch (const ConfigError& error) {
      mistakes.add(file, static_cast<std::size_t>(criterion.line) + 1, static_cast<std::size_t>(criterion.column) + 1,
                   fmt::format("criteria[{}]: {}", i, error.what()));
    }
  }
  mistakes.raise();
}

}  // namespace consort
