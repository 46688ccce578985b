#pragma once
/// Asks the entry of one protocol, which need not be in the table, what it knows.

#include "protocols/registry_entry.hpp"
#include "protocols/theory_case.hpp"

#include <memory>
#include <vector>

namespace consort::direct {

inline Experiment experiment_of(const ProtocolEntry& entry, std::size_t agents) {
  Experiment e;
  e.agents = agents;
  e.protocols = {{std::string(entry.name), {}}};
  return e;
}

/// What its theory says of agents on one graph throughout.
inline std::vector<Finding> findings(const ProtocolEntry& entry, const Graph& graph) {
  Experiment e = experiment_of(entry, graph.agents());
  e.topology = FixedSchedule{{{std::make_shared<const Graph>(graph), 1}}, false};
  Effort effort = Effort::of_validate();
  const Survey surveyed = survey(e, effort.graph_work());
  Spectra spectra(effort);
  std::vector<Finding> all;
  Findings out(e.protocols[0].name, all);
  entry.examine({e, e.protocols[0], entry, surveyed, spectra, effort}, out);
  return all;
}

/// Its own metrics of a run from `first` to `last`, a number of each agent.
inline Metrics metrics(const ProtocolEntry& entry, const std::vector<double>& first, const std::vector<double>& last) {
  const Experiment e = experiment_of(entry, first.size());
  Trace trace;
  trace.agents = first.size();
  trace.dimension = 1;
  trace.estimate_layout = {{{"x", 1, 1}}};
  const std::vector<std::uint64_t> hashes(first.size());
  const std::vector<AgentCounters> counters(first.size());
  trace.add({0, first, hashes, counters});
  trace.add({1, last, hashes, counters});
  Metrics out;
  for (const MetricEntry& metric : entry.metrics) metric.compute(e, e.seed, e.protocols[0], trace, out);
  return out;
}

}  // namespace consort::direct
