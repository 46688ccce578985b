#include "core/metrics/divergence.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace consort {
namespace {

Experiment pair_of_agents() {
  Experiment experiment;
  experiment.agents = 2;
  experiment.rounds = 100;
  experiment.protocols = {{"p", {}}};
  experiment.topology = FixedSchedule{{{std::make_shared<const Graph>(complete(2)), 1}}, false};
  return experiment;
}

/// Agent 1 holds first(k), agent 2 second(k).
Trace trace_of(const std::function<double(Round)>& first, const std::function<double(Round)>& second, Round every = 1, Round last = 100) {
  Trace trace;
  trace.agents = 2;
  trace.dimension = 1;
  const std::array<std::uint64_t, 2> hashes{};
  const std::array<AgentCounters, 2> counters{};
  for (Round k = 0; k <= last; k += every) {
    const std::array values{first(k), second(k)};
    trace.add({k, values, hashes, counters});
  }
  return trace;
}

/// The agents are as far apart as `gap` says, around 4.
Trace apart(const std::function<double(Round)>& gap, Round every = 1) {
  return trace_of([&](Round k) { return 4.0 + gap(k) / 2.0; }, [&](Round k) { return 4.0 - gap(k) / 2.0; }, every);
}

std::optional<Divergence> judged(const Trace& trace, const Experiment& experiment = pair_of_agents()) {
  return divergence(experiment, Seed{1}, experiment.protocols[0], trace);
}

double growing(Round k) { return std::pow(1.2, k); }  // 9100-fold in fifty rounds

TEST(Divergence, IsARiseOfMoreThanAHundredfoldInTheLastHalf) {
  const auto found = judged(apart(growing));
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->of_error);
  EXPECT_EQ(found->from_round, 50U);
  EXPECT_EQ(found->to_round, 100U);
  EXPECT_NEAR(found->from, growing(50), 1e-9 * growing(50));
  EXPECT_NEAR(found->to, growing(100), 1e-9 * growing(100));
  EXPECT_TRUE(judged(apart(growing, 25))) << "few reports will do";
  EXPECT_TRUE(judged(apart([](Round k) { return growing(k) * std::cos(0.3 * k); }))) << "it may swing";
  EXPECT_TRUE(judged(apart([](Round k) { return std::pow(10.0, 3.5 * k); }))) << "beyond the range of doubles";
}

TEST(Divergence, IsNoLesserRiseAndNoFall) {
  EXPECT_FALSE(judged(apart([](Round k) { return std::pow(1.09, k); }))) << "74-fold";
  EXPECT_FALSE(judged(apart([](Round k) { return std::pow(0.9, k); })));
  EXPECT_FALSE(judged(apart([](Round) { return 3.0; })));
  EXPECT_FALSE(judged(apart([](Round k) { return k == 50 ? 0.0 : 3.0 * std::cos(0.3 * k); }))) << "it swings, and is zero in the middle";
  EXPECT_FALSE(judged(apart([](Round k) { return k < 90 ? 1.0 / (1.0 + k) : 2.0; }))) << "70-fold";
}

TEST(Divergence, IsNotSeenInWhatRoundingLeaves) {
  EXPECT_FALSE(judged(apart([](Round k) { return k < 60 ? 0.0 : 4e-14; })));
  EXPECT_FALSE(judged(apart([](Round k) { return k % 7 == 0 ? 9e-16 : 0.0; })));
  EXPECT_FALSE(judged(trace_of([](Round k) { return 1e9 * k; }, [](Round k) { return 1e9 * k + (k < 60 ? 0.0 : 1e-2); })));
  EXPECT_TRUE(judged(apart([](Round k) { return 1e-15 * std::pow(1.5, k); }))) << "what grew out of it is";
}

TEST(Divergence, IsNotSaidWhereSomethingElseExplainsIt) {
  const Trace trace = apart(growing);
  std::vector<std::function<void(Experiment&)>> reasons{
      [](Experiment& e) { e.links.standard.loss_probability = 0.1; },
      [](Experiment& e) {
        e.links.overrides[Edge{AgentId{1}, AgentId{2}}].delay_rounds = 1;
      },
      [](Experiment& e) {
        e.links.changes = {{90, std::nullopt, LinkSpec{.duplication = 0.1}}};
      },
      [](Experiment& e) {
        e.plant.emplace().disturbances.push_back({Disturbance::On::state, Disturbance::Gaussian{}, 1, {}, 0});
      },
      [](Experiment& e) {
        e.link_events = {{60, {{AgentId{1}, AgentId{2}}}}};
      },
      [](Experiment& e) { e.presence[AgentId{2}].from = 55; },
      [](Experiment& e) { e.presence[AgentId{2}].until = 70; },
      [](Experiment& e) {
        e.faults = {{80, AgentId{2}, Fault::Kind::stop}};
      }};
  for (std::size_t i = 0; i < reasons.size(); ++i) {
    Experiment experiment = pair_of_agents();
    reasons[i](experiment);
    EXPECT_FALSE(judged(trace, experiment)) << i;
  }
  Experiment early = pair_of_agents();
  early.link_events = {{20, {{AgentId{1}, AgentId{2}}}, true}};
  early.presence[AgentId{2}].from = 10;
  EXPECT_TRUE(judged(trace, early)) << "what happened in the first half explains no rise in the last";
  Trace late = trace;
  late.network = {{Edge{AgentId{1}, AgentId{2}}, {.sent = 100, .received = 99, .late = 1}}};
  EXPECT_FALSE(judged(late)) << "a message came too late";
}

TEST(Divergence, OfFollowersIsMeasuredBesideTheirLeader) {
  Experiment led = pair_of_agents();
  const std::vector<Edge> edges{{AgentId{1}, AgentId{2}}};
  led.topology = FixedSchedule{{{std::make_shared<const Graph>(2, edges), 1}}, false};
  const Trace lagging = trace_of(growing, [](Round k) { return 0.9 * growing(k); });
  EXPECT_FALSE(judged(lagging, led)) << "a tenth of what the leader is, all along";
  EXPECT_TRUE(judged(lagging)) << "without a leader both are its doing";
  EXPECT_TRUE(judged(trace_of([](Round) { return 1.0; }, growing), led));
}

TEST(Divergence, OfEstimatorsIsThatOfTheirError) {
  Trace trace = trace_of([](Round k) { return 1.0 + growing(k); }, [](Round k) { return 1.0 + growing(k); });
  trace.truth = Truth::state;
  trace.state_dimension = 1;
  trace.states = {};
  for (std::size_t report = 0; report < trace.rounds.size(); ++report) trace.states.add(std::array{1.0, 1.0});
  const auto found = judged(trace);
  ASSERT_TRUE(found) << "they agree, on what is not so";
  EXPECT_TRUE(found->of_error);
  EXPECT_NEAR(found->to, std::sqrt(2.0) * growing(100), 1e-6 * growing(100));
  Trace apart_but_right = apart(growing);
  apart_but_right.truth = Truth::state;
  apart_but_right.state_dimension = 1;
  apart_but_right.states = apart_but_right.estimates;
  EXPECT_FALSE(judged(apart_but_right)) << "each of its own state";
}

TEST(Divergence, NeedsTheSameAgentsBeforeAndAfterAndEnoughRounds) {
  EXPECT_FALSE(
      judged(trace_of([](Round k) { return k < 70 ? 4.0 + growing(k) / 2.0 : kAbsent; }, [](Round k) { return 4.0 - growing(k) / 2.0; })));
  EXPECT_FALSE(judged(trace_of([](Round) { return 0.0; }, [](Round k) { return k == 5 ? 9.0 : 0.0; }, 1, 5)));
}

}  // namespace
}  // namespace consort
