// One agent of the sensor network observer, and small networks of them, driven by hand.

#include "core/math/discretise.hpp"
#include "core/network/graph.hpp"
#include "protocols/adapter.hpp"
#include "protocols/registry.hpp"
#include "tests/support/beam_network.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace consort {
namespace {

/// A protocol that knows A and perhaps C.
struct Agent {
  std::unique_ptr<Protocol> protocol;
  Agent(unsigned self, std::size_t agents, Seconds dt, const Matrix& A, const Matrix& C, const Values& parameters,
        const Values& initial = {}) {
    Values model;
    model.set("A", A);
    if (C.rows() > 0) model.set("C", C);
    protocol = make_protocol(find_protocol("sensor_network_observer"), parameters,
                             Setup{.self = AgentId{self},
                                   .agents = agents,
                                   .dt = dt,
                                   .initial = initial,
                                   .model = model,
                                   .measurement_size = static_cast<std::size_t>(C.rows())},
                             0);
  }
  [[nodiscard]] Vector estimate() const {
    Vector out(static_cast<Eigen::Index>(protocol->estimate_layout().size()));
    protocol->estimate(std::span(out.data(), static_cast<std::size_t>(out.size())));
    return out;
  }
  [[nodiscard]] std::vector<double> message(Round k, Seconds dt) const {
    std::vector<double> payload(protocol->message_layout().size());
    protocol->emit(Sense{.k = k, .dt = dt, .in_neighbours = {}, .y = {}}, payload);
    return payload;
  }
};

Values beam_parameters(double R) {
  Values out;
  out.set("Q", Matrix(beam::process_noise().diagonal()));
  out.set("R", R);
  out.set("gamma", 1e4);
  out.set("alpha", 1.0);
  return out;
}

/// What an agent hears: an estimate, and nothing of a bound.
std::vector<double> payload_of(const Vector& z, Eigen::Index groups = 4) {
  std::vector<double> out(static_cast<std::size_t>(z.size() + 2 * groups), 0.0);
  std::copy(z.begin(), z.end(), out.begin());
  return out;
}

const Vector kZ{{1, -2, 3, -4, 5, -6, 7, -8}};

class BeamAgentThree : public testing::Test {
 protected:
  BeamAgentThree() : agent_(3, 6, kH, beam::dynamics(), beam::sensors()[2], beam_parameters(3e-6), start()) {
    const auto [network, observers] = beam::designed();
    E_ = matrix_exponential(network.A, kH);
    G_ = network.G[2];
    F_ = network.F[2];
  }
  static Values start() {
    Values out;
    out.set("x", Matrix(kZ));
    return out;
  }
  static constexpr Seconds kH = 1e-3;
  static constexpr double kY = 0.7;
  [[nodiscard]] Vector corrected() const { return kZ + kH * G_ * (Vector{{kY}} - beam::sensors()[2] * kZ); }
  void absorb(const std::vector<Neighbour>& scheduled, const std::vector<Received>& inbox) {
    agent_.protocol->absorb(
        Sense{.k = 5, .dt = kH, .in_neighbours = scheduled, .out_degree = 1, .y = std::span(&kY, 1), .self = AgentId{3}}, inbox);
  }
  Agent agent_;
  Matrix E_, G_, F_;
};

TEST_F(BeamAgentThree, CorrectsByItsSensorAndItsNeighboursThenMovesOn) {
  const std::vector<double> first = payload_of(2.0 * kZ), second = payload_of(Vector::Ones(8));
  absorb({{AgentId{1}, 1.0}, {AgentId{2}, 0.5}}, {{AgentId{1}, 5, 1.0, first}, {AgentId{2}, 5, 0.5, second}});
  const double d = 1.5;
  const Matrix S = (Matrix::Identity(8, 8) - matrix_exponential(-d * F_, kH)) / d;
  const Vector expected = E_ * (corrected() + S * (kZ + 0.5 * (Vector::Ones(8) - kZ)));
  EXPECT_LT((agent_.estimate().head(8) - expected).norm(), 1e-11 * expected.norm());
}

TEST_F(BeamAgentThree, TreatsAMissingMessageAsAnAbsentEdge) {
  const std::vector<double> first = payload_of(2.0 * kZ);
  absorb({{AgentId{1}, 1.0}, {AgentId{2}, 0.5}}, {{AgentId{1}, 5, 1.0, first}});
  const Matrix S = Matrix::Identity(8, 8) - matrix_exponential(-F_, kH);
  const Vector expected = E_ * (corrected() + S * kZ);
  EXPECT_LT((agent_.estimate().head(8) - expected).norm(), 1e-11 * expected.norm());
}

TEST_F(BeamAgentThree, GoesOnWithItsSensorWhenItHearsNobody) {
  absorb({{AgentId{1}, 1.0}}, {});
  EXPECT_LT((agent_.estimate().head(8) - E_ * corrected()).norm(), 1e-12 * kZ.norm());
}

TEST_F(BeamAgentThree, MovesADelayedEstimateOnToThePresent) {
  const std::vector<double> old = payload_of(2.0 * kZ);
  absorb({{AgentId{1}, 1.0}}, {{AgentId{1}, 2, 1.0, old}});
  const Matrix S = Matrix::Identity(8, 8) - matrix_exponential(-F_, kH);
  const Vector expected = E_ * (corrected() + S * (E_ * E_ * E_ * (2.0 * kZ) - kZ));
  EXPECT_LT((agent_.estimate().head(8) - expected).norm(), 1e-11 * expected.norm());
}

TEST_F(BeamAgentThree, SaysWhatItsNumbersAre) {
  const Layout estimate{{{"x", 8, 1}, {"alpha", 4, 1}, {"flooding", 1, 1}}};
  EXPECT_EQ(agent_.protocol->estimate_layout(), estimate);
  EXPECT_EQ(agent_.estimate().segment(8, 4), Vector::Ones(4));
  const Layout& message = agent_.protocol->message_layout();
  EXPECT_EQ(message.size(), 16U);
  EXPECT_EQ(message.noise_offset, 0U);
  EXPECT_EQ(message.noise_size, 8U);
}

TEST(SensorNetworkObserver, WithoutASensorFollowsItsNeighbourAtTheRateGammaOverAlpha) {
  Values parameters = beam_parameters(1);
  parameters.set("alpha", Matrix(Vector{{1, 2, 4, 8}}));
  Agent agent(5, 6, 1e-3, beam::dynamics(), Matrix(0, 8), parameters);
  const std::vector<double> heard = payload_of(kZ);
  const std::vector<Neighbour> scheduled{{AgentId{3}, 2.0}};
  const std::vector<Received> inbox{{AgentId{3}, 0, 2.0, heard}};
  agent.protocol->absorb(Sense{.k = 0, .dt = 1e-3, .in_neighbours = scheduled, .y = {}, .self = AgentId{5}}, inbox);
  const Matrix E = matrix_exponential(beam::dynamics(), 1e-3);
  Vector share(8);
  for (Eigen::Index c = 0; c < 8; ++c) share[c] = 1.0 - std::exp(-1e4 / std::pow(2.0, static_cast<double>(c / 2)) * 2.0 * 1e-3);
  EXPECT_LT((agent.estimate().head(8) - E * share.asDiagonal() * kZ).norm(), 1e-12 * kZ.norm());
}

// --- Algorithm 3.2 as messages ----------------------------------------------------------------------------------------------

/// Two unstable scalar groups, growing with rates .3 and .2; agents see the first, the second, or nothing.
class Growing {
 public:
  static constexpr Seconds kH = 0.01;
  explicit Growing(Graph graph, std::vector<Vector> sensors) : graph_(std::move(graph)), sensors_(std::move(sensors)) {
    agents_.resize(sensors_.size());
  }
  void join(std::size_t i) {
    const Matrix C = sensors_[i].isZero(0.0) ? Matrix(0, 2) : Matrix(sensors_[i].transpose());
    Values parameters;
    parameters.set("R", 1.0 + static_cast<double>(i));
    parameters.set("gamma", 5.0);
    agents_[i] = std::make_unique<Agent>(static_cast<unsigned>(i + 1), sensors_.size(), kH, dynamics(), C, parameters);
  }
  void leave(std::size_t i) { agents_[i].reset(); }
  [[nodiscard]] const Agent& agent(std::size_t i) const { return *agents_[i]; }
  [[nodiscard]] bool ended(std::size_t i) const { return agents_[i]->estimate()[4] == 0.0; }
  [[nodiscard]] Vector alpha(std::size_t i) const { return agents_[i]->estimate().segment(2, 2); }

  void round() {
    std::vector<std::vector<double>> sent(agents_.size());
    for (std::size_t i = 0; i < agents_.size(); ++i)
      if (agents_[i]) sent[i] = agents_[i]->message(k_, kH);
    for (std::size_t i = 0; i < agents_.size(); ++i) {
      if (!agents_[i]) continue;
      std::vector<Neighbour> scheduled;
      std::vector<Received> inbox;
      for (const Neighbour& j : graph_.in_neighbours(agent_at(i))) {
        if (!agents_[index_of(j.id)]) continue;
        scheduled.push_back(j);
        inbox.push_back({j.id, k_, j.weight, sent[index_of(j.id)]});
      }
      const double y = sensors_[i].dot(truth_);
      agents_[i]->protocol->absorb(
          Sense{.k = k_, .dt = kH, .in_neighbours = scheduled, .y = std::span(&y, sensors_[i].isZero(0.0) ? 0 : 1), .self = agent_at(i)},
          inbox);
    }
    truth_ = matrix_exponential(dynamics(), kH) * truth_;
    ++k_;
  }
  void rounds(int count) {
    for (int r = 0; r < count; ++r) round();
  }
  /// alpha_j of (3.86): the smallest bound of those present who see group j and are in `who`.
  [[nodiscard]] Vector expected(const std::vector<std::size_t>& who) const {
    Vector largest = Vector::Zero(2);
    const StateGroups groups = state_groups(dynamics());
    for (const std::size_t i : who) {
      if (sensors_[i].isZero(0.0)) continue;
      const LocalObserver own = local_observer(agent_at(i), dynamics(), groups, sensors_[i].transpose(), Matrix::Identity(2, 2),
                                               Matrix::Constant(1, 1, 1.0 + static_cast<double>(i)));
      largest = largest.cwiseMax(inverse_alpha_bounds(own, dynamics(), groups, sensors_.size(), 1.0));
    }
    return largest.cwiseMax(1.0).cwiseInverse();
  }
  [[nodiscard]] double error(std::size_t i) const { return (agents_[i]->estimate().head(2) - truth_).norm() / truth_.norm(); }
  static Matrix dynamics() { return Vector{{.3, .2}}.asDiagonal(); }

 private:
  Graph graph_;
  std::vector<Vector> sensors_;
  std::vector<std::unique_ptr<Agent>> agents_;
  Vector truth_{{1.0, -2.0}};
  Round k_ = 0;
};

const Vector kFirst{{1, 0}}, kSecond{{0, 1}}, kNothing{{0, 0}};

TEST(SensorNetworkObserver, FindsAlphaInMessagesAndSaysWhen) {
  Growing network(directed_ring(5), {kFirst, kNothing, kSecond, kFirst, kNothing});
  for (std::size_t i = 0; i < 5; ++i) network.join(i);
  network.rounds(4);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_FALSE(network.ended(i));
    EXPECT_EQ(network.alpha(i), Vector::Zero(2)) << "not known before the end";
  }
  EXPECT_EQ(network.agent(1).estimate().head(2), Vector::Zero(2)) << "agent 2 senses nothing and waits for alpha";
  EXPECT_NE(network.agent(0).estimate()[0], 0.0) << "agent 1 uses its own sensor meanwhile";
  EXPECT_EQ(network.agent(0).estimate()[1], 0.0);
  network.rounds(6);
  const Vector alpha = network.expected({0, 1, 2, 3, 4});
  EXPECT_LT(alpha.maxCoeff(), 1.0) << "the bounds matter here";
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_TRUE(network.ended(i));
    EXPECT_LT((network.alpha(i) - alpha).norm(), 1e-15);
  }
  network.rounds(4000);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_LT(network.error(i), 1e-6) << i;
}

TEST(SensorNetworkObserver, FindsAlphaAgainAfterAJoinAndALeave) {
  // Agent 5 has the worst sensor of the first group, so its bound decides; it comes late and goes again.
  const Graph graph = complete(5);
  Growing network(graph, {kFirst, kNothing, kSecond, kNothing, kFirst});
  for (std::size_t i = 0; i < 4; ++i) network.join(i);
  network.rounds(10);
  const Vector before = network.expected({0, 1, 2, 3}), with_five = network.expected({0, 1, 2, 3, 4});
  ASSERT_LT(with_five[0], before[0]);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(network.alpha(i), before);
  network.join(4);
  network.rounds(2);
  EXPECT_FALSE(network.ended(0));
  EXPECT_EQ(network.alpha(0), before) << "the old alpha until the new one is agreed on";
  network.rounds(8);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_TRUE(network.ended(i));
    EXPECT_EQ(network.alpha(i), with_five);
  }
  network.leave(4);
  network.rounds(15);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_TRUE(network.ended(i));
    EXPECT_EQ(network.alpha(i), before);
  }
}

// --- what it refuses ---------------------------------------------------------------------------------------------------------

std::string complaint_of(const Values& parameters, const Matrix& A = beam::dynamics(), const Matrix& C = beam::sensors()[0]) {
  try {
    const Agent agent(2, 6, 1e-3, A, C, parameters);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(SensorNetworkObserver, NamesParametersThatMakeNoSense) {
  const auto with = [](const std::string& name, const Matrix& value) {
    Values out = beam_parameters(1e-6);
    out.set(name, value);
    return complaint_of(out);
  };
  const auto number = [](double value) { return Matrix::Constant(1, 1, value); };
  const std::string who = "sensor network observer: agent 2: found ";
  EXPECT_EQ(with("gamma", number(0)), who + "gamma = 0; allowed: above 0");
  EXPECT_EQ(with("beta", number(1.5)), who + "beta = 1.5; allowed: above 0, up to 1");
  EXPECT_EQ(with("balance", number(0)), who + "balance = 0; allowed: above 0, up to 1");
  EXPECT_EQ(with("alpha", number(-1)), who + "alpha = -1; allowed: above 0");
  EXPECT_EQ(with("alpha", Vector::Ones(3)), who + "the length of alpha = 3; allowed: 1, or one per state group, 4");
  EXPECT_EQ(with("flooding_rounds", number(2.5)), who + "flooding_rounds = 2.5; allowed: a whole number from 1 to 1000000");
  EXPECT_NE(with("Q", Vector::Zero(8)).find("'Q'"), std::string::npos) << with("Q", Vector::Zero(8));
}

}  // namespace
}  // namespace consort
