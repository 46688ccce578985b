#include "orchestrator/run/placement.hpp"

#include <gtest/gtest.h>

#include <set>

namespace consort {
namespace {

Experiment experiment_on(Graph graph, std::size_t agents_per_process = 1) {
  Experiment experiment;
  experiment.agents = graph.agents();
  experiment.rounds = 10;
  experiment.agents_per_process = agents_per_process;
  experiment.topology = FixedSchedule{{{std::make_shared<const Graph>(std::move(graph)), 1}}, false};
  return experiment;
}

TEST(Placement, OneAgentPerProcessMeetsItsNeighboursOnly) {
  const Placement placement = place(experiment_on(directed_ring(5)));
  ASSERT_EQ(placement.processes.size(), 5u);
  EXPECT_EQ(placement.processes[2].agents, std::vector<AgentId>{AgentId{3}});
  EXPECT_EQ(placement.processes[2].neighbours, (std::vector<std::size_t>{1, 3}))
      << "both directions: whoever starts first is found by the other";
  for (const auto& readers : placement.readers) EXPECT_EQ(readers.size(), 1u);
  EXPECT_FALSE(placement.multicast_data);
}

TEST(Placement, HostedNeighboursNeedNoReader) {
  const Placement placement = place(experiment_on(ring(7), 3));
  ASSERT_EQ(placement.processes.size(), 3u);
  EXPECT_EQ(placement.processes[2].agents, std::vector<AgentId>{AgentId{7}});
  EXPECT_EQ(placement.readers, (std::vector<std::vector<std::size_t>>{{2}, {}, {1}, {0}, {}, {2}, {0, 1}}));
  EXPECT_EQ(placement.process_of, (std::vector<std::size_t>{0, 0, 0, 1, 1, 1, 2}));
}

TEST(Placement, SaysOfRandomGraphsWhoReadsAndMeetsWhom) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE(seed);
    const Graph graph = erdos_renyi(12, 0.02 * static_cast<double>(seed % 30), true, Seed{seed});
    const Placement placement = place(experiment_on(graph, 1 + seed % 4));
    const std::size_t processes = placement.processes.size();
    std::vector<std::set<std::size_t>> readers(12), meets(processes);
    for (const auto& [edge, weight] : graph.edges()) {
      const std::size_t from = placement.process_of[index_of(edge.from)], to = placement.process_of[index_of(edge.to)];
      if (from == to) continue;
      readers[index_of(edge.from)].insert(to);
      meets[from].insert(to);
      meets[to].insert(from);
    }
    for (std::size_t i = 0; i < 12; ++i) ASSERT_EQ(placement.readers[i], std::vector(readers[i].begin(), readers[i].end()));
    for (std::size_t p = 0; p < processes; ++p) ASSERT_EQ(placement.processes[p].neighbours, std::vector(meets[p].begin(), meets[p].end()));
  }
}

TEST(Placement, WhoJoinsLaterSharesNoProcessWithWhoIsThere) {
  Experiment experiment = experiment_on(ring(7), 3);
  experiment.presence[AgentId{2}] = {10};
  experiment.presence[AgentId{6}] = {20};
  experiment.presence[AgentId{7}] = {20};
  const Placement placement = place(experiment);
  ASSERT_EQ(placement.processes.size(), 4u);
  EXPECT_EQ(placement.processes[1].agents, std::vector<AgentId>{AgentId{2}});
  EXPECT_EQ(placement.processes[1].presence.from, 10u);
  EXPECT_EQ(placement.processes[3].agents, (std::vector<AgentId>{AgentId{6}, AgentId{7}}));
  EXPECT_EQ(placement.processes[3].presence.from, 20u);
}

TEST(Placement, DiscoveryFollowsSizeAndDensityUnlessTheFileSaysOtherwise) {
  EXPECT_FALSE(place(experiment_on(ring(10))).neighbour_discovery);
  EXPECT_TRUE(place(experiment_on(ring(100))).neighbour_discovery);
  EXPECT_FALSE(place(experiment_on(complete(100))).neighbour_discovery);
  EXPECT_TRUE(place(experiment_on(complete(100))).multicast_data);
  EXPECT_TRUE(place(experiment_on(complete(10))).multicast_data);
  EXPECT_FALSE(place(experiment_on(star(10))).multicast_data) << "only the middle has many readers";
  Experiment told = experiment_on(ring(100));
  told.discovery = Discovery::multicast;
  EXPECT_FALSE(place(told).neighbour_discovery);
  told = experiment_on(ring(10));
  told.discovery = Discovery::neighbours;
  EXPECT_TRUE(place(told).neighbour_discovery);
}

TEST(Placement, WhoHearsEveryoneIsKnown) {
  const Placement placement = place(experiment_on(star(4)));
  EXPECT_TRUE(hears_everyone(placement, AgentId{1}));
  EXPECT_FALSE(hears_everyone(placement, AgentId{2}));
}

}  // namespace
}  // namespace consort
