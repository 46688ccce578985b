// Huang, Jiang, Zhao, Cheng, Wu 2025, Algorithm 1, with agents that know nothing but what they measure and hear.

#include "protocols/everybody/acyclic_graph.hpp"

#include "core/random.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <queue>
#include <set>
#include <utility>

namespace consort {
namespace {

using Pair = std::pair<unsigned, unsigned>;
using Use = AcyclicSensing::Use;

/// Agents, who measures whom, who knows its position, and who hears whom.
struct Team {
  std::size_t agents = 0;
  std::set<Pair> measures;  // (measurer, measured)
  std::set<unsigned> absolute;
  std::vector<double> ids;
  Graph communication;
  std::set<unsigned> absent = {};
};

/// All agents of a team, moved round by round with messages alone.
class Sensing {
 public:
  explicit Sensing(const Team& team, Round patience = 0) {
    for (unsigned i = 1; i <= team.agents; ++i)
      agents_.emplace_back(AgentId{i}, team.agents, team.ids[i - 1], team.absolute.count(i) > 0, patience);
  }
  /// `arrives` says whether a message does (default: all do).
  void round(
      const Team& team, const std::function<bool()>& arrives = [] { return true; }) {
    std::vector<AcyclicSensing::Says> said;
    for (const AcyclicSensing& agent : agents_) said.push_back(agent.says());
    for (unsigned i = 1; i <= team.agents; ++i) {
      if (team.absent.count(i) > 0) continue;
      std::vector<Neighbour> neighbours;
      std::vector<AcyclicSensing::Told> heard;
      std::vector<char> measures(team.agents, 0);
      for (unsigned j = 1; j <= team.agents; ++j) measures[j - 1] = team.measures.count({i, j}) > 0 && team.absent.count(j) == 0 ? 1 : 0;
      for (const Neighbour& j : team.communication.in_neighbours(AgentId{i})) {
        if (team.absent.count(j.id.value) > 0) continue;
        neighbours.push_back(j);
        if (arrives()) heard.push_back({j.id, said[index_of(j.id)], team.measures.count({j.id.value, i}) > 0});
      }
      agents_[i - 1].absorb(k_, neighbours, measures, heard);
    }
    ++k_;
  }
  /// Rounds until everybody that is there says that it is done; nothing if that takes too long.
  std::optional<Round> until_done(const Team& team, Round most) {
    for (Round r = 0; r < most; ++r) {
      round(team);
      bool done = true;
      for (unsigned i = 1; i <= team.agents; ++i) done = done && (team.absent.count(i) > 0 || agents_[i - 1].done());
      if (done) return r + 1;
    }
    return std::nullopt;
  }
  [[nodiscard]] const AcyclicSensing& of(unsigned i) const { return agents_[i - 1]; }
  [[nodiscard]] std::set<Pair> uses(const Team& team, bool only_done = false) const {
    std::set<Pair> out;
    for (unsigned i = 1; i <= team.agents; ++i)
      for (unsigned j = 1; j <= team.agents; ++j)
        if (team.absent.count(i) == 0 && (!only_done || of(i).done()) && of(i).use(AgentId{j}) == Use::mine) out.insert({i, j});
    return out;
  }
  [[nodiscard]] std::vector<std::size_t> layers() const {
    std::vector<std::size_t> out;
    for (const AcyclicSensing& agent : agents_) out.push_back(agent.layer());
    return out;
  }

 private:
  std::vector<AcyclicSensing> agents_;
  Round k_ = 0;
};

std::set<Pair> undirected(const Team& team) {
  std::set<Pair> out;
  for (const auto& [i, j] : team.measures)
    if (team.absent.count(i) + team.absent.count(j) == 0) out.insert({std::min(i, j), std::max(i, j)});
  return out;
}

bool acyclic(const std::set<Pair>& uses, std::size_t agents) {
  std::vector<std::size_t> open(agents + 1, 0);
  for (const auto& [user, other] : uses) ++open[user];
  std::queue<unsigned> ready;
  for (unsigned i = 1; i <= agents; ++i)
    if (open[i] == 0) ready.push(i);
  std::size_t ordered = 0;
  for (; !ready.empty(); ready.pop(), ++ordered)
    for (const auto& [user, other] : uses)
      if (other == ready.front() && --open[user] == 0) ready.push(user);
  return ordered == agents;
}

/// Hop distances to the absolute agents over sensing links of either direction, by breadth-first search.
std::vector<std::size_t> distances(const Team& team) {
  std::vector<std::size_t> out(team.agents, team.agents);
  std::queue<unsigned> next;
  for (const unsigned i : team.absolute) {
    if (team.absent.count(i) > 0) continue;
    out[i - 1] = 0;
    next.push(i);
  }
  for (; !next.empty(); next.pop())
    for (const auto& [i, j] : undirected(team))
      for (const auto& [from, to] : {Pair{i, j}, Pair{j, i}})
        if (from == next.front() && out[to - 1] == team.agents) {
          out[to - 1] = out[from - 1] + 1;
          next.push(to);
        }
  return out;
}

/// Sensing links of a random team are communication links both ways; a ring makes the communication strongly connected.
Team random_team(std::uint64_t seed) {
  Stream stream = Seed{seed}.stream(Purpose{"sensing"});
  Team team;
  team.agents = 2 + stream.below(9);
  std::vector<Edge> edges;
  const auto n = static_cast<unsigned>(team.agents);
  for (unsigned i = 1; i <= n; ++i) {
    edges.push_back({AgentId{i}, AgentId{i % n + 1}});
    team.ids.push_back(static_cast<double>(stream.below(1000)));
    for (unsigned j = 1; j <= n; ++j)
      if (i != j && stream.uniform() < 0.3) {
        team.measures.insert({i, j});
        edges.push_back({AgentId{i}, AgentId{j}});
        edges.push_back({AgentId{j}, AgentId{i}});
      }
    if (stream.uniform() < 0.2) team.absolute.insert(i);
  }
  if (team.absolute.empty()) team.absolute.insert(1 + static_cast<unsigned>(stream.below(n)));
  team.communication = Graph(n, std::span<const Edge>(edges));
  return team;
}

void expect_sound(const Sensing& run, const Team& team) {
  const auto uses = run.uses(team);
  EXPECT_TRUE(acyclic(uses, team.agents));
  EXPECT_EQ(uses.size(), undirected(team).size()) << "as many edges as before";
  for (const auto& [user, other] : uses) EXPECT_TRUE(undirected(team).count({std::min(user, other), std::max(user, other)}) > 0);
  const auto expected = distances(team);
  for (unsigned i = 1; i <= team.agents; ++i) {
    if (team.absent.count(i) > 0) continue;
    EXPECT_EQ(run.of(i).layer(), expected[i - 1]) << i;
    EXPECT_EQ(run.of(i).grounded(), expected[i - 1] < team.agents);
    if (expected[i - 1] == 0 || expected[i - 1] == team.agents) continue;
    bool lower = false;
    for (const auto& [user, other] : uses) lower = lower || (user == i && expected[other - 1] + 1 == expected[i - 1]);
    EXPECT_TRUE(lower) << "agent " << i << " uses nobody of the layer below";
  }
}

TEST(AcyclicSensing, IsSoundOnRandomGraphsAndEndsInBoundedRounds) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    const Team team = random_team(seed);
    Sensing run(team);
    const auto rounds = run.until_done(team, static_cast<Round>(2 * team.agents + 1));
    ASSERT_TRUE(rounds);
    EXPECT_LE(*rounds, 2 * team.agents + 1);
    expect_sound(run, team);
  }
}

TEST(AcyclicSensing, IsSoundAgainAfterAnAgentHasLeft) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    Team team = random_team(seed);
    if (team.agents < 3) continue;
    // the news must still reach everybody: an undirected ring of messages around whoever leaves
    team.communication = complete(team.agents);
    Sensing run(team);
    ASSERT_TRUE(run.until_done(team, 100));
    team.absent.insert(1 + static_cast<unsigned>(seed % team.agents));
    run.round(team);
    ASSERT_TRUE(run.until_done(team, static_cast<Round>(2 * team.agents + 1)));
    expect_sound(run, team);
    team.absent.clear();
    run.round(team);
    ASSERT_TRUE(run.until_done(team, static_cast<Round>(2 * team.agents + 1)));
    expect_sound(run, team);
  }
}

TEST(AcyclicSensing, WhatDoneAgentsUseIsAcyclicInEveryRoundOfAChange) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    Team team = random_team(seed);
    Sensing run(team);
    for (Round k = 0; k < 12 * team.agents; ++k) {
      if (k == 4 * team.agents) team.absent.insert(1 + static_cast<unsigned>(seed % team.agents));
      if (k == 8 * team.agents) team.absent.clear();
      run.round(team);
      ASSERT_TRUE(acyclic(run.uses(team, true), team.agents)) << "round " << k;
    }
  }
}

TEST(AcyclicSensing, PatienceCoversMessagesThatAreLost) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    const Team team = random_team(seed);
    Stream stream = Seed{seed}.stream(Purpose{"loss"});
    Sensing run(team, 100);
    for (Round k = 0; k < 300; ++k) {
      run.round(team, [&] { return stream.uniform() >= 0.3; });
      ASSERT_TRUE(acyclic(run.uses(team, true), team.agents)) << "round " << k;
    }
    for (unsigned i = 1; i <= team.agents; ++i) EXPECT_TRUE(run.of(i).done()) << i;
    expect_sound(run, team);
  }
}

TEST(AcyclicSensing, NobodyIsDoneBeforeTheLayersAreFinal) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    const Team team = random_team(seed);
    const auto expected = distances(team);
    Sensing run(team);
    for (Round k = 0; k < 3 * team.agents; ++k) {
      run.round(team);
      for (unsigned i = 1; i <= team.agents; ++i)
        if (run.of(i).done()) {
          ASSERT_EQ(run.of(i).layer(), expected[i - 1]);
        }
    }
  }
}

Team six(std::set<Pair> measures) { return {6, std::move(measures), {2}, {10, 20, 30, 40, 50, 60}, ring(6)}; }

TEST(AcyclicSensing, GoldenCaseOfTheCycleOfSix) {
  const Team team = six({{1, 2}, {2, 3}, {3, 4}, {4, 5}, {5, 6}, {6, 1}});
  Sensing run(team);
  ASSERT_TRUE(run.until_done(team, 20));
  EXPECT_EQ(run.layers(), (std::vector<std::size_t>{1, 0, 1, 2, 3, 2}));
  EXPECT_EQ(run.uses(team), (std::set<Pair>{{1, 2}, {3, 2}, {4, 3}, {5, 4}, {5, 6}, {6, 1}}));
}

TEST(AcyclicSensing, GoldenCaseOfThePublication) {
  const Team team = six({{1, 2}, {2, 3}, {4, 3}, {5, 4}, {6, 5}});
  Sensing run(team);
  ASSERT_TRUE(run.until_done(team, 20));
  EXPECT_EQ(run.layers(), (std::vector<std::size_t>{1, 0, 1, 2, 3, 4}));
  EXPECT_EQ(run.uses(team), (std::set<Pair>{{1, 2}, {3, 2}, {4, 3}, {5, 4}, {6, 5}}));
}

TEST(AcyclicSensing, TwoAgentsThatMeasureEachOtherShareOneEdgeAndEqualIdsAreToldApart) {
  Team team{3, {{1, 2}, {2, 1}, {3, 1}, {3, 2}}, {3}, {7, 7, 7}, complete(3)};
  Sensing run(team);
  ASSERT_TRUE(run.until_done(team, 10));
  EXPECT_EQ(run.uses(team), (std::set<Pair>{{1, 3}, {2, 3}, {2, 1}}));
  team.ids = {8, 7, 7};
  Sensing other(team);
  ASSERT_TRUE(other.until_done(team, 10));
  EXPECT_EQ(other.uses(team), (std::set<Pair>{{1, 3}, {2, 3}, {1, 2}})) << "the larger id uses the edge";
}

TEST(AcyclicSensing, WhoeverReachesNoAbsolutePositionEndsToo) {
  Team team{4, {{1, 2}, {3, 4}}, {1}, {1, 2, 3, 4}, complete(4)};
  Sensing run(team);
  ASSERT_TRUE(run.until_done(team, 10));
  EXPECT_TRUE(run.of(2).grounded());
  EXPECT_FALSE(run.of(3).grounded());
  EXPECT_FALSE(run.of(4).grounded());
  team.absent.insert(1);  // layers that nobody supports any more must not linger
  run.round(team);
  ASSERT_TRUE(run.until_done(team, 10));
  EXPECT_FALSE(run.of(2).grounded());
}

TEST(AcyclicSensing, PatienceMakesEverybodyWaitLonger) {
  const Team team = six({{1, 2}, {2, 3}, {4, 3}, {5, 4}, {6, 5}});
  Sensing hasty(team), patient(team, 5);
  EXPECT_EQ(*patient.until_done(team, 30), *hasty.until_done(team, 30) + 5);
}

}  // namespace
}  // namespace consort
