/// Who has met whom, without a transport: every greeting and every match is told by hand.

#include "process/meeting.hpp"

#include <gtest/gtest.h>

#include <array>

namespace consort {
namespace {

constexpr AgentId k1{1}, k2{2}, k3{3}, k4{4};

MemberTask task(AgentId agent, std::vector<AgentId> in_neighbours, std::uint32_t remote_readers) {
  MemberTask task;
  task.agent = agent;
  task.in_neighbours = std::move(in_neighbours);
  task.remote_readers = remote_readers;
  return task;
}

Assignment run_of(std::uint32_t agents) {
  Assignment run;
  run.agents = agents;
  run.rounds = 100;
  return run;
}

TEST(AgentsMeeting, NobodyIsMetBeforeARunBegins) {
  const AgentsMeeting meeting({k1});
  EXPECT_EQ(meeting.met_until(), 0U);
  EXPECT_FALSE(meeting.may_greet());
  EXPECT_EQ(meeting.unmet(), "has no assignment yet");
}

TEST(AgentsMeeting, WhoHearsAndIsHeardByNobodyHasMetEverybody) {
  AgentsMeeting meeting({k1});
  EXPECT_TRUE(meeting.begin(run_of(1), std::array{task(k1, {}, 0)}).empty());
  EXPECT_EQ(meeting.met_until(), kNever);
  EXPECT_FALSE(meeting.greeting_needed(0));
}

TEST(AgentsMeeting, ReadersAreFoundAndSendersHaveGreeted) {
  AgentsMeeting meeting({k1, k2});
  const std::array tasks{task(k1, {k2, k4}, 2), task(k2, {k3}, 0)};
  EXPECT_EQ(meeting.begin(run_of(4), tasks), (std::vector{k3, k4}));
  EXPECT_EQ(meeting.unmet(), "has found 0 of 2 readers of agent 1, is not greeted by agent 3, is not greeted by agent 4");
  meeting.found_readers(k1, 1);
  EXPECT_FALSE(meeting.may_greet());
  meeting.found_readers(k1, 2);
  EXPECT_TRUE(meeting.may_greet());
  EXPECT_TRUE(meeting.greeted_by(k4));
  EXPECT_FALSE(meeting.greeted_by(k2)) << "nobody hears a hosted agent from elsewhere";
  EXPECT_EQ(meeting.met_until(), 0U);
  EXPECT_TRUE(meeting.greeted_by(k3));
  EXPECT_EQ(meeting.met_until(), kNever);
  EXPECT_EQ(meeting.unmet(), "");
  EXPECT_TRUE(meeting.begin(run_of(4), tasks).empty()) << "the next run finds the endpoints of this one";
  EXPECT_EQ(meeting.met_until(), kNever);
}

TEST(AgentsMeeting, WhoHearsEverybodyHearsAllButTheHosted) {
  AgentsMeeting meeting({k2});
  MemberTask all = task(k2, {}, 0);
  all.hears_everyone = true;
  EXPECT_EQ(meeting.begin(run_of(4), std::array{all}), (std::vector{k1, k3, k4}));
}

TEST(AgentsMeeting, WhoJoinsLaterIsWaitedForFromThenOn) {
  AgentsMeeting meeting({k1});
  Assignment run = run_of(3);
  run.joining[k3] = 40;
  meeting.begin(run, std::array{task(k1, {k2, k3}, 0)});
  EXPECT_EQ(meeting.met_until(), 0U);
  meeting.greeted_by(k2);
  EXPECT_EQ(meeting.met_until(), 40U);
  meeting.greeted_by(k3);
  EXPECT_EQ(meeting.met_until(), kNever);
}

TEST(AgentsMeeting, WhoIsGoneIsNotWaitedForUntilItComesBack) {
  AgentsMeeting meeting({k1});
  meeting.begin(run_of(3), std::array{task(k1, {k2, k3}, 2)});
  meeting.found_readers(k1, 1);
  meeting.greeted_by(k2);
  meeting.greeted_by(k3);
  EXPECT_EQ(meeting.met_until(), 0U) << "a reader is missing";
  meeting.departed(std::array{k3});
  EXPECT_TRUE(meeting.may_greet()) << "who is left can only be tried";
  EXPECT_EQ(meeting.met_until(), kNever);
  meeting.comes_back(std::array{k3}, 20);
  meeting.found_readers(k1, 2);
  EXPECT_EQ(meeting.met_until(), 20U) << "its old greeting does not count";
  EXPECT_EQ(meeting.unmet(), "is not greeted by agent 3");
  meeting.greeted_by(k3);
  EXPECT_EQ(meeting.met_until(), kNever);
}

TEST(AgentsMeeting, WhatIsToldLaterIsWaitedForFromThenOn) {
  AgentsMeeting meeting({k1, k2});
  MemberTask told = task(k1, {}, 0);
  told.told = {{k2, 0}, {k3, 0}, {k4, 7}};
  meeting.begin(run_of(4), std::array{told, task(k2, {}, 0)});
  EXPECT_EQ(meeting.met_until(), 0U);
  EXPECT_EQ(meeting.unmet(), "lacks the announcement of agent 3, lacks the announcement of agent 4");
  meeting.announced(k3);
  EXPECT_EQ(meeting.met_until(), 7U);
  meeting.announced(k4);
  EXPECT_EQ(meeting.met_until(), kNever);
}

TEST(AgentsMeeting, ThePlantIsFoundAndHasGreeted) {
  AgentsMeeting meeting({k1});
  Assignment run = run_of(1);
  run.plant = run.steers = true;
  meeting.begin(run, std::array{task(k1, {}, 0)});
  EXPECT_EQ(meeting.unmet(), "has not found the plant, is not greeted by the plant");
  EXPECT_FALSE(meeting.may_greet());
  meeting.found_plant(true);
  EXPECT_TRUE(meeting.may_greet());
  EXPECT_EQ(meeting.met_until(), 0U);
  meeting.greeted_by_plant();
  EXPECT_EQ(meeting.met_until(), kNever);
}

TEST(AgentsMeeting, GreetingsAreRepeatedUntilTheFirstRoundOfWhoReadsIsGranted) {
  AgentsMeeting meeting({k1});
  MemberTask heard = task(k1, {}, 1);
  heard.late_readers = {30};
  meeting.begin(run_of(3), std::array{heard});
  EXPECT_TRUE(meeting.greeting_needed(0));
  EXPECT_TRUE(meeting.greeting_needed(30));
  EXPECT_FALSE(meeting.greeting_needed(31));
}

TEST(PlantMeeting, ProcessesAreFoundAndHaveGreetedByTheirNextRound) {
  PlantMeeting meeting;
  std::map<std::uint32_t, Round> rounds{{1, 0}, {4, 50}};
  const PlantMeeting::Next next = [&](std::uint32_t process) { return rounds.at(process); };
  meeting.begin({1, 4}, true);
  EXPECT_EQ(meeting.met_until(next, 0), 0U);
  EXPECT_EQ(meeting.unmet(next, 0), "has not found the process of agent 1");
  meeting.found(1, true);
  EXPECT_EQ(meeting.unmet(next, 0), "is not greeted by the process of agent 1");
  meeting.greeted_by(1);
  EXPECT_EQ(meeting.met_until(next, 0), 50U);
  meeting.found(4, true);
  meeting.greeted_by(4);
  EXPECT_EQ(meeting.met_until(next, 0), kNever);
  EXPECT_TRUE(meeting.greeting_needed(next, 50));
  EXPECT_FALSE(meeting.greeting_needed(next, 51));
}

TEST(PlantMeeting, WhoIsLostOrComesBackGreetsAgain) {
  PlantMeeting meeting;
  const PlantMeeting::Next next = [](std::uint32_t) { return 10; };
  meeting.begin({1, 2}, true);
  for (const std::uint32_t process : {1U, 2U}) {
    meeting.found(process, true);
    meeting.greeted_by(process);
  }
  EXPECT_EQ(meeting.met_until(next, 5), kNever);
  meeting.comes_back(std::array{k1});
  EXPECT_EQ(meeting.met_until(next, 5), 10U);
  meeting.greeted_by(1);
  meeting.found(2, false);
  meeting.found(2, true);
  EXPECT_EQ(meeting.met_until(next, 5), 10U);
}

TEST(PlantMeeting, WhoIsNotSteeredIsNotGreeted) {
  PlantMeeting meeting;
  meeting.begin({1}, false);
  meeting.found(1, true);
  EXPECT_EQ(meeting.met_until([](std::uint32_t) { return 0; }, 0), kNever);
}

}  // namespace
}  // namespace consort
