#include "core/metrics/metrics.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace consort {
namespace {

/// Two agents, two reports; each number of `recorded` is that of one agent in one report, report after report.
Trace trace_of(const Layout& recorded, const std::vector<double>& numbers) {
  Trace trace;
  trace.agents = 2;
  trace.dimension = 1;
  trace.estimate_layout = {{{"x", 1, 1}}};
  trace.recorded_layout = recorded;
  trace.recorded_dimension = recorded.size();
  const std::vector<double> estimates{1.0, 2.0};
  const std::vector<std::uint64_t> hashes(2);
  const std::vector<AgentCounters> counters(2);
  const std::size_t width = 2 * recorded.size();
  for (Round k = 0; k < 2; ++k) trace.add({k, estimates, hashes, counters, {}, {}, std::span(numbers).subspan(k * width, width)});
  return trace;
}

Metrics metrics_of(const Trace& trace, std::string_view name) {
  Experiment experiment;
  experiment.agents = 2;
  Metrics out;
  for (const MetricEntry& entry : run_metrics())
    if (entry.name == name) entry.compute(experiment, Seed{1}, {"any", {}}, trace, out);
  return out;
}

TEST(StateMetrics, TraceOfTheCovarianceIsTheMeanOverTheAgentsThatAreThere) {
  const Layout P{{{"P", 2, 2}}};
  const std::vector<double> before(8, 9.0);
  std::vector<double> numbers = before;
  numbers.insert(numbers.end(), {1.0, 0.5, 0.5, 2.0, 3.0, 0.0, 0.0, 4.0});
  EXPECT_EQ(metrics_of(trace_of(P, numbers), "P_trace").at("P_trace"), 5.0);
  std::fill(numbers.end() - 4, numbers.end(), kAbsent);
  EXPECT_EQ(metrics_of(trace_of(P, numbers), "P_trace").at("P_trace"), 3.0);
}

TEST(StateMetrics, InformationIsInverted) {
  const Layout Y{{{"Y", 1, 1}}};
  EXPECT_EQ(metrics_of(trace_of(Y, {1.0, 1.0, 4.0, 16.0}), "P_trace").at("P_trace"), 0.15625);
  EXPECT_TRUE(std::isnan(metrics_of(trace_of(Y, {1.0, 1.0, 0.0, 2.0}), "P_trace").at("P_trace")));
}

TEST(StateMetrics, ControlIsMeasuredFromTheRoundAfterTheFirstOn) {
  const Layout u{{{"u", 2, 1}}};
  const Metrics metrics = metrics_of(trace_of(u, {100.0, 100.0, 100.0, 100.0, 3.0, -4.0, 0.0, 0.0}), "control_peak");
  EXPECT_EQ(metrics.at("control_peak"), 4.0);
  EXPECT_EQ(metrics.at("control_rms"), std::sqrt(12.5));
}

TEST(StateMetrics, ShorterControlsCountAsFarAsTheyGo) {
  const Metrics metrics = metrics_of(trace_of({{{"u", 2, 1}}}, {0.0, 0.0, 0.0, 0.0, 3.0, 4.0, 1.0, kAbsent}), "control_rms");
  EXPECT_EQ(metrics.at("control_rms"), std::sqrt(13.0));
  EXPECT_EQ(metrics.at("control_peak"), 4.0);
}

TEST(StateMetrics, SayNothingOfWhatIsNotRecorded) { EXPECT_TRUE(metrics_of(trace_of({}, {}), {"P_trace", "control_peak"}).empty()); }

}  // namespace
}  // namespace consort
