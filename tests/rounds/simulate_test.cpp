#include "rounds/simulate.hpp"

#include "core/errors.hpp"
#include "core/stop.hpp"
#include "protocols/metrics.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/seeds_data.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace consort {
namespace {

using namespace seeds;

const char* const kProtocols[] = {"local_voting", "kalman_consensus", "unbiased_kalman_consensus", "unbiased_information_consensus"};

/// Everything at once: random topology, loss, delay on one link, noise.
Experiment rough(const std::string& protocol, Round rounds = 60) {
  Experiment e = scalar_experiment(protocol, linspace(5.0, 7.0, 6), linspace(0.8, 1.2, 6),
                                   RandomLinks{std::make_shared<const Graph>(complete(6)), 0.7}, rounds);
  e.dt = 0.1;
  e.links.standard = {0.1, 0, Matrix::Constant(1, 1, 0.01)};
  e.links.overrides[{AgentId{1}, AgentId{2}}] = {0.0, 2, {}};
  return e;
}

Trace run(const Experiment& e, const ReportSink& sink = {}) { return simulate(e, e.protocols[0], e.seed, sink); }

TEST(Simulate, TakesAProtocolThatIsInNoTable) {
  const Experiment e = rough("local_voting");
  ProtocolEntry own = find_protocol("local_voting");
  own.name = "of_ones_own";
  EXPECT_EQ(simulate(e, own, e.protocols[0].parameters, e.seed).hash, run(e).hash);
}

// --- determinism ----------------------------------------------------------------------------------------------------------

TEST(Simulate, IsEndedByWhoWatchesItsAgentsBeingMade) {
  const Experiment e = rough("local_voting");
  int made = 0;
  EXPECT_THROW(simulate(e, e.protocols[0], e.seed, {},
                        [&] {
                          if (++made == 4) throw RunError("enough");
                        }),
               RunError);
  EXPECT_EQ(made, 4);
}

TEST(Simulate, NeedsMemoryAsItsEdgesDo) {
  Experiment e = scalar_experiment("local_voting", linspace(0.0, 1.0, 1000), std::vector<double>(1000, 1.0),
                                   FixedSchedule{{{std::make_shared<const Graph>(ring(1000)), 1}}, false}, 1);
  const AgentMaker maker(e, e.protocols[0], e.seed);
  const auto agent = maker.make(AgentId{1});
  const double sparse = bytes_to_simulate(e, e.protocols[0], *agent);
  EXPECT_LT(sparse, 1000 * 100e3);
  e.topology = RandomPairs{};
  EXPECT_GT(bytes_to_simulate(e, e.protocols[0], *agent), sparse + 999'000 * 40.0);
}

TEST(Simulate, SameSeedSameHashAnotherSeedAnotherHash) {
  for (const char* protocol : kProtocols) {
    SCOPED_TRACE(protocol);
    const Experiment e = rough(protocol);
    EXPECT_EQ(simulate(e, e.protocols[0], Seed{5}).hash, simulate(e, e.protocols[0], Seed{5}).hash);
    EXPECT_EQ(simulate(e, e.protocols[0], Seed{5}).estimates, simulate(e, e.protocols[0], Seed{5}).estimates);
    EXPECT_NE(simulate(e, e.protocols[0], Seed{5}).hash, simulate(e, e.protocols[0], Seed{6}).hash);
  }
}

TEST(Simulate, ReportIntervalChangesNeitherHashNorReportedRounds) {
  for (const char* protocol : kProtocols) {
    SCOPED_TRACE(protocol);
    Experiment e = rough(protocol);
    const Trace every = run(e);
    for (const Round interval : {2u, 7u, 60u, 100u}) {
      SCOPED_TRACE(interval);
      e.report_every = interval;
      const Trace some = run(e);
      EXPECT_EQ(some.hash, every.hash);
      EXPECT_EQ(some.rounds.front(), 0u);
      EXPECT_EQ(some.rounds.back(), e.rounds);
      EXPECT_EQ(some.totals.lost, every.totals.lost);
      for (std::size_t report = 0; report < some.rounds.size(); ++report) {
        EXPECT_TRUE(some.rounds[report] % interval == 0 || some.rounds[report] == e.rounds);
        EXPECT_EQ(scalars_at(some, report), scalars_at(every, some.rounds[report]));
      }
    }
  }
}

TEST(Simulate, HashCoversTheRoundsThatAreNotReported) {
  // Two pairs of rounds swapped: the same final estimates, another history.
  Experiment e = scalar_experiment("local_voting", {0.0, 1.0, 2.0, 4.0}, {1, 1, 1, 1}, always(graph_of(4, {})), 2);
  e.report_every = 2;
  const auto a = graph_of(4, {{1, 2}}), b = graph_of(4, {{3, 4}});
  e.topology = FixedSchedule{{{a, 1}, {b, 1}}, false};
  const Trace one = run(e);
  e.topology = FixedSchedule{{{b, 1}, {a, 1}}, false};
  const Trace other = run(e);
  EXPECT_EQ(one.estimates, other.estimates);
  EXPECT_NE(one.hash, other.hash);
}

// --- reports, ends ----------------------------------------------------------------------------------------------------------

TEST(Simulate, FirstReportHoldsTheInitialEstimates) {
  const Experiment e = rough("kalman_consensus");
  EXPECT_EQ(scalars_at(run(e), 0), linspace(5.0, 7.0, 6));
}

TEST(Simulate, ZeroRoundsLeaveOneReport) {
  const Trace trace = run(rough("local_voting", 0));
  EXPECT_EQ(trace.rounds, std::vector<Round>{0});
  EXPECT_EQ(trace.last_round, 0u);
  EXPECT_EQ(trace.totals.sent, 0u);
}

TEST(Simulate, StopsAtTheReportThatConverges) {
  Experiment e = scalar_experiment("local_voting", {0.0, 1.0}, {1, 1}, always(graph_of(2, {{1, 2}, {2, 1}})), 1000);
  e.dt = 0.25;  // the difference halves each round
  e.convergence = Convergence{1e-3, 3};
  const Trace trace = run(e);
  EXPECT_TRUE(trace.converged);
  EXPECT_EQ(trace.last_round, 12u);  // 2^-10 < 1e-3, and two rounds more
  EXPECT_EQ(compute_metrics(e, e.seed, e.protocols[0], trace).at("rounds_to_convergence"), 10.0);
}

TEST(Simulate, SinkSeesEveryReportAndCanEndTheRun) {
  const Experiment e = rough("local_voting");
  std::vector<Round> seen;
  const Trace trace = run(e, [&](const RoundReport& report) {
    seen.push_back(report.k);
    return report.k < 5;
  });
  EXPECT_EQ(seen, (std::vector<Round>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(trace.rounds, seen);
}

TEST(Simulate, CountsOneMessagePerOutNeighbourAndRound) {
  Experiment e = rough("local_voting", 500);
  e.topology = always(std::make_shared<const Graph>(complete(6)));
  e.links.overrides.clear();
  const AgentCounters totals = run(e).totals;
  EXPECT_EQ(totals.sent, 500u * 30u);
  EXPECT_EQ(totals.delivered + totals.lost, totals.sent);
  const double expected = 0.1 * 500 * 30;
  EXPECT_NEAR(static_cast<double>(totals.lost), expected, 4 * std::sqrt(expected * 0.9));
}

// --- errors -----------------------------------------------------------------------------------------------------------------

TEST(Simulate, NamesAgentRoundAndProtocolWhenAnEstimateOverflows) {
  Experiment e = scalar_experiment("local_voting", {0.0, 1.0}, {1, 1}, always(graph_of(2, {{1, 2}, {2, 1}})), 2000);
  e.dt = 10.0;  // far beyond the stable step
  try {
    run(e);
    FAIL() << "the estimates grow without bound";
  } catch (const RunError& error) {
    const std::string text = error.what();
    for (const char* word : {"local_voting", "agent 1", "round "}) EXPECT_NE(text.find(word), std::string::npos) << text;
  }
}

TEST(Simulate, RefusesAgentsOfDifferentDimension) {
  Experiment e = scalar_experiment("local_voting", {0.0, 1.0}, {1, 1}, always(graph_of(2, {{1, 2}, {2, 1}})), 1);
  e.overrides[AgentId{2}].initial.set("x", Matrix::Ones(2, 1));
  EXPECT_THROW(run(e), ConfigError);
}

TEST(Simulate, RefusesAnUnknownProtocol) {
  const Experiment e = scalar_experiment("local_vote", {0.0}, {1}, always(graph_of(1, {})), 1);
  EXPECT_THROW(run(e), ConfigError);
}

// --- degenerate -------------------------------------------------------------------------------------------------------------

TEST(Degenerate, OneAgentAloneKeepsItsEstimate) {
  for (const char* protocol : kProtocols) {
    SCOPED_TRACE(protocol);
    const Experiment e = scalar_experiment(protocol, {3.5}, {2.0}, always(graph_of(1, {})), 100);
    const Trace trace = run(e);
    for (std::size_t report = 0; report < trace.rounds.size(); ++report) EXPECT_EQ(scalars_at(trace, report), std::vector<double>{3.5});
    const Metrics metrics = compute_metrics(e, e.seed, e.protocols[0], trace);
    EXPECT_EQ(metrics.at("disagreement"), 0.0);
    EXPECT_EQ(metrics.at("rounds_to_convergence"), 0.0);
    EXPECT_EQ(metrics.at("messages_sent"), 0.0);
  }
}

TEST(Degenerate, TotalLossLeavesEverybodyWhereItStarted) {
  for (const char* protocol : kProtocols) {
    SCOPED_TRACE(protocol);
    Experiment e = scalar_experiment(protocol, {1.0, 2.0, 4.0}, {1, 1, 1}, always(std::make_shared<const Graph>(complete(3))), 50);
    e.links.standard.loss_probability = 1.0;
    const Trace trace = run(e);
    EXPECT_EQ(finals(trace), (std::vector<double>{1.0, 2.0, 4.0}));
    EXPECT_EQ(trace.totals.delivered, 0u);
    EXPECT_EQ(trace.totals.lost, 300u);
    EXPECT_TRUE(std::isnan(compute_metrics(e, e.seed, e.protocols[0], trace).at("rounds_to_convergence")));
  }
}

TEST(Degenerate, DisconnectedHalvesAgreeWithinThemselvesOnly) {
  for (const char* protocol : kProtocols) {
    SCOPED_TRACE(protocol);
    Experiment e =
        scalar_experiment(protocol, {0.0, 2.0, 10.0, 20.0}, {1, 1, 1, 1}, always(graph_of(4, {{1, 2}, {2, 1}, {3, 4}, {4, 3}})), 300);
    e.dt = 0.25;
    const auto x = finals(run(e));
    EXPECT_NEAR(x[0], 1.0, 1e-9);
    EXPECT_NEAR(x[1], 1.0, 1e-9);
    EXPECT_NEAR(x[2], 15.0, 1e-9);
    EXPECT_NEAR(x[3], 15.0, 1e-9);
  }
}

TEST(Degenerate, SourceThatHearsNobodyNeverMoves) {
  for (const char* protocol : {"local_voting", "kalman_consensus", "unbiased_kalman_consensus"}) {
    SCOPED_TRACE(protocol);
    Experiment e = scalar_experiment(protocol, {7.0, 1.0}, {1, 1}, always(graph_of(2, {{1, 2}})), 40);
    e.dt = 0.5;
    const Trace trace = run(e);
    EXPECT_EQ(finals(trace)[0], 7.0);
    EXPECT_GT(finals(trace)[1], 1.0);
  }
}

// --- metrics ----------------------------------------------------------------------------------------------------------------

TEST(Metrics, AreWhatTheirSummariesSay) {
  Experiment e;
  e.agents = 3;
  e.topology = RandomPairs{};
  e.initial = {{"x", {PerAgent::List{{Matrix::Constant(2, 1, 1.0), Matrix::Constant(2, 1, 2.0), Matrix::Constant(2, 1, 6.0)}}}}};
  const ProtocolChoice choice{"local_voting", {}};
  Trace trace;
  trace.agents = 3;
  trace.dimension = 2;
  const std::vector<std::uint64_t> hashes(3, 1);
  const std::vector<AgentCounters> counters{{4, 3, 1}, {4, 4, 0}, {0, 0, 0}};
  const std::vector<double> apart{0, 0, 3, 4, 1, 1}, together{2, 1, 2, 1, 2, 1.0005};
  trace.add({0, together, hashes, counters});
  trace.add({5, apart, hashes, counters});
  trace.add({10, together, hashes, counters});
  trace.add({15, together, hashes, counters});
  const Metrics metrics = compute_metrics(e, e.seed, choice, trace);
  EXPECT_NEAR(metrics.at("consensus_value[0]"), 2.0, 1e-15);
  EXPECT_NEAR(metrics.at("consensus_value[1]"), 1.0 + 0.0005 / 3, 1e-15);
  EXPECT_NEAR(metrics.at("centralised_value[0]"), 3.0, 1e-15);  // no P: the mean
  EXPECT_NEAR(metrics.at("bias[0]"), -1.0, 1e-15);
  EXPECT_NEAR(metrics.at("disagreement"), 0.0005, 1e-15);
  EXPECT_NEAR(metrics.at("spread[0]"), 0.0, 1e-15);
  EXPECT_NEAR(metrics.at("spread[1]"), 0.0005, 1e-15);
  EXPECT_EQ(metrics.at("rounds_to_convergence"), 10.0);  // round 0 was together, but it did not stay
  EXPECT_EQ(metrics.at("messages_sent"), 8.0);
  EXPECT_EQ(metrics.at("messages_delivered"), 7.0);
  EXPECT_EQ(metrics.at("messages_lost"), 1.0);
  EXPECT_EQ(metrics.at("rounds"), 15.0);
  EXPECT_FALSE(metrics.contains("consensus_value"));
  e.convergence = Convergence{1e-4, 1};
  EXPECT_TRUE(std::isnan(compute_metrics(e, e.seed, choice, trace).at("rounds_to_convergence")));
}

TEST(Metrics, ScalarSystemsHaveNoSuffixAndOnlyTheNamedOnesAreComputed) {
  Experiment e = rough("kalman_consensus");
  e.metrics = {"bias", "rounds"};
  const Metrics metrics = compute_metrics(e, e.seed, e.protocols[0], run(e));
  EXPECT_EQ(metrics.size(), 2u);
  EXPECT_TRUE(metrics.contains("bias") && metrics.contains("rounds"));
  e.metrics = {"biass"};
  try {
    compute_metrics(e, e.seed, e.protocols[0], run(e));
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("nearest: bias"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace consort
