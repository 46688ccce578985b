#include "protocols/metrics.hpp"

#include "core/errors.hpp"
#include "core/nearest.hpp"
#include "protocols/registry.hpp"

#include <algorithm>
#include <limits>

namespace consort {
namespace {

const MetricEntry* find(std::span<const MetricEntry> entries, std::string_view name) {
  const auto it = std::find_if(entries.begin(), entries.end(), [name](const MetricEntry& entry) { return entry.name == name; });
  return it == entries.end() ? nullptr : &*it;
}

// Those of a run with this protocol: its own, and those of any run where it has none of that name.
std::vector<MetricEntry> metrics_of(const ProtocolChoice& choice) {
  const auto own = find_protocol(choice.name).metrics;
  std::vector<MetricEntry> all(own.begin(), own.end());
  for (const MetricEntry& entry : run_metrics())
    if (find(own, entry.name) == nullptr) all.push_back(entry);
  return all;
}

bool anybody_in(const Trace& trace, std::size_t report) {
  const std::size_t width = trace.agents * trace.agreed_dimension();
  const auto values = trace.agreed_at(report);
  return width == 0 || std::any_of(values.begin(), values.end(), [](double value) { return !is_absent(value); });
}

// What is measured of agents is no number where nobody is left.
Metrics metrics_of_nobody(const Experiment& experiment, Seed run_seed, const ProtocolChoice& choice, const Trace& trace) {
  Trace before = trace;  // as long as somebody was there: what is reported later is not looked at
  while (!before.rounds.empty() && !anybody_in(before, before.rounds.size() - 1)) before.rounds.pop_back();
  Metrics out;
  if (!before.rounds.empty()) out = compute_metrics(experiment, run_seed, choice, before);
  for (auto& [name, value] : out) {
    const MetricEntry* entry = find(run_metrics(), name);
    if (entry == nullptr || !entry->of_the_run) value = std::numeric_limits<double>::quiet_NaN();
  }
  return out;
}

}  // namespace

std::span<const MetricEntry> metric_table() {
  static const std::vector<MetricEntry> table = [] {
    const auto run = run_metrics();
    std::vector<MetricEntry> all(run.begin(), run.end());
    for (const ProtocolEntry& protocol : protocol_table())
      for (const MetricEntry& entry : protocol.metrics)
        if (find(all, entry.name) == nullptr) all.push_back(entry);
    return all;
  }();
  return table;
}

namespace {

// What the mathematics behind a metric refuses is no number; the others stand.
void compute(const MetricEntry& entry, const Experiment& experiment, Seed run_seed, const ProtocolChoice& choice, const Trace& trace,
             Metrics& out) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  try {
    entry.compute(experiment, run_seed, choice, trace, out);
  } catch (const ConfigError&) {
    out[std::string(entry.name)] = kNone;
  } catch (const RunError&) {
    out[std::string(entry.name)] = kNone;
  }
}

}  // namespace

Metrics compute_metrics(const Experiment& experiment, Seed run_seed, const ProtocolChoice& choice, const Trace& trace) {
  check(!trace.rounds.empty(), "metrics are computed on a trace with at least one report");
  if (!anybody_in(trace, trace.rounds.size() - 1)) return metrics_of_nobody(experiment, run_seed, choice, trace);
  for (const std::string& name : experiment.metrics) {
    if (find(metric_table(), name) != nullptr) continue;
    std::vector<std::string_view> known;
    for (const MetricEntry& entry : metric_table()) known.push_back(entry.name);
    throw ConfigError(unknown_word("metric", name, known));
  }
  Metrics out;
  const auto& wanted = experiment.metrics;
  for (const MetricEntry& entry : metrics_of(choice))
    if (wanted.empty() || std::find(wanted.begin(), wanted.end(), entry.name) != wanted.end())
      compute(entry, experiment, run_seed, choice, trace, out);
  return out;
}

MetricNames names_of_metrics(const Experiment& experiment, const ProtocolChoice& choice, const Trace& empty) {
  MetricNames out;
  for (const MetricEntry& entry : metrics_of(choice)) entry.names(entry.name, {experiment, choice, empty}, out);
  return out;
}

}  // namespace consort
