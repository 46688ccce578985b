#include "orchestrator/run/link_tally.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

Edge edge(std::uint32_t from, std::uint32_t to) { return {AgentId{from}, AgentId{to}}; }

/// What process 2 has counted of agent 1's messages.
wire::Telemetry told(std::uint64_t delivered, bool last = false) {
  wire::Telemetry telemetry;
  telemetry.process = 2;
  telemetry.last = last;
  telemetry.links = {{edge(1, 2), {.delivered = delivered, .lost = 1}}};
  telemetry.network = {{edge(1, 2), {.sent = delivered + 1, .received = delivered}}};
  return telemetry;
}

TEST(LinkTally, OfAProcessThatIsGoneWithoutLastWordsWhatItToldLastCounts) {
  LinkTally tally;
  tally.add(told(3));
  tally.add(told(5));
  ASSERT_EQ(tally.links().size(), 1u);
  EXPECT_EQ(tally.links()[0].counters, (LinkCounters{.delivered = 5, .lost = 1}));
  EXPECT_EQ(tally.network()[0].counters, (NetworkCounters{.sent = 6, .received = 5}));
}

TEST(LinkTally, WhoComesBackCountsFromNothingAndBothStaysCount) {
  LinkTally tally;
  tally.add(told(5));
  tally.add(told(6));  // sent before it was killed, and come after
  tally.conclude(2);
  tally.conclude(2);
  tally.add(told(2));
  tally.add(told(4, true));
  EXPECT_EQ(tally.links()[0].counters, (LinkCounters{.delivered = 10, .lost = 2}));
  EXPECT_EQ(tally.network()[0].counters, (NetworkCounters{.sent = 12, .received = 10}));
}

TEST(LinkTally, LastWordsMayBeThatNothingCame) {
  LinkTally tally;
  wire::Telemetry none;
  none.process = 2;
  none.last = true;
  tally.add(none);
  EXPECT_TRUE(tally.links().empty());
  tally.add(told(3, true));
  wire::Telemetry reports;  // without a word of links: nothing new
  reports.process = 2;
  tally.add(reports);
  EXPECT_EQ(tally.links()[0].counters.delivered, 3u);
}

TEST(LinkTally, ListsLinksByEdge) {
  LinkTally tally;
  wire::Telemetry telemetry;
  telemetry.links = {{edge(3, 1), {1}}, {edge(1, 2), {1}}, {edge(1, 3), {1}}};
  tally.add(telemetry);
  std::vector<Edge> edges;
  for (const LinkTotals& link : tally.links()) edges.push_back(link.edge);
  EXPECT_EQ(edges, (std::vector{edge(1, 2), edge(1, 3), edge(3, 1)}));
}

}  // namespace
}  // namespace consort
