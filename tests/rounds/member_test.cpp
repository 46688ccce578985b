/// One agent's rounds, called by hand.

#include "rounds/member.hpp"

#include "protocols/registry.hpp"

#include <gtest/gtest.h>

#include <array>

namespace consort {
namespace {

constexpr AgentId kSelf{1}, kOther{2}, kThird{3};

/// Agent 1 of three, on local voting with dt 0.5: x_1+ = x_1 + 0.5 sum_j (x_j - x_1).
Member member(std::vector<Told> told = {}, Round first = 0) {
  static const LinkModel ideal;
  Values initial;
  initial.set("x", 0.0);
  const bool announces = !told.empty();
  return Member({.agent = kSelf,
                 .attendance = {first, 100},
                 .first = first,
                 .dt = 0.5,
                 .protocol = find_protocol("local_voting").make({}, Setup{kSelf, 3, 0.5, initial}),
                 .senders = {kOther, kThird},
                 .links = ideal,
                 .seed = Seed{1},
                 .window = 10,
                 .announces = announces,
                 .agents = 3,
                 .told = std::move(told),
                 .numbers = {},
                 .recorded = {}});
}

void hear(Member& member, AgentId from, Round round, double x) { member.mailbox().post(from, round, std::span(&x, 1)); }

TEST(Member, ARoundIsBegunAndFinished) {
  Member agent = member();
  const Graph graph = complete(3);
  EXPECT_EQ(agent.begin(graph, {}).front(), 0.0);
  EXPECT_TRUE(agent.begun());
  EXPECT_EQ(agent.missing(), 2U);
  hear(agent, kThird, 0, 4.0);
  hear(agent, kOther, 0, 2.0);
  EXPECT_EQ(agent.missing(), 0U);
  agent.finish();
  EXPECT_FALSE(agent.begun());
  EXPECT_EQ(agent.round(), 1U);
  EXPECT_EQ(agent.report().estimate.front(), 3.0);
  EXPECT_EQ(agent.report().counters.sent, 2U);
  EXPECT_EQ(agent.report().counters.delivered, 2U);
  ASSERT_EQ(agent.links().size(), 2U);
}

TEST(Member, ARoundThatIsMissedLeavesTheStateAndIsPartOfTheHistory) {
  Member agent = member(), other = member();
  EXPECT_EQ(agent.report().hash, other.report().hash);
  agent.miss();
  EXPECT_EQ(agent.round(), 1U);
  EXPECT_EQ(agent.report().estimate.front(), 0.0);
  EXPECT_NE(agent.report().hash, other.report().hash);
}

TEST(Member, WhoIsGoneCountsIfItHasBeenHeard) {
  Member agent = member();
  const Graph graph = complete(3);
  agent.begin(graph, {});
  hear(agent, kOther, 0, 2.0);
  agent.depart(std::array{kOther, kThird});
  EXPECT_TRUE(agent.hears(kOther));
  EXPECT_FALSE(agent.hears(kThird));
  EXPECT_EQ(agent.missing(), 0U);
  agent.finish();
  EXPECT_EQ(agent.report().estimate.front(), 1.0);
  agent.begin(graph, {}, std::array{kOther, kThird});
  EXPECT_TRUE(agent.in_neighbours().empty());
  EXPECT_EQ(agent.report().counters.sent, 2U) << "nobody is left to send to";
}

TEST(Member, SaysWhoseAnnouncementItLacksForItsRound) {
  Member agent = member({{kOther, 0}, {kThird, 1}});
  Announced announced(3);
  EXPECT_EQ(agent.learn(announced), kOther);
  announced[index_of(kOther)] = Values{};
  EXPECT_EQ(agent.learn(announced), std::nullopt) << "of agent 3 it is told in the next round";
  agent.miss();
  EXPECT_EQ(agent.learn(announced), kThird);
}

TEST(Member, WhoComesBackIsANewMember) {
  Member agent = member();
  const Graph graph = complete(3);
  agent.begin(graph, {});
  agent.finish(Inbox{});
  agent = member({}, 7);
  EXPECT_EQ(agent.round(), 7U);
  EXPECT_EQ(agent.report().hash, member().report().hash);
  EXPECT_EQ(agent.report().counters.sent, 0U);
  double x = 1.0;
  EXPECT_EQ(agent.mailbox().post(kOther, 6, std::span(&x, 1)), Mailbox::Post::stale) << "what was said before is not for it";
}

}  // namespace
}  // namespace consort
