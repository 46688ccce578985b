#include "core/network/announcements.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

std::vector<Told> told(std::initializer_list<std::pair<std::uint32_t, Round>> list) {
  std::vector<Told> out;
  for (const auto& [agent, since] : list) out.push_back({AgentId{agent}, since});
  return out;
}

TEST(Announcements, GoRoundAStronglyConnectedGraphBeforeTheFirstRound) {
  const auto all = announcements(directed_ring(4), {});
  for (std::size_t i = 0; i < 4; ++i) {
    ASSERT_EQ(all[i].size(), 3u);
    for (const Told& each : all[i]) {
      EXPECT_NE(each.from, agent_at(i));
      EXPECT_EQ(each.since, 0u);
    }
  }
}

TEST(Announcements, FollowTheDirectionOfTheEdges) {
  const std::vector<Edge> edges{{AgentId{1}, AgentId{2}}, {AgentId{2}, AgentId{3}}};
  const auto all = announcements(Graph(3, edges), {});
  EXPECT_EQ(all[0], told({}));
  EXPECT_EQ(all[1], told({{1, 0}}));
  EXPECT_EQ(all[2], told({{1, 0}, {2, 0}}));
}

TEST(Announcements, CrossWhoeverJoinsOnlyFromThenOn) {
  // 1 - 2 - 3 with 2 joining in round 7: until then 1 and 3 know nothing of each other.
  const auto all = announcements(path(3), {{AgentId{2}, {7, 100}}});
  EXPECT_EQ(all[0], told({{2, 7}, {3, 7}}));
  EXPECT_EQ(all[1], told({{1, 7}, {3, 7}}));
  EXPECT_EQ(all[2], told({{1, 7}, {2, 7}}));
}

TEST(Announcements, OfWhoHasLeftAreStillPassedOn) {
  // 1 - 2 - 3: 1 leaves in round 5, 3 joins in round 9. 2 still tells what 1 said.
  const auto all = announcements(path(3), {{AgentId{1}, {0, 5}}, {AgentId{3}, {9, 100}}});
  EXPECT_EQ(all[2], told({{1, 9}, {2, 9}}));
  EXPECT_EQ(all[0], told({{2, 0}})) << "what comes after it has left does not reach it";
}

TEST(Announcements, NeedRelaysWhereWhoMadeThemIsFarOrGone) {
  const auto relays = [](const Graph& support, const std::map<AgentId, Attendance>& presence) {
    return need_relays(announcements(support, presence), support, presence);
  };
  EXPECT_FALSE(relays(complete(3), {}));
  EXPECT_TRUE(relays(path(3), {}));
  EXPECT_FALSE(relays(complete(3), {{AgentId{3}, {9, 100}}})) << "everybody is there to tell it";
  EXPECT_TRUE(relays(complete(3), {{AgentId{1}, {0, 5}}, {AgentId{3}, {9, 100}}})) << "agent 1 is not";
  EXPECT_TRUE(relays(complete(3), {{AgentId{1}, {0, 5, {{9, 100}}}}, {AgentId{3}, {0, 5, {{7, 100}}}}})) << "agent 1 comes back later";
}

}  // namespace
}  // namespace consort
