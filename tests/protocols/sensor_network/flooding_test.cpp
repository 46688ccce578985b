// The largest value of everybody present, found by messages (protocols/sensor_network/flooding.hpp).

#include "protocols/sensor_network/flooding.hpp"

#include "core/network/graph.hpp"
#include "tests/core/cases.hpp"

#include <gtest/gtest.h>

#include <optional>

namespace consort {
namespace {

/// Agents that flood over a graph; each may be absent.
class Swarm {
 public:
  Swarm(Graph graph, std::vector<Vector> own, Round rounds) : graph_(std::move(graph)), own_(std::move(own)), rounds_(rounds) {
    agents_.resize(own_.size());
  }
  void join(std::size_t i) { agents_[i].emplace(own_[i], rounds_); }
  void leave(std::size_t i) { agents_[i].reset(); }
  [[nodiscard]] std::size_t size() const { return agents_.size(); }
  [[nodiscard]] const std::optional<FloodedMaximum>& agent(std::size_t i) const { return agents_[i]; }

  void round() {
    const auto sent = agents_;
    for (std::size_t i = 0; i < agents_.size(); ++i) {
      if (!agents_[i]) continue;
      agents_[i]->begin();
      for (const Neighbour& j : graph_.in_neighbours(agent_at(i))) {
        const auto& from = sent[index_of(j.id)];
        if (from) agents_[i]->heard(view(from->largest()), view(from->ages()), 0);
      }
      agents_[i]->end();
    }
  }

  /// Largest values of those who are present and reach agent i over present agents.
  [[nodiscard]] Vector reference(std::size_t i) const {
    std::vector<char> seen(own_.size(), 0);
    std::vector<std::size_t> queue{i};
    seen[i] = 1;
    Vector largest = own_[i];
    while (!queue.empty()) {
      const std::size_t at = queue.back();
      queue.pop_back();
      largest = largest.cwiseMax(own_[at]);
      for (const Neighbour& j : graph_.in_neighbours(agent_at(at))) {
        if (!agents_[index_of(j.id)] || seen[index_of(j.id)] != 0) continue;
        seen[index_of(j.id)] = 1;
        queue.push_back(index_of(j.id));
      }
    }
    return largest;
  }

  /// Rounds of which nobody present may say that it is over with a value that is not the right one.
  void honest_rounds(Round count) {
    for (Round k = 0; k < count; ++k) {
      round();
      for (std::size_t i = 0; i < agents_.size(); ++i) {
        if (agents_[i] && agents_[i]->ended()) {
          ASSERT_EQ(agents_[i]->largest(), reference(i)) << "agent " << i + 1 << ", round " << k;
        }
      }
    }
  }
  void expect_right() const {
    for (std::size_t i = 0; i < agents_.size(); ++i) {
      if (!agents_[i]) continue;
      EXPECT_TRUE(agents_[i]->ended()) << "agent " << i + 1;
      EXPECT_EQ(agents_[i]->largest(), reference(i)) << "agent " << i + 1;
    }
  }

 private:
  static Eigen::Map<const Vector> view(const Vector& v) { return {v.data(), v.size()}; }
  Graph graph_;
  std::vector<Vector> own_;
  Round rounds_;
  std::vector<std::optional<FloodedMaximum>> agents_;
};

Swarm random_swarm(Stream& stream) {
  const std::size_t n = 2 + stream.below(14);
  const Graph graph = cases::random_graph(stream, n, stream.uniform(0.5, 3.0) / static_cast<double>(n));
  std::vector<Vector> own;
  for (std::size_t i = 0; i < n; ++i)  // some have nothing to say, and equal values occur
    own.push_back(Vector::NullaryExpr(3, [&] { return static_cast<double>(stream.below(4)) * stream.below(2); }));
  Swarm swarm(graph, own, static_cast<Round>(n));
  for (std::size_t i = 0; i < n; ++i) swarm.join(i);
  return swarm;
}

TEST(Flooding, EndsWithinItsBoundWithTheLargestValueOnRandomGraphs) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"flooding"});
    Swarm swarm = random_swarm(stream);
    const auto n = static_cast<Round>(swarm.size());
    swarm.honest_rounds(2 * n);
    swarm.expect_right();
  }
}

TEST(Flooding, EndsWithinItsBoundWithTheRestsLargestValueAfterSomebodyLeft) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"flooding"});
    Swarm swarm = random_swarm(stream);
    const auto n = static_cast<Round>(swarm.size());
    for (Round k = 0; k < 2 * n; ++k) swarm.round();
    swarm.leave(stream.below(n));
    for (Round k = 0; k < 3 * n; ++k) swarm.round();
    swarm.expect_right();
  }
}

TEST(Flooding, EndsWithinItsBoundAfterSomebodyJoined) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"flooding"});
    Swarm swarm = random_swarm(stream);
    const auto n = static_cast<Round>(swarm.size());
    const std::size_t late = stream.below(n);
    swarm.leave(late);
    for (Round k = 0; k < 2 * n; ++k) swarm.round();
    swarm.expect_right();
    swarm.join(late);
    for (Round k = 0; k < 2 * n; ++k) swarm.round();
    swarm.expect_right();
  }
}

TEST(Flooding, ForgetsTheLargestValueWhenItsOwnerLeavesARing) {
  Swarm swarm(directed_ring(6), {Vector{{1.0}}, Vector{{2.0}}, Vector{{9.0}}, Vector{{0.0}}, Vector{{5.0}}, Vector{{0.0}}}, 6);
  for (std::size_t i = 0; i < 6; ++i) swarm.join(i);
  for (int k = 0; k < 12; ++k) swarm.round();
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(swarm.agent(i)->largest(), Vector{{9.0}});
  swarm.leave(2);
  swarm.round();
  EXPECT_EQ(swarm.agent(1)->largest(), Vector{{9.0}}) << "nobody knows yet";
  for (int k = 0; k < 17; ++k) swarm.round();
  const std::vector<double> expected{5, 5, 0, 0, 5, 5};  // the ring is broken behind 3: 4 hears nobody
  for (const std::size_t i : {0U, 1U, 3U, 4U, 5U}) {
    EXPECT_EQ(swarm.agent(i)->largest(), Vector{{expected[i]}}) << i + 1;
    EXPECT_TRUE(swarm.agent(i)->ended());
  }
}

TEST(Flooding, SaysThatItHasNotEndedWhileALongPathIsStillOnItsWay) {
  std::vector<Vector> own(10, Vector{{0.0}});
  own[0][0] = 1.0;
  Swarm far(directed_ring(10), own, 10);
  for (std::size_t i = 0; i < 10; ++i) far.join(i);
  for (int k = 0; k < 9; ++k) {
    EXPECT_FALSE(far.agent(9)->ended());
    far.round();
  }
  EXPECT_EQ(far.agent(9)->largest(), Vector{{1.0}}) << "nine hops away";
  EXPECT_FALSE(far.agent(9)->ended());
}

}  // namespace
}  // namespace consort
