#include "orchestrator/run/collector.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

MemberReport report_of(std::uint32_t agent, std::vector<Round> rounds) {
  MemberReport report;
  report.agent = AgentId{agent};
  report.rounds = std::move(rounds);
  for (const Round k : report.rounds) {
    report.estimates.push_back(100.0 * agent + k);
    report.estimates.push_back(-1.0);
    report.hashes.push_back(agent * 1000 + k);
    report.counters.push_back({agent, k, 0});
  }
  return report;
}

std::vector<Round> handed_on(Collector& collector, std::size_t most = 1000) {
  std::vector<Round> rounds;
  collector.hand_on([&](const RoundReport& report) {
    rounds.push_back(report.k);
    EXPECT_EQ(report.estimates[0], 100.0 + report.k);
    EXPECT_EQ(report.estimates[2], 200.0 + report.k);
    EXPECT_EQ(report.hashes[1], 2000u + report.k);
    EXPECT_EQ(report.counters[1].delivered, report.k);
    return rounds.size() < most;
  });
  return rounds;
}

TEST(Collector, HandsARoundOnWhenEverybodyHasReportedItInOrder) {
  Collector collector(2, 2, 10, 4);  // reported: 0, 4, 8 and the last, 10
  collector.add(report_of(2, {0, 4, 8, 10}));
  EXPECT_TRUE(handed_on(collector).empty());
  EXPECT_EQ(collector.missing(), std::vector<AgentId>{AgentId{1}});
  collector.add(report_of(1, {4}));
  EXPECT_TRUE(handed_on(collector).empty()) << "round 0 is still open";
  collector.add(report_of(1, {0}));
  EXPECT_EQ(handed_on(collector), (std::vector<Round>{0, 4}));
  collector.add(report_of(1, {8, 10}));
  EXPECT_EQ(handed_on(collector), (std::vector<Round>{8, 10}));
  EXPECT_EQ(collector.left_out(), 0u);
}

TEST(Collector, StopsWhenToldAndGoesOnLater) {
  Collector collector(2, 2, 8, 2);
  collector.add(report_of(1, {0, 2, 4, 6, 8}));
  collector.add(report_of(2, {0, 2, 4, 6, 8}));
  EXPECT_EQ(handed_on(collector, 2), (std::vector<Round>{0, 2}));
  EXPECT_EQ(handed_on(collector), (std::vector<Round>{4, 6, 8}));
}

TEST(Collector, LeavesOutWhatDoesNotFitTheRun) {
  Collector collector(2, 2, 10, 4);
  collector.add(report_of(3, {0}));         // nobody
  collector.add(report_of(1, {1, 0, 12}));  // rounds that are not reported
  collector.add(report_of(1, {0}));         // twice
  auto cut = report_of(2, {0, 4});
  cut.estimates.pop_back();
  collector.add(cut);  // wrong size
  EXPECT_EQ(collector.left_out(), 1u + 2u + 1u + 2u);
  collector.add(report_of(2, {0}));
  EXPECT_EQ(handed_on(collector), std::vector<Round>{0});
}

TEST(Collector, HandsOnWhatIsRecordedBesideTheEstimatesAndItIsAbsentWithItsAgent) {
  Collector collector(2, 2, 8, 4, 0, {{AgentId{2}, Attendance{0, 3}}}, 3);
  auto whole = report_of(1, {0, 4, 8}), left = report_of(2, {0, 3});
  whole.recorded = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  left.recorded = {10, 11, 12, 13, 14, 15};
  auto without = report_of(1, {0});
  collector.add(without);
  EXPECT_EQ(collector.left_out(), 1u) << "what others record is missing";
  collector.add(whole);
  collector.add(left);
  std::vector<std::vector<double>> recorded;
  collector.hand_on([&](const RoundReport& report) {
    recorded.emplace_back(report.recorded.begin(), report.recorded.end());
    return true;
  });
  ASSERT_EQ(recorded.size(), 3u);
  EXPECT_EQ(recorded[0], (std::vector<double>{1, 2, 3, 10, 11, 12}));
  EXPECT_EQ(std::vector(recorded[1].begin(), recorded[1].begin() + 3), (std::vector<double>{4, 5, 6}));
  for (std::size_t i = 3; i < 6; ++i) EXPECT_TRUE(is_absent(recorded[1][i])) << i;
}

TEST(Collector, RoundsInWhichNobodyIsThereComeOfThemselves) {
  Attendance away;  // everybody is, over rounds 4 to 7
  away.until = 4;
  away.again = {{8}};
  Collector collector(2, 2, 10, 2, 0, {{AgentId{1}, away}, {AgentId{2}, away}});
  const auto rounds = [&] {
    std::vector<std::pair<Round, bool>> handed;
    collector.hand_on([&](const RoundReport& report) {
      handed.emplace_back(report.k, is_absent(report.estimates[0]));
      return true;
    });
    return handed;
  };
  using Handed = std::vector<std::pair<Round, bool>>;
  collector.add(report_of(1, {0, 2, 4}));
  EXPECT_EQ(rounds(), Handed{});
  collector.add(report_of(2, {0, 2, 4}));
  EXPECT_EQ(rounds(), (Handed{{0, false}, {2, false}, {4, true}, {6, true}}));
  collector.add(report_of(1, {8, 10}));
  collector.add(report_of(2, {8, 10}));
  EXPECT_EQ(rounds(), (Handed{{8, false}, {10, false}}));
}

TEST(Collector, KnowsHowFarEachCameAndWhatItSlept) {
  Attendance twice;
  twice.until = 4;
  twice.again = {{6}};
  Collector collector(2, 2, 10, 2, 0, {{AgentId{2}, twice}});
  MemberReport first = report_of(2, {0, 2, 4}), second = report_of(2, {6, 8});
  first.slept = 3;
  second.slept = 1;
  collector.add(first);
  collector.add(report_of(1, {0, 12}));
  EXPECT_EQ(collector.reached(AgentId{1}), 0u) << "round 12 is none of the run";
  EXPECT_EQ(collector.reached(AgentId{2}), 4u);
  collector.add(second);
  EXPECT_EQ(collector.reached(AgentId{2}), 8u);
  EXPECT_EQ(collector.slept(AgentId{2}), 3u + 1u) << "of both stays";
  EXPECT_EQ(collector.slept(AgentId{1}), 0u);
}

}  // namespace
}  // namespace consort
