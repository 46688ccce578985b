#include "orchestrator/script/measures.hpp"

#include "core/errors.hpp"
#include "orchestrator/script/criteria.hpp"
#include "orchestrator/script/trial.hpp"
#include "protocols/metrics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace consort::script {
namespace {

std::vector<std::string> texts(Mistakes& mistakes, const Section& top, const std::string& key) {
  const auto node = top.find(key);
  if (!present(node)) return {};
  std::vector<std::string> read;
  if (!node.IsSequence()) {
    mistakes.add(node, fmt::format("{}: found {}; allowed: a list of texts, in brackets or each behind '- ' in a line of its own", key,
                                   describe(node)));
    return read;
  }
  for (std::size_t i = 0; i < node.size(); ++i)
    if (auto text = read_text(mistakes, node[i], fmt::format("{}[{}]", key, i))) read.push_back(std::move(*text));
  return read;
}

void check_metrics(Mistakes& mistakes, const Section& top) {
  std::vector<std::string> names;
  for (const auto& entry : metric_table()) names.emplace_back(entry.name);
  const auto node = top.find("metrics");
  if (!present(node) || !node.IsSequence()) return;
  for (std::size_t i = 0; i < node.size(); ++i)
    if (node[i].IsScalar() && !node[i].Scalar().empty()) read_choice(mistakes, node[i], fmt::format("metrics[{}]", i), names);
}

// The line of the table that gives `name`: error.2.mode1 comes with error, nees_low with nees.
std::string metric_behind(const std::string& name) {
  std::string_view longest;
  for (const auto& entry : metric_table()) {
    const bool whole = name.size() == entry.name.size() ||
                       std::string_view(".[_").find(name[std::min(entry.name.size(), name.size() - 1)]) != std::string_view::npos;
    if (name.starts_with(entry.name) && whole && entry.name.size() > longest.size()) longest = entry.name;
  }
  return std::string(longest);
}

// The protocol (and the sweep's value) that a metric is of.
std::string title_before(const Experiment& out, const std::string& metric) {
  std::string longest;
  for (const ProtocolChoice& choice : out.protocols)
    if (metric.starts_with(choice.title() + ".") && choice.title().size() > longest.size()) longest = choice.title();
  return longest;
}

void add_metrics_of(const std::string& criterion, Experiment& out) {
  if (out.metrics.empty()) return;  // all of them anyway
  for (std::string name : metrics_of(criterion)) {
    if (out.protocols.size() > 1) name.erase(0, title_before(out, name).size() + 1);
    name = metric_behind(name);
    if (std::find(out.metrics.begin(), out.metrics.end(), name) == out.metrics.end()) out.metrics.push_back(name);
  }
}

// Of a cell: `name` may be of it, of another one, or of every cell.
void take_metric(const std::string& name, Experiment& out) {
  if (out.metrics.empty()) return;  // all of them anyway
  std::string before = title_before(out, name);
  for (const ProtocolChoice& choice : out.protocols)
    if (before.empty() && name.starts_with(choice.name + ".")) before = choice.name;
  const std::string metric = metric_behind(before.empty() ? name : name.substr(before.size() + 1));
  const bool known = std::find(out.metrics.begin(), out.metrics.end(), metric) != out.metrics.end();
  if (!metric.empty() && !known) out.metrics.push_back(metric);
}

}  // namespace

void read_measures(Mistakes& mistakes, const Section& top, Experiment& experiment) {
  experiment.metrics = texts(mistakes, top, "metrics");
  experiment.criteria = texts(mistakes, top, "criteria");
  check_metrics(mistakes, top);
}

void check_criteria(Mistakes& mistakes, const Section& top, Experiment& out) {
  if (out.criteria.empty()) return;
  const auto names = metric_names(out);
  std::vector<std::string> with_runs;  // what a single run does not have
  const YAML::Node list = top.find("criteria");
  for (std::size_t i = 0; i < out.criteria.size(); ++i) {
    try {
      const auto is_known = [&](const std::string& name) { return std::find(names.begin(), names.end(), name) != names.end(); };
      const auto used = metrics_of(out.criteria[i]);
      if (out.runs == 1 && with_runs.empty() && !std::all_of(used.begin(), used.end(), is_known)) {
        out.runs = 2;
        with_runs = metric_names(out);
        out.runs = 1;
      }
      check_criterion(out.criteria[i], names, with_runs);
      add_metrics_of(out.criteria[i], out);
    } catch (const ConfigError& error) {
      mistakes.add(list[i], fmt::format("criteria[{}]: {}", i, error.what()));
    }
  }
}

void take_metrics_of_criteria(Experiment& experiment) {
  for (const std::string& criterion : std::exchange(experiment.criteria, {})) {
    std::vector<std::string> names;
    try {
      names = metrics_of(criterion);
    } catch (const ConfigError&) {  // said of the study as a whole
    }
    for (const std::string& name : names) take_metric(name, experiment);
  }
}

}  // namespace consort::script
