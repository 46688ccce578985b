/// Lockstep: how far everybody may go, and what has to happen before.

#include "orchestrator/run/granting.hpp"

#include "orchestrator/script/script.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

Experiment case_of(const std::string& more) {
  return parse_experiment("experiment: e\nrounds: 10000\ndt: 0.5\nagents: {count: 4, protocol: local_voting, initial: {x: 0}}\n" + more,
                          "e.yaml", ".");
}

std::vector<Round> firsts(const Grant& grant) {
  std::vector<Round> rounds;
  for (const GrantedSegment& segment : grant.segments) rounds.push_back(segment.first);
  return rounds;
}

TEST(Granting, TheFirstGrantIsTwoHalvesOfWhichTheFirstEndsWithAReport) {
  const Experiment experiment = case_of("topology: ring\ntelemetry: {every: 10}\n");
  Granting granting(experiment, Seed{1}, 3);
  EXPECT_FALSE(granting.due(0));
  const Grant grant = granting.grant(0, 0.0);
  EXPECT_EQ(grant.epoch, 3u);
  EXPECT_EQ(grant.report_at, 70u) << "64 rounds, up to the next report";
  EXPECT_EQ(grant.until, 140u);
  EXPECT_EQ(granting.granted(), 140u);
  EXPECT_FALSE(granting.is_time(69));
  EXPECT_TRUE(granting.is_time(70));
}

TEST(Granting, ALaterGrantIsSizedByTheSpeedButNeverLeapsNorExceedsTheWindow) {
  const Experiment experiment = case_of("topology: ring\n");
  Granting granting(experiment, Seed{1}, 1);
  EXPECT_EQ(granting.grant(0, 0.0).report_at, 64u);
  EXPECT_EQ(granting.grant(64, 0.16).report_at, 64u + 100u) << "400 rounds/s for a quarter of a second";
  EXPECT_EQ(granting.grant(164, 1e-3).report_at, 164u + 400u) << "at most four times as far as before";
  EXPECT_EQ(granting.grant(564, 1e-3).report_at, 564u + kLargestHalfWindow);
  EXPECT_EQ(granting.grant(1076, 1e9).report_at, 1077u) << "at least one round";
  EXPECT_EQ(granting.granted(), 564u + 2u * kLargestHalfWindow) << "what is granted once is not taken back";
}

TEST(Granting, NobodyIsGrantedRoundsBeyondAnEventThatHasNotHappened) {
  const Experiment experiment =
      case_of("topology: ring\nevents: [{round: 20, kill: 2}, {round: 20, stop: 3}, {round: 30, continue: 3}, {round: 40, restart: 2}]\n");
  Granting granting(experiment, Seed{1}, 1);
  const Grant before = granting.grant(0, 0.0);
  EXPECT_EQ(before.until, 20u);
  EXPECT_EQ(before.report_at, 20u);
  EXPECT_TRUE(before.whole) << "who is killed is asked how it stands";
  EXPECT_FALSE(granting.due(19));
  const auto pause = granting.due(20);
  ASSERT_TRUE(pause);
  EXPECT_EQ(pause->round, 20u);
  ASSERT_EQ(pause->faults.size(), 2u);
  EXPECT_EQ(pause->faults[0].kind, Fault::Kind::kill);
  EXPECT_EQ(time_until_proceed(experiment, pause->faults[1]), 5.0) << "ten rounds of half a second";
  EXPECT_FALSE(pause->joins);
  EXPECT_FALSE(granting.due(20)) << "once";
  const Grant after = granting.grant(20, 0.1);
  EXPECT_EQ(after.until, 40u) << "a continue stops nobody";
  EXPECT_FALSE(after.whole);
  const auto back = granting.due(40);
  ASSERT_TRUE(back);
  EXPECT_TRUE(back->joins);
  EXPECT_EQ(back->back, std::vector{AgentId{2}});
}

TEST(Granting, WhoJoinsForTheFirstTimeIsNotOneThatComesBack) {
  const Experiment experiment = case_of("topology: ring\nevents: [{round: 8, join: 4}]\n");
  Granting granting(experiment, Seed{1}, 1);
  EXPECT_EQ(granting.grant(0, 0.0).until, 8u);
  const auto pause = granting.due(8);
  ASSERT_TRUE(pause);
  EXPECT_TRUE(pause->joins);
  EXPECT_TRUE(pause->back.empty());
}

TEST(Granting, WhoHasLeftIsReleasedOnceEverybodyHasComeAsFar) {
  const Experiment experiment = case_of("topology: ring\nevents: [{round: 100, leave: 4}]\n");
  Granting granting(experiment, Seed{1}, 1);
  EXPECT_EQ(granting.grant(0, 0.0).reached, 0u);
  EXPECT_FALSE(granting.release(99)) << "agent 4 may have to send its message of round 99 again";
  const auto news = granting.release(100);
  ASSERT_TRUE(news);
  EXPECT_EQ(news->reached, 100u);
  EXPECT_EQ(news->until, granting.granted()) << "it grants nothing";
  EXPECT_TRUE(news->segments.empty());
  EXPECT_FALSE(granting.release(100)) << "once";
  EXPECT_EQ(granting.grant(128, 0.2).reached, 128u);
}

TEST(Granting, EachGraphIsStatedOnceUntilSomebodyComesWhoHasNotHeardOfIt) {
  const Experiment experiment = case_of("topology: {periodic: [{topology: ring, rounds: 32}, {topology: complete, rounds: 32}]}\n");
  Granting granting(experiment, Seed{1}, 1);
  const Grant first = granting.grant(0, 0.0);
  EXPECT_EQ(first.until, 128u);
  EXPECT_EQ(firsts(first), (std::vector<Round>{0, 32, 64, 96}));
  EXPECT_TRUE(first.segments[0].stated && first.segments[1].stated);
  EXPECT_FALSE(first.segments[2].stated || first.segments[3].stated);
  EXPECT_EQ(first.segments[2].graph, first.segments[0].graph);
  granting.state_graphs_again();
  const Grant second = granting.grant(64, 0.16);
  ASSERT_FALSE(second.segments.empty());
  EXPECT_TRUE(second.segments[0].stated);
}

TEST(Granting, NothingIsGrantedBeyondTheLastRound) {
  Experiment experiment = case_of("topology: ring\n");
  experiment.rounds = 50;
  Granting granting(experiment, Seed{1}, 1);
  EXPECT_EQ(granting.grant(0, 0.0).until, 50u);
  EXPECT_FALSE(granting.is_time(50)) << "there is no next grant";
  EXPECT_FALSE(granting.due(50));
}

}  // namespace
}  // namespace consort
