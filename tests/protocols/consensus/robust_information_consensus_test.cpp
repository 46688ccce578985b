#include "protocols/consensus/robust_information_consensus.hpp"

#include "core/math/decompositions.hpp"
#include "tests/support/direct.hpp"

#include <gtest/gtest.h>

#include <map>

namespace consort {
namespace {

using Spec = RobustInformationConsensus<Eigen::Dynamic>;
constexpr std::uint64_t kSeeds = 200;

/// Agents with random information, and what is under way between them.
struct Swarm {
  explicit Swarm(std::uint64_t seed_value, std::size_t most = 6)
      : seed{seed_value}, stream(seed.stream(Purpose{"robust consensus"})), agents(2 + stream.below(most - 1)) {
    const auto n = static_cast<Eigen::Index>(1 + stream.below(3));
    for (std::size_t i = 0; i < agents; ++i) {
      x.push_back(direct::random_vector(stream, n));
      P.push_back(direct::random_spd(stream, n));
      Values initial;
      initial.set("x", x.back());
      initial.set("P", P.back());
      states.push_back(Spec::init({}, Setup{agent_at(i), agents, 1.0, initial}));
    }
  }

  /// `deliver(edge, k)`: the rounds after which copies of the message of round k arrive.
  template <class Deliver>
  void round(Round k, const Graph& graph, Deliver deliver) {
    std::vector<Spec::Message> sent;
    for (std::size_t i = 0; i < agents; ++i) sent.push_back(Spec::message({}, states[i], sense(k, graph, i)));
    for (const auto& [edge, weight] : graph.edges())
      for (const Round late : deliver(edge, k))
        under_way.emplace(std::pair{k + late, edge}, Heard<Spec::Message>{edge.from, k, 1.0, sent[index_of(edge.from)]});
    for (std::size_t i = 0; i < agents; ++i) {
      std::map<AgentId, Heard<Spec::Message>> newest;
      for (auto it = under_way.begin(); it != under_way.end();) {
        if (it->first.first != k || it->first.second.to != agent_at(i)) {
          ++it;
          continue;
        }
        const auto known = newest.find(it->second.from);
        if (known == newest.end() || known->second.sent < it->second.sent) newest.insert_or_assign(it->second.from, it->second);
        it = under_way.erase(it);
      }
      std::vector<Heard<Spec::Message>> inbox;
      for (const auto& [from, message] : newest) inbox.push_back(message);
      Spec::transition({}, states[i], sense(k, graph, i), inbox);
    }
  }

  static Sense sense(Round k, const Graph& graph, std::size_t i) {
    return {k, 1.0, graph.in_neighbours(agent_at(i)), graph.out_degree(agent_at(i)), {}, agent_at(i)};
  }

  [[nodiscard]] Spec::Mass held() const {
    Spec::Mass total = states[0].s;
    for (std::size_t i = 1; i < agents; ++i) total += states[i].s;
    return total;
  }
  /// What agents hold and what waits on the edges of a graph that does not switch: sigma_j - rho_ij.
  [[nodiscard]] Spec::Mass total(const Graph& graph) const {
    Spec::Mass sum = held();
    for (const auto& [edge, weight] : graph.edges()) {
      sum += states[index_of(edge.from)].sigma;
      for (const auto& incoming : states[index_of(edge.to)].from)
        if (incoming.from == edge.from && incoming.heard) sum -= incoming.rho;
    }
    return sum;
  }
  [[nodiscard]] Vector centralised() const {
    Matrix Y = Matrix::Zero(P[0].rows(), P[0].rows());
    Vector y = Vector::Zero(P[0].rows());
    for (std::size_t i = 0; i < agents; ++i) {
      Y += inverse(P[i], "P_i");
      y += inverse(P[i], "P_i") * x[i];
    }
    return inverse(Y, "Y") * y;
  }

  Seed seed;
  Stream stream;
  std::size_t agents;
  std::vector<Vector> x;
  std::vector<Matrix> P;
  std::vector<Spec::State> states;
  std::multimap<std::pair<Round, Edge>, Heard<Spec::Message>> under_way;
};

double far(const Spec::Mass& a, const Spec::Mass& b) { return (a.Y - b.Y).cwiseAbs().maxCoeff() + (a.y - b.y).cwiseAbs().maxCoeff(); }
double size(const Spec::Mass& a) { return a.Y.cwiseAbs().maxCoeff() + a.y.cwiseAbs().maxCoeff(); }

TEST(RobustInformationConsensus, KeepsAllMassWithWhatIsOnItsWayHoweverMessagesAreLostDelayedAndRepeated) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Swarm swarm(seed);
    const Graph graph = direct::random_strong_graph(swarm.stream, swarm.agents);
    const double loss = swarm.stream.uniform(0.0, 0.8);
    const Spec::Mass before = swarm.held();
    double scale = size(before);
    for (Round k = 0; k < 150; ++k) {
      swarm.round(k, graph, [&](Edge, Round) {
        std::vector<Round> copies;
        if (swarm.stream.uniform() >= loss) copies.push_back(static_cast<Round>(swarm.stream.below(4)));
        if (!copies.empty() && swarm.stream.uniform() < 0.3) copies.push_back(static_cast<Round>(swarm.stream.below(6)));
        return copies;
      });
      for (const auto& state : swarm.states) scale = std::max(scale, size(state.sigma));
      ASSERT_LT(far(swarm.total(graph), before), 1e-12 * scale) << "round " << k;
      for (const auto& state : swarm.states) ASSERT_GT(symmetric_eigenvalues(state.s.Y)[0], 0.0) << "round " << k;
    }
  }
}

TEST(RobustInformationConsensus, KeepsAllMassOnGraphsThatChangeAsLongAsNothingIsLost) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Swarm swarm(seed);
    const Spec::Mass before = swarm.held();
    for (Round k = 0; k < 100; ++k) {
      swarm.round(k, direct::random_strong_graph(swarm.stream, swarm.agents), [](Edge, Round) { return std::vector<Round>{0}; });
      ASSERT_LT(far(swarm.held(), before), 1e-11 * size(before)) << "round " << k;
    }
    for (const auto& state : swarm.states) ASSERT_LT((state.x - swarm.centralised()).norm(), 1e-8);
  }
}

TEST(RobustInformationConsensus, NeverGainsInformationWhenSwitchingAndLossComeTogether) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Swarm swarm(seed);
    const Spec::Mass before = swarm.held();
    for (Round k = 0; k < 60; ++k) {
      const Graph graph = direct::random_strong_graph(swarm.stream, swarm.agents);
      swarm.round(k, graph, [&](Edge, Round) { return std::vector<Round>(swarm.stream.uniform() < 0.3 ? 0 : 1, Round{0}); });
      const Matrix gone = before.Y - swarm.held().Y;
      ASSERT_GT(symmetric_eigenvalues(gone)[0], -1e-11 * size(before)) << "round " << k;
    }
  }
}

TEST(RobustInformationConsensus, ReachesTheCentralisedEstimateAtEveryLoss) {
  for (const double loss : {0.0, 0.3, 0.6, 0.9}) {
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      SCOPED_TRACE(testing::Message() << "loss " << loss << ", seed " << seed);
      Swarm swarm(seed, 5);
      const Graph graph = direct::random_strong_graph(swarm.stream, swarm.agents);
      for (Round k = 0; k < 3000; ++k)
        swarm.round(k, graph, [&](Edge, Round) { return std::vector<Round>(swarm.stream.uniform() < loss ? 0 : 1, Round{0}); });
      for (const auto& state : swarm.states) ASSERT_LT((state.x - swarm.centralised()).norm(), 1e-6);
    }
  }
}

/// Two agents with information 1 each, of which 2 -> 1 is at hand message by message.
struct Pair {
  Pair() {
    for (std::size_t i = 0; i < 2; ++i) {
      Values initial;
      initial.set("x", static_cast<double>(i));
      states.push_back(Spec::init({}, Setup{agent_at(i), 2, 1.0, initial}));
    }
  }
  Spec::Message speak(Round k) {
    const Sense sense = Swarm::sense(k, graph, 1);
    const Spec::Message message = Spec::message({}, states[1], sense);
    Spec::transition({}, states[1], sense, {});
    return message;
  }
  double hear(Round k, std::vector<Heard<Spec::Message>> inbox) {
    const Sense sense = Swarm::sense(k, graph, 0);
    const double kept = states[0].s.Y(0, 0) / (1.0 + static_cast<double>(sense.out_degree));
    Spec::transition({}, states[0], sense, inbox);
    return states[0].s.Y(0, 0) - kept;
  }
  Graph graph = complete(2);
  std::vector<Spec::State> states;
};

TEST(RobustInformationConsensus, RecoversWhatWasLostWithTheNextMessage) {
  Pair pair;
  pair.speak(0);
  EXPECT_EQ(pair.hear(0, {}), 0.0);
  pair.speak(1);
  EXPECT_EQ(pair.hear(1, {}), 0.0);
  EXPECT_EQ(pair.hear(2, {{AgentId{2}, 2, 1.0, pair.speak(2)}}), 0.875);  // 1/2 + 1/4 + 1/8
}

TEST(RobustInformationConsensus, IgnoresMessagesThatAreOvertakenOrRepeated) {
  Pair pair;
  const Heard<Spec::Message> first{AgentId{2}, 0, 1.0, pair.speak(0)}, second{AgentId{2}, 1, 1.0, pair.speak(1)};
  pair.hear(0, {});
  EXPECT_EQ(pair.hear(1, {second}), 0.75);
  EXPECT_EQ(pair.hear(2, {first}), 0.0);
  EXPECT_EQ(pair.hear(3, {second}), 0.0);
}

TEST(RobustInformationConsensus, TakesNoneOfWhatWasGivenBeforeAnEdgeWasThere) {
  Pair pair;
  pair.graph = Graph(3, std::vector<Edge>{{AgentId{2}, AgentId{3}}});
  pair.speak(0);  // to agent 3
  pair.hear(0, {});
  pair.graph = complete(2);
  EXPECT_EQ(pair.hear(1, {{AgentId{2}, 1, 1.0, pair.speak(1)}}), 0.25);
}

TEST(RobustInformationConsensus, TakesAllFromASenderThatBeganAfterTheEdgeWasThere) {
  Pair pair;  // agent 2 joins in round 5 and its first message is lost
  pair.speak(5);
  pair.hear(5, {});
  EXPECT_EQ(pair.hear(6, {{AgentId{2}, 6, 1.0, pair.speak(6)}}), 0.75);
}

TEST(RobustInformationConsensus, BeginsAnewWithASenderThatBeganAnew) {
  Pair pair;
  pair.hear(0, {{AgentId{2}, 0, 1.0, pair.speak(0)}});
  pair.states[1] = Pair().states[1];  // its process was started again
  EXPECT_EQ(pair.hear(1, {{AgentId{2}, 1, 1.0, pair.speak(1)}}), 0.5);
}

TEST(RobustInformationConsensus, IsDisturbedByTheNewestNoiseAlone) {
  Pair pair;
  double sum = 0.0;
  for (Round k = 0; k < 10; ++k) {
    Spec::Message message = pair.speak(k);
    message.y[0] += 0.1;
    const double before = pair.states[0].s.y[0] / 2.0;
    pair.hear(k, {{AgentId{2}, k, 1.0, message}});
    sum += pair.states[0].s.y[0] - before;
  }
  EXPECT_NEAR(sum, 0.1 + pair.states[1].sigma.y[0], 1e-12);
}

TEST(RobustInformationConsensus, KeepsTheLastOfItsInformationWhenItHearsNobodyForEver) {
  Pair pair;
  const double x = pair.states[0].x[0];
  for (Round k = 0; k < 3000; ++k) pair.hear(k, {});
  EXPECT_NEAR(pair.states[0].x[0], x, 1e-12);
  EXPECT_GT(pair.states[0].s.Y(0, 0), 0.0);
  const auto given = pair.states[0].sigma.Y(0, 0);
  pair.hear(3000, {});
  EXPECT_EQ(pair.states[0].sigma.Y(0, 0), given) << "and gives none of it away";
}

}  // namespace
}  // namespace consort
