/// Rounds that a clock paces: what is used, what is late, what is counted. No clock and no network here.

#include "rounds/realtime.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

constexpr AgentId kSelf{1}, kOther{2};

/// Agent 1 hears agent 2 in every round: x_1+ = x_1 + dt (x_2 - x_1).
class Listener {
 public:
  explicit Listener(Seconds lifespan) {
    Assignment run;
    run.epoch = 1;
    run.protocol = "local_voting";
    run.agents = 2;
    run.dt = 0.5;
    run.rounds = 100;
    run.window = 100;
    run.realtime = true;
    run.delivery.lifespan = lifespan;
    MemberTask member;
    member.agent = kSelf;
    member.process = 1;
    member.initial.set("x", 0.0);
    member.in_neighbours = {kOther};
    rounds_ = std::make_unique<Realtime>(run, std::span(&member, 1), [](std::size_t, Round, std::span<const double>) {});
    Grant grant{1, 100, 0, {}};
    grant.segments.push_back({0, 0, std::vector<WeightedEdge>{{{kOther, kSelf}, 1.0}}});
    rounds_->grant(grant);
  }
  void hear(Round round, double x) { rounds_->receive(Information{1, kOther, round, std::span(&x, 1)}); }
  double after(Round k) {
    rounds_->begin_round(k);
    rounds_->end_round(k);
    return state();
  }
  double state() {
    double x = 0.0;
    rounds_->hosted()[0].protocol().estimate(std::span(&x, 1));
    return x;
  }
  NetworkCounters counters() { return rounds_->network().at(0).counters; }
  Realtime& rounds() { return *rounds_; }

 private:
  std::unique_ptr<Realtime> rounds_;
};

TEST(Realtime, NobodyIsWaitedFor) {
  Listener agent(0.5);
  agent.hear(0, 8.0);
  EXPECT_EQ(agent.after(0), 4.0);
  EXPECT_EQ(agent.after(1), 4.0) << "nothing has come";
  agent.hear(2, 8.0);
  EXPECT_EQ(agent.after(2), 6.0);
  EXPECT_EQ(agent.counters(), (NetworkCounters{3, 2, 1, 0, 0, 0}));
}

TEST(Realtime, AMessageIsUsedWhileItLivesAndNoNewerOneIsThere) {
  Listener agent(1.0);  // two rounds
  agent.hear(0, 8.0);
  EXPECT_EQ(agent.after(0), 4.0);
  EXPECT_EQ(agent.after(1), 6.0) << "that of round 0 still counts";
  EXPECT_EQ(agent.after(2), 6.0) << "and no longer";
  agent.hear(3, 0.0);
  EXPECT_EQ(agent.after(3), 3.0);
}

TEST(Realtime, AMessageThatComesAfterItsRoundIsUsedWhileItLives) {
  Listener agent(1.0);  // two rounds
  EXPECT_EQ(agent.after(0), 0.0);
  agent.hear(0, 8.0);
  EXPECT_EQ(agent.counters(), (NetworkCounters{1, 1, 0, 0, 0, 0}));
  EXPECT_EQ(agent.after(1), 4.0) << "that of round 0, one round late";
  EXPECT_EQ(agent.after(2), 4.0) << "and no longer";
  agent.hear(1, 8.0);
  agent.hear(3, 0.0);
  EXPECT_EQ(agent.after(3), 2.0) << "the newer one counts";
  EXPECT_EQ(agent.after(4), 1.0) << "as long as it lives";
  EXPECT_EQ(agent.counters().late, 1u) << "that of round 1 came when its life was over";
}

TEST(Realtime, AnOlderMessageThatComesLateDoesNotReplaceTheOneUsedLast) {
  Listener agent(1.5);  // three rounds
  agent.after(0);
  agent.hear(1, 8.0);
  EXPECT_EQ(agent.after(1), 4.0);
  agent.hear(0, 0.0);
  EXPECT_EQ(agent.after(2), 6.0);
}

TEST(Realtime, WhatIsLateDuplicatedOrReorderedIsCountedOnce) {
  Listener agent(0.5);
  agent.hear(1, 1.0);
  agent.hear(0, 8.0);
  agent.hear(0, 9.0);
  EXPECT_EQ(agent.after(0), 4.0) << "the first one counts";
  EXPECT_EQ(agent.counters(), (NetworkCounters{1, 1, 0, 0, 1, 1}));
  agent.after(1);
  agent.after(2);
  EXPECT_EQ(agent.counters().lost, 1u);
  agent.hear(2, 5.0);
  EXPECT_EQ(agent.counters(), (NetworkCounters{3, 2, 0, 1, 1, 1})) << "late, after all";
  agent.hear(2, 5.0);
  agent.hear(1, 5.0);
  EXPECT_EQ(agent.counters().late, 1u);
  EXPECT_EQ(agent.counters().duplicated, 2u) << "that of round 1 had come; of a late one a copy is not told apart";
}

TEST(Realtime, RoundsThatWereSleptThroughLeaveTheStateAsItIs) {
  Listener agent(0.5);
  agent.hear(0, 8.0);
  agent.after(0);
  agent.hear(40, 8.0);
  EXPECT_EQ(agent.after(40), 6.0);
  const auto reports = agent.rounds().collect_reports();
  ASSERT_EQ(reports.at(0).rounds.size(), 42u) << "0 .. 41, each of them";
  EXPECT_EQ(reports[0].estimates[20], 4.0);
  EXPECT_EQ(reports[0].rounds.back(), 41u);
}

}  // namespace
}  // namespace consort
