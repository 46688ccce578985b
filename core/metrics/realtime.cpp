#include "core/metrics/realtime.hpp"

#include <algorithm>

namespace consort {

void network(const Experiment& experiment, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  if (experiment.mode != Mode::realtime) return;
  NetworkCounters total;
  for (const auto& [edge, counters] : trace.network) {
    total.sent += counters.sent;
    total.lost += counters.lost;
    total.late += counters.late;
    total.duplicated += counters.duplicated;
    total.reordered += counters.reordered;
  }
  out["network_sent"] = static_cast<double>(total.sent);
  out["network_lost"] = static_cast<double>(total.lost);
  out["network_late"] = static_cast<double>(total.late);
  out["network_duplicated"] = static_cast<double>(total.duplicated);
  out["network_reordered"] = static_cast<double>(total.reordered);
}

void timing(const Experiment& experiment, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  if (experiment.mode != Mode::realtime) return;
  const auto sum = [&](auto of) {
    double total = 0.0;
    for (const Performance& process : trace.processes) total += static_cast<double>(of(process));
    return total;
  };
  const auto most = [&](auto of) {
    double largest = 0.0;
    for (const Performance& process : trace.processes) largest = std::max(largest, static_cast<double>(of(process)));
    return largest;
  };
  out["missed_deadlines"] = sum([](const Performance& p) { return p.missed_deadlines; });
  out["missed_inputs"] = sum([](const Performance& p) { return p.missed_inputs; });
  out["jitter_p50"] = most([](const Performance& p) { return p.jitter_p50; });
  out["jitter_p99"] = most([](const Performance& p) { return p.jitter_p99; });
  out["jitter_max"] = most([](const Performance& p) { return p.jitter_max; });
  out["cpu"] = sum([](const Performance& p) { return p.cpu; });
  out["resident_bytes"] = most([](const Performance& p) { return p.resident_bytes; });
  out["dds_deadlines_missed"] = sum([](const Performance& p) { return p.dds_deadlines_missed; });
  out["liveliness_lost"] = sum([](const Performance& p) { return p.liveliness_lost; });
}

void network_names(std::string_view, const PlannedRun& run, MetricNames& out) {
  if (run.experiment.mode == Mode::realtime)
    out.insert({"network_sent", "network_lost", "network_late", "network_duplicated", "network_reordered"});
}

void timing_names(std::string_view, const PlannedRun& run, MetricNames& out) {
  if (run.experiment.mode != Mode::realtime) return;
  out.insert({"missed_deadlines", "missed_inputs", "jitter_p50", "jitter_p99", "jitter_max", "cpu", "resident_bytes",
              "dds_deadlines_missed", "liveliness_lost"});
}

}  // namespace consort
