#include "core/network/schedule.hpp"

#include "tests/core/cases.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <thread>

namespace consort {
namespace {

using cases::edge;

constexpr Round kForEver = std::numeric_limits<Round>::max();

std::shared_ptr<const Graph> shared(Graph graph) { return std::make_shared<const Graph>(std::move(graph)); }

Graph of_edges(std::size_t agents, std::vector<Edge> edges) { return Graph(agents, std::span<const Edge>(edges)); }

Schedule fixed(std::vector<FixedSchedule::Interval> intervals, bool periodic = false, std::vector<LinkEvent> events = {}) {
  const std::size_t agents = intervals.front().graph->agents();
  return Schedule(agents, FixedSchedule{std::move(intervals), periodic}, std::move(events), Seed{1});
}

void expect_segment(const Schedule& schedule, Round k, Round first, Round last, const Graph& graph) {
  SCOPED_TRACE(k);
  const auto segment = schedule.segment(k);
  EXPECT_EQ(segment.first, first);
  EXPECT_EQ(segment.last, last);
  EXPECT_EQ(*segment.graph, graph);
}

TEST(FixedSchedule, WithOneGraphIsOneSegment) {
  const auto graph = shared(ring(4));
  const Schedule schedule = fixed({{graph, 3}});
  expect_segment(schedule, 0, 0, kForEver, *graph);
  expect_segment(schedule, kForEver, 0, kForEver, *graph);
  EXPECT_EQ(schedule.at(17), graph);
  EXPECT_TRUE(schedule.constant());
  EXPECT_EQ(schedule.agents(), 4U);
}

TEST(FixedSchedule, HoldsTheLastGraph) {
  const Schedule schedule = fixed({{shared(ring(4)), 3}, {shared(star(4)), 2}});
  expect_segment(schedule, 2, 0, 2, ring(4));
  expect_segment(schedule, 3, 3, kForEver, star(4));
  expect_segment(schedule, 1000000, 3, kForEver, star(4));
  EXPECT_FALSE(schedule.constant());
}

TEST(FixedSchedule, StartsAgainWhenPeriodic) {
  const Schedule schedule = fixed({{shared(ring(4)), 3}, {shared(star(4)), 2}}, true);
  expect_segment(schedule, 4, 3, 4, star(4));
  expect_segment(schedule, 5, 5, 7, ring(4));
  expect_segment(schedule, 500'000'003, 500'000'003, 500'000'004, star(4));
  // 2^32 = 5 * 858993459 + 1: the last round begins a period that it cannot complete.
  expect_segment(schedule, kForEver, kForEver, kForEver, ring(4));
}

TEST(FixedSchedule, MergesEqualNeighbours) {
  const Schedule schedule = fixed({{shared(ring(4)), 3}, {shared(ring(4)), 2}, {shared(star(4)), 1}}, true);
  expect_segment(schedule, 4, 0, 4, ring(4));
  EXPECT_TRUE(fixed({{shared(ring(4)), 3}, {shared(ring(4)), 2}}, true).constant());
  EXPECT_TRUE(fixed({{shared(ring(4)), kForEver}, {shared(star(4)), kForEver}, {shared(star(4)), 9}}).segment(kForEver - 1).last ==
              kForEver - 1);
}

TEST(Schedule, RefusesWhatMakesNoSense) {
  const auto make = [](std::size_t agents, Schedule::Spec spec, std::vector<LinkEvent> events = {}) {
    return Schedule(agents, std::move(spec), std::move(events), Seed{1});
  };
  EXPECT_THROW(make(3, FixedSchedule{}), ConfigError);
  EXPECT_THROW(make(3, FixedSchedule{{{shared(ring(3)), 0}}, false}), ConfigError);
  EXPECT_THROW(make(3, FixedSchedule{{{shared(ring(4)), 1}}, false}), ConfigError);
  EXPECT_THROW(make(3, FixedSchedule{{{nullptr, 1}}, false}), ContractViolation);
  EXPECT_THROW(make(3, RandomPairs{0, 3}), ConfigError);
  EXPECT_THROW(make(3, RandomPairs{3, 2}), ConfigError);
  EXPECT_THROW(make(3, RandomLinks{shared(ring(3)), 1.5}), ConfigError);
  EXPECT_THROW(make(3, RandomLinks{shared(ring(4)), 0.5}), ConfigError);
  EXPECT_THROW(make(3, RandomPairs{}, {{4, {edge(1, 4)}, false}}), ConfigError);
}

TEST(Events, CutAndHealFromTheirRoundOn) {
  const Graph without = of_edges(3, {edge(2, 3), edge(3, 1)});
  const Schedule schedule = fixed({{shared(directed_ring(3)), 1}}, false, {{20, {edge(1, 2)}, true}, {10, {edge(1, 2)}, false}});
  expect_segment(schedule, 9, 0, 9, directed_ring(3));
  expect_segment(schedule, 10, 10, 19, without);
  expect_segment(schedule, 19, 10, 19, without);
  expect_segment(schedule, 20, 20, kForEver, directed_ring(3));
  EXPECT_FALSE(schedule.constant());
  EXPECT_EQ(schedule.at(10), schedule.at(19));  // one object for the segment
}

TEST(Events, TheLaterEntryOfARoundWins) {
  EXPECT_TRUE(fixed({{shared(ring(3)), 1}}, false, {{5, {edge(1, 2)}, false}, {5, {edge(1, 2)}, true}}).constant());
  EXPECT_FALSE(fixed({{shared(ring(3)), 1}}, false, {{5, {edge(1, 2)}, true}, {5, {edge(1, 2)}, false}}).constant());
}

TEST(Events, AtRoundZeroLeaveOneSegment) {
  const Schedule schedule = fixed({{shared(directed_ring(3)), 1}}, false, {{0, {edge(1, 2)}, false}});
  EXPECT_TRUE(schedule.constant());
  expect_segment(schedule, 7, 0, kForEver, of_edges(3, {edge(2, 3), edge(3, 1)}));
}

TEST(Events, MayNameEdgesThatAreNotThere) {
  const auto graph = shared(directed_ring(3));
  const Schedule schedule = fixed({{graph, 1}}, false, {{10, {edge(2, 1)}, false}});
  EXPECT_EQ(schedule.at(10), graph);
}

TEST(RandomPairs, MatchEverybodyWithDwellsInRange) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"case"});
    const std::size_t agents = 3 + stream.below(8);
    const Schedule schedule(agents, RandomPairs{2, 5}, {}, Seed{seed});
    for (Round k = 0; k < 60;) {
      const auto segment = schedule.segment(k);
      ASSERT_EQ(segment.first, k);
      ASSERT_GE(segment.last - segment.first + 1, 2U);
      ASSERT_LE(segment.last - segment.first + 1, 5U);
      ASSERT_TRUE(undirected(*segment.graph));
      ASSERT_EQ(segment.graph->edge_count(), agents - agents % 2);
      for (std::size_t i = 0; i < agents; ++i) ASSERT_LE(segment.graph->in_degree(agent_at(i)), 1U);
      k = segment.last + 1;
    }
  }
}

TEST(RandomPairs, ReachEveryPairAndEveryDwellEquallyOften) {
  const Schedule schedule(4, RandomPairs{1, 3}, {}, Seed{3});
  std::map<std::uint32_t, int> partners_of_first;
  std::map<Round, int> dwells;
  Round k = 0;
  for (int s = 0; s < 6000; ++s) {
    const auto segment = schedule.segment(k);
    ++partners_of_first[segment.graph->in_neighbours(AgentId{1})[0].id.value];
    ++dwells[segment.last - segment.first + 1];
    k = segment.last + 1;
  }
  ASSERT_EQ(partners_of_first.size(), 3U);
  ASSERT_EQ(dwells.size(), 3U);
  const double five_sigma = 5 * std::sqrt(6000 * 2.0 / 9);
  for (const auto& [partner, count] : partners_of_first) EXPECT_NEAR(count, 2000, five_sigma) << partner;
  for (const auto& [dwell, count] : dwells) EXPECT_NEAR(count, 2000, five_sigma) << dwell;
}

TEST(RandomPairs, OfFewAgentsAreConstant) {
  EXPECT_TRUE(Schedule(1, RandomPairs{}, {}, Seed{1}).constant());
  EXPECT_EQ(*Schedule(0, RandomPairs{}, {}, Seed{1}).at(5), Graph());
  EXPECT_EQ(*Schedule(2, RandomPairs{}, {}, Seed{1}).at(5), complete(2));
  EXPECT_TRUE(Schedule(2, RandomPairs{}, {}, Seed{1}).constant());
  EXPECT_FALSE(Schedule(3, RandomPairs{}, {}, Seed{1}).constant());
}

TEST(RandomLinks, KeepEachEdgeWithTheProbability) {
  const Schedule schedule(5, RandomLinks{shared(complete(5)), 0.3}, {}, Seed{2});
  std::size_t present = 0;
  for (Round k = 0; k < 2000; ++k) present += schedule.at(k)->edge_count();
  EXPECT_NEAR(static_cast<double>(present), 40000 * 0.3, 5 * std::sqrt(40000 * 0.21));
  EXPECT_TRUE(Schedule(5, RandomLinks{shared(ring(5)), 1.0}, {}, Seed{2}).constant());
  EXPECT_EQ(*Schedule(5, RandomLinks{shared(ring(5)), 1.0}, {}, Seed{2}).at(8), ring(5));
  EXPECT_TRUE(Schedule(5, RandomLinks{shared(ring(5)), 0.0}, {}, Seed{2}).constant());
  EXPECT_EQ(Schedule(5, RandomLinks{shared(ring(5)), 0.0}, {}, Seed{2}).at(8)->edge_count(), 0U);
}

TEST(RandomLinks, KeepWeightsAndDrawsWhenTheBaseGrows) {
  const std::vector<WeightedEdge> few{{edge(1, 2), 0.5}, {edge(2, 3), 2.0}};
  const Schedule small(3, RandomLinks{shared(Graph(3, few)), 0.5}, {}, Seed{4});
  std::vector<WeightedEdge> many = few;
  many.push_back({edge(4, 2), 1.0});
  const Schedule large(4, RandomLinks{shared(Graph(4, many)), 0.5}, {}, Seed{4});
  for (Round k = 0; k < 200; ++k) {
    SCOPED_TRACE(k);
    for (const auto& [e, weight] : small.at(k)->edges()) ASSERT_EQ(weight, e == edge(1, 2) ? 0.5 : 2.0);
    ASSERT_EQ(small.at(k)->has(edge(1, 2)), large.at(k)->has(edge(1, 2)));
    ASSERT_EQ(small.at(k)->has(edge(2, 3)), large.at(k)->has(edge(2, 3)));
  }
}

/// A schedule of any kind with random events in the first 60 rounds.
Schedule random_schedule(std::uint64_t seed) {
  Stream stream = Seed{seed}.stream(Purpose{"schedule case"});
  const std::size_t agents = 2 + stream.below(6);
  std::vector<LinkEvent> events(stream.below(4));
  for (LinkEvent& event : events) {
    event.round = static_cast<Round>(stream.below(60));
    event.heal = stream.uniform() < 0.4;
    event.edges = {edge(1, 2), edge(2, 1)};
  }
  Schedule::Spec spec = RandomPairs{1, static_cast<Round>(1 + stream.below(6))};
  const std::uint64_t kind = stream.below(4);
  if (kind == 0) spec = RandomLinks{shared(cases::random_graph(stream, agents, 0.7)), stream.uniform()};
  if (kind == 1 || kind == 2) {
    FixedSchedule list;
    list.periodic = kind == 1;
    for (std::uint64_t i = 0; i <= stream.below(4); ++i) {
      list.intervals.push_back({shared(cases::random_graph(stream, agents, 0.6)), static_cast<Round>(1 + stream.below(7))});
    }
    spec = list;
  }
  return Schedule(agents, spec, events, Seed{seed});
}

TEST(Schedule, IsAPureFunctionOfTheRound) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const Schedule forward = random_schedule(seed), jumping = random_schedule(seed);
    std::vector<Schedule::Segment> expected;
    for (Round k = 0; k < 100; ++k) expected.push_back(forward.segment(k));
    Stream stream = Seed{seed}.stream(Purpose{"questions"});
    for (const std::size_t k : cases::random_order(stream, 100)) {
      SCOPED_TRACE(k);
      const auto segment = jumping.segment(static_cast<Round>(k));
      ASSERT_EQ(segment.first, expected[k].first);
      ASSERT_EQ(segment.last, expected[k].last);
      ASSERT_TRUE(segment.first <= k && k <= segment.last);
      ASSERT_EQ(*segment.graph, *expected[k].graph);
    }
  }
}

TEST(Schedule, GivesEveryThreadTheSame) {
  for (const std::uint64_t seed : {0, 1, 2, 3, 4, 5, 6, 7}) {
    SCOPED_TRACE(seed);
    const Schedule oracle = random_schedule(seed), asked = random_schedule(seed);
    std::vector<Graph> expected;
    for (Round k = 0; k < 300; ++k) expected.push_back(*oracle.at(k));
    std::array<int, 4> wrong{};
    std::vector<std::thread> threads;
    for (std::uint64_t t = 0; t < wrong.size(); ++t) {
      threads.emplace_back([&, t] {
        Stream stream = Seed{t}.stream(Purpose{"questions"});
        const Schedule copy = asked;  // copies share the memory
        for (const std::size_t k : cases::random_order(stream, expected.size())) wrong[t] += *copy.at(static_cast<Round>(k)) != expected[k];
      });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, (std::array<int, 4>{}));
  }
}

TEST(Schedule, UnionAndSupportCoverEveryRound) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const Schedule schedule = random_schedule(seed);
    Stream stream = Seed{seed}.stream(Purpose{"windows"});
    const auto first = static_cast<Round>(stream.below(50));
    const auto window = static_cast<Round>(1 + stream.below(50));
    std::vector<Graph> graphs;
    for (Round k = first; k < first + window; ++k) graphs.push_back(*schedule.at(k));
    ASSERT_EQ(schedule.union_over(first, window), union_of(graphs));
    const Graph support = *schedule.support(first + window);
    for (const Graph& graph : graphs) ASSERT_EQ(union_of(std::vector{support, graph}), support);
  }
}

TEST(Support, IsWhatMayBeDrawnNotWhatWas) {
  EXPECT_EQ(*Schedule(5, RandomPairs{}, {}, Seed{1}).support(1), complete(5));
  EXPECT_EQ(*Schedule(5, RandomLinks{shared(ring(5)), 0.01}, {}, Seed{1}).support(1), ring(5));
  EXPECT_EQ(*fixed({{shared(ring(5)), 3}, {shared(star(5)), 3}}).support(3), ring(5));
  EXPECT_EQ(*fixed({{shared(ring(5)), 3}, {shared(star(5)), 3}}).support(4), union_of(std::vector{ring(5), star(5)}));
  EXPECT_EQ(Schedule(5, RandomPairs{}, {}, Seed{1}).support(0)->edge_count(), 0U);
  EXPECT_EQ(fixed({{shared(ring(5)), 3}}).union_over(2, 0), of_edges(5, {}));
  // Cut from the beginning and healed in round 5.
  const Schedule healed(5, RandomPairs{}, {{0, {edge(1, 2)}, false}, {5, {edge(1, 2)}, true}}, Seed{1});
  EXPECT_EQ(healed.support(5)->edge_count(), 19U);
  EXPECT_EQ(*healed.support(6), complete(5));
}

TEST(Support, IsTheGraphItselfWhereThatStays) {
  const Schedule constant = fixed({{shared(ring(5)), 1}});
  EXPECT_EQ(constant.support(7), constant.at(0)) << "one object: nothing is copied";
  const auto base = shared(complete(6));
  EXPECT_EQ(Schedule(6, RandomLinks{base, 0.5}, {{3, {edge(1, 2)}, false}}, Seed{1}).support(9), base);
}

TEST(Support, OfOneGraphUnderEventsEqualsTheUnionOverAllRounds) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"events"});
    std::vector<LinkEvent> events;
    for (std::uint64_t e = 0, count = stream.below(12); e < count; ++e) {
      const auto from = 1 + static_cast<std::uint32_t>(stream.below(4)), to = 1 + static_cast<std::uint32_t>(stream.below(4));
      if (from != to) events.push_back({static_cast<Round>(stream.below(4)), {edge(from, to)}, stream.below(3) == 0});
    }
    std::map<AgentId, Attendance> presence;
    if (stream.below(2) == 0) presence[AgentId{2}] = {static_cast<Round>(stream.below(6)), 8};
    const auto rounds = static_cast<Round>(1 + stream.below(6));
    const FixedSchedule spec{{{shared(complete(4)), 1}}, false};
    const Schedule schedule(4, spec, events, Seed{1}, presence);
    ASSERT_EQ(*schedule.support(rounds), schedule.union_over(0, rounds));
    ASSERT_EQ(*Schedule(4, RandomPairs{}, events, Seed{1}, presence).support(rounds), schedule.union_over(0, rounds));
  }
}

TEST(Union, OverTheWholeTimeOfAPeriodicScheduleLooksAtOnePeriodOnly) {
  const Schedule schedule = fixed({{shared(ring(4)), 1}, {shared(star(4)), 1}}, true, {{4'000'000'000U, {edge(1, 3)}, false}});
  EXPECT_EQ(schedule.union_over(0, kForEver), union_of(std::vector{ring(4), star(4)}));
}

}  // namespace
}  // namespace consort
