/// Real time: what is due when. The clock is a number here.

#include "orchestrator/run/pacing.hpp"

#include "orchestrator/script/script.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

Experiment case_of(const std::string& more) {
  return parse_experiment(
      "experiment: e\nmode: realtime\nrounds: 1000\ndt: 0.1\nagents: {count: 4, protocol: local_voting, initial: {x: 0}}\n" + more,
      "e.yaml", ".");
}

TEST(Pacing, GraphsAreToldTwoSecondsAheadAndAgainWhenOneIsLeft) {
  const Experiment experiment = case_of("topology: {periodic: [{topology: ring, rounds: 8}, {topology: complete, rounds: 8}]}\n");
  Pacing pacing(experiment, Seed{1}, 2, 77, 5.0);
  const auto first = pacing.graphs(-0.3);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->epoch, 2u);
  EXPECT_EQ(first->start_ns, 77u);
  EXPECT_EQ(first->until, 21u);
  ASSERT_EQ(first->segments.size(), 3u);
  for (const GrantedSegment& segment : first->segments) EXPECT_TRUE(segment.stated) << "all that hold from now on";
  EXPECT_FALSE(pacing.graphs(0.95));
  const auto next = pacing.graphs(1.25);
  ASSERT_TRUE(next);
  EXPECT_EQ(next->segments.front().first, 12u) << "who comes later needs no more than what is to come";
  EXPECT_EQ(next->until, 33u);
  EXPECT_EQ(pacing.graphs(99.5)->until, 1000u);
}

TEST(Pacing, AFaultHappensOnceWhenItsTimeHasCome) {
  const Experiment experiment =
      case_of("topology: ring\nevents: [{round: 10, kill: 2}, {round: 12, stop: 3}, {round: 20, continue: 3}, {round: 30, kill: 4}]\n");
  Pacing pacing(experiment, Seed{1}, 1, 0, 5.0);
  EXPECT_TRUE(pacing.faults(0.99).empty());
  const auto due = pacing.faults(2.5);
  ASSERT_EQ(due.size(), 2u) << "the sleeper is woken by its own time";
  EXPECT_EQ(due[0].agent, AgentId{2});
  EXPECT_EQ(due[1].kind, Fault::Kind::stop);
  EXPECT_TRUE(pacing.faults(2.6).empty());
  EXPECT_EQ(pacing.faults(50.0).size(), 1u);
}

TEST(Pacing, WhoJoinsIsCalledASecondBeforeAndWhoComesBackNotBeforeItsEnd) {
  const Experiment experiment = case_of("topology: ring\nevents: [{round: 50, join: 4}, {round: 60, kill: 2}, {round: 64, restart: 2}]\n");
  Pacing pacing(experiment, Seed{1}, 1, 0, 5.0);
  EXPECT_TRUE(pacing.calls(3.9).empty());
  const auto first = pacing.calls(4.05);
  ASSERT_EQ(first.size(), 1u);
  EXPECT_EQ(first[0].agent, AgentId{4});
  EXPECT_EQ(first[0].from, 50u);
  EXPECT_TRUE(first[0].first);
  EXPECT_FALSE(pacing.calls(4.1).at(0).first) << "it is only looked whether it runs";
  EXPECT_EQ(pacing.calls(6.0).size(), 1u) << "agent 2 has just been killed";
  const auto both = pacing.calls(6.06);
  ASSERT_EQ(both.size(), 2u);
  EXPECT_EQ(both[0].agent, AgentId{2});
  EXPECT_EQ(both[0].from, 64u);
  EXPECT_TRUE(both[0].first);
}

TEST(Pacing, IsOverWhenTheLastReportsHaveHadTheirTime) {
  const Experiment experiment = case_of("topology: ring\n");
  const Pacing pacing(experiment, Seed{1}, 1, 0, 5.0);
  EXPECT_FALSE(pacing.is_over(104.9));
  EXPECT_TRUE(pacing.is_over(105.1));
}

}  // namespace
}  // namespace consort
