#include "rounds/flow.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

const std::vector<double> kMessage{1.0};

std::vector<Round> sent_again(Flow& flow, Round first, Round rounds, std::uint32_t asked) {
  std::vector<Round> found;
  flow.send_again(0, {AgentId{1}, first, rounds, asked}, [&](Round k, std::span<const double>) { found.push_back(k); });
  return found;
}

TEST(Flow, NobodyBeginsMoreRoundsThanAllowedBeyondAListener) {
  Flow flow(3, 1, 4, 100, 10);
  const std::vector<AgentId> both{AgentId{2}, AgentId{3}};
  EXPECT_TRUE(flow.may_begin(14, both)) << "all begin in round 10";
  EXPECT_FALSE(flow.may_begin(15, both));
  EXPECT_TRUE(flow.reaches(AgentId{2}, 12));
  EXPECT_FALSE(flow.reaches(AgentId{2}, 11)) << "come late";
  EXPECT_TRUE(flow.may_begin(16, std::vector{AgentId{2}}));
  EXPECT_FALSE(flow.may_begin(16, both));
  flow.departs(AgentId{3});
  EXPECT_TRUE(flow.may_begin(16, both)) << "nobody waits for who is gone";
  flow.comes_back(AgentId{3}, 15);
  EXPECT_TRUE(flow.may_begin(16, both));
  EXPECT_FALSE(flow.may_begin(20, both));
  EXPECT_TRUE(flow.may_begin(20, {}));
}

TEST(Flow, WhatWasSentIsKeptUntilNoListenerCanLackIt) {
  Flow flow(3, 1, 50, 100, 0);
  const std::vector<AgentId> both{AgentId{2}, AgentId{3}}, second{AgentId{2}};
  flow.sent(0, 0, both, kMessage);
  flow.reaches(AgentId{2}, 9);
  for (Round k = 1; k < 10; ++k) flow.sent(0, k, second, kMessage);
  EXPECT_EQ(sent_again(flow, 0, 2, 0), (std::vector<Round>{0, 1}))
      << "agent 3 has heard it in round 0, and does not say that it has gone on";
  flow.reaches(AgentId{3}, 7);
  flow.sent(0, 10, second, kMessage);
  EXPECT_EQ(sent_again(flow, 0, 9, 0), (std::vector<Round>{7, 8}));
  for (Round k = 11; k < 200; ++k) flow.sent(0, k, second, kMessage);
  EXPECT_EQ(sent_again(flow, 0, 100, 0), (std::vector<Round>{99})) << "nobody alive is further behind than the window";
}

TEST(Flow, OneAnswerIsEnoughForAllWhoAskTheFirstTime) {
  Flow flow(3, 1, 50, 100, 0);
  flow.sent(0, 0, std::vector{AgentId{2}, AgentId{3}}, kMessage);
  EXPECT_EQ(sent_again(flow, 0, 1, 0), (std::vector<Round>{0}));
  EXPECT_TRUE(sent_again(flow, 0, 1, 0).empty()) << "on its way already";
  EXPECT_EQ(sent_again(flow, 0, 1, 1), (std::vector<Round>{0})) << "the answer was lost, too";
  EXPECT_EQ(sent_again(flow, 0, 1, 7), (std::vector<Round>{0}));
  EXPECT_TRUE(sent_again(flow, 1, 3, 7).empty()) << "not sent yet";
}

}  // namespace
}  // namespace consort
