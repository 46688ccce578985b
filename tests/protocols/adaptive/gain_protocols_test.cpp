// Protocols with gains that only grow (Su, Yu, Li) and the neural one (Das), one agent at a time: equations, missing messages, refusals.

#include "protocols/adaptive/edge_gains.hpp"
#include "tests/protocols/plant_agent.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace consort {
namespace {

constexpr double kRoot3 = 1.7320508075688772;
const std::vector<Neighbour> kTwo{{AgentId{2}, 1.0}, {AgentId{3}, 0.5}};

TEST(EdgeGains, ForgetAnEdgeThatGoesAndStartAnewWhenItComesBack) {
  EdgeGains gains(0.5);
  EXPECT_EQ(gains.summary(), Eigen::Vector3d::Constant(0.5));
  gains.match(kTwo);
  gains.add(AgentId{2}, 1.0);
  gains.add(AgentId{3}, 3.0);
  EXPECT_EQ(gains.summary(), Eigen::Vector3d(1.5, 2.5, 3.5));
  gains.match(std::vector<Neighbour>{{AgentId{3}, 0.5}});
  EXPECT_EQ(gains.of(AgentId{3}), 3.5);
  gains.add(AgentId{2}, 1.0);  // a delayed message over an edge that has gone
  EXPECT_EQ(gains.of(AgentId{2}), 0.5);
  gains.match(kTwo);
  EXPECT_EQ(gains.of(AgentId{2}), 0.5);
  EXPECT_EQ(gains.of(AgentId{3}), 3.5);
}

TEST(LiEdgeConsensus, FollowsItsEquationsAndAMissingMessageLeavesItsGainAlone) {
  PlantAgent agent("li_edge_consensus", {{"rate", 2.0}}, {{"c", 1.0}}, 0.01);
  agent.absorb({0, 0}, kTwo, {{2, {1, 0}}, {3, {0, 2}}});
  EXPECT_NEAR(agent.control(), 1.0 + 0.5 * 2 * kRoot3, 1e-12);
  // c_12 += 0.01 * 2 * 1, c_13 += 0.01 * 2 * 0.5 * 12
  EXPECT_NEAR(agent.estimate()[0], 1.02, 1e-12);
  EXPECT_NEAR(agent.estimate()[2], 1.12, 1e-12);
  agent.absorb({0, 0}, kTwo, {{2, {1, 0}}});
  EXPECT_NEAR(agent.control(), 1.02, 1e-12);
  EXPECT_NEAR(agent.estimate()[2], 1.12, 1e-12);
}

TEST(LiAgentConsensus, FollowsItsEquationsAndAMissingMessageIsAnAbsentTerm) {
  PlantAgent agent("li_agent_consensus", {}, {{"c", 2.0}}, 0.01);
  agent.absorb({0, 0}, kTwo, {{2, {0.1, 0}}});
  // xi = (-0.1, 0), rho = (1 + sqrt3 0.01)^3, K xi = -0.1
  const double rho = std::pow(1.0 + kRoot3 * 0.01, 3);
  EXPECT_NEAR(agent.control(), 2.0 * rho * 0.1, 1e-12);
  EXPECT_NEAR(agent.estimate()[0], 2.0 + 0.01 * 0.01, 1e-12);
}

TEST(YuConsensus, FollowsItsEquationsAndAMissingMessageIsAnAbsentTerm) {
  PlantAgent agent("yu_consensus", {{"alpha", 2.0}, {"beta", 3.0}, {"gamma", 0.5}, {"xi", 0.1}}, {{"c", 1.0}}, 0.01);
  agent.absorb({1, 2}, kTwo, {{3, {0, 0}}});
  // e_p = 0.5, e_v = 1
  EXPECT_NEAR(agent.control(), -(2 * 0.5 + 3 * 1.0), 1e-12);
  EXPECT_NEAR(agent.estimate()[0], 1.0 + 0.01 * 0.1 * (2 * 0.25 + 3 * 0.5 * 1.0 + (3 + 2 * 0.5) * 0.5), 1e-12);
}

TEST(SuConsensus, FollowsItsEquationsAndKnowsTheLeaderByItsMessage) {
  PlantAgent agent("su_consensus", {{"c_s", 2.0}, {"k_m", 3.0}, {"k_c", 4.0}}, {{"c", 0.5}, {"m", 0.25}}, 0.01);
  EXPECT_EQ(agent.emit({0, 0}, {})[2], 1.0) << "who hears nobody leads";
  EXPECT_EQ(agent.emit({0, 0}, kTwo)[2], 0.0);
  agent.absorb({1, 2}, kTwo, {{2, {0, 0, 0}}, {3, {0, 0, 1}}});
  // neighbour 2: -(1 + 0.25 * 2); leader 3, weight 0.5: -0.5 (2 * 1 + 0.5 * 2)
  EXPECT_NEAR(agent.control(), -1.5 - 1.5, 1e-12);
  EXPECT_NEAR(agent.estimate()[0], 0.5 + 0.01 * 4 * 4, 1e-12);
  EXPECT_NEAR(agent.estimate()[1], 0.25 + 0.01 * 3 * 4, 1e-12);
  agent.absorb({1, 2}, kTwo, {});
  EXPECT_EQ(agent.control(), 0.0);
  EXPECT_NEAR(agent.estimate()[0], 0.66, 1e-12);
}

TEST(DasNeuralConsensus, FollowsItsEquationsAndCountsTheScheduledInDegree) {
  PlantAgent agent("das_neural_consensus", {{"c", 2.0}, {"F", 10.0}, {"kappa", 0.1}, {"p", 0.5}}, {}, 0.01, 1);
  agent.absorb({0.3}, kTwo, {{2, {1.3}}});
  EXPECT_NEAR(agent.control(), 2.0, 1e-12);
  // W' = -F phi e p (d + g) - kappa F W, e = 1, d + g = 1.5, kappa F = 1
  const double learnt = -(1.0 - std::exp(-0.01)) * 10.0 * 0.5 * 1.5;
  const auto W = agent.estimate();
  EXPECT_NEAR(W[0], learnt, 1e-12);
  EXPECT_NEAR(W[1], learnt * std::sin(0.3), 1e-12);
  EXPECT_NEAR(W[2], learnt * std::cos(0.3), 1e-12);
  agent.absorb({0.3}, {}, {});
  EXPECT_NEAR(agent.control(), -learnt * (1.0 + std::sin(0.3) * std::sin(0.3) + std::cos(0.3) * std::cos(0.3)), 1e-12);
}

TEST(GainProtocols, WithAnEmptyInboxSteerNothing) {
  for (const char* protocol : {"li_edge_consensus", "li_agent_consensus", "yu_consensus", "su_consensus"}) {
    SCOPED_TRACE(protocol);
    PlantAgent agent(protocol, {}, {}, 0.01);
    const auto before = agent.estimate();
    agent.absorb({5, -2}, {}, {});
    EXPECT_EQ(agent.control(), 0.0);
    EXPECT_EQ(agent.estimate(), before);
  }
}

TEST(GainProtocols, CarryMeasurementsOfAnyLength) {
  constexpr std::size_t kNumbers = 130;
  const Values nothing;
  const auto agent = find_protocol("yu_consensus").make(nothing, consort::Setup{AgentId{1}, 3, 0.01, nothing, nothing, kNumbers});
  const std::vector<double> y(kNumbers, 0.25), heard(kNumbers, 1.25);
  std::vector<double> payload(kNumbers), u(kNumbers / 2);
  const Sense sense{0, 0.01, kTwo, 1, y, AgentId{1}};
  ASSERT_EQ(agent->message_layout().size(), kNumbers);
  agent->emit(sense, payload);
  EXPECT_EQ(payload, y);
  agent->absorb(sense, std::vector<Received>{{AgentId{2}, 0, 1.0, heard}});
  ASSERT_EQ(agent->control_size(), kNumbers / 2);
  agent->control(u);
  for (const double of_coordinate : u) EXPECT_NEAR(of_coordinate, 0.1 * (1.0 + 1.0), 1e-15) << "c (alpha + beta), every difference is 1";
}

TEST(GainProtocols, RefuseMeasurementsTheyCannotUse) {
  const auto refusal = [](const char* protocol, std::size_t measurement) -> std::string {
    try {
      PlantAgent(protocol, {}, {}, 0.01, measurement);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(refusal("yu_consensus", 3).find("velocities"), std::string::npos);
  EXPECT_NE(refusal("su_consensus", 0).find("velocities"), std::string::npos);
  EXPECT_NE(refusal("li_edge_consensus", 4).find("whole state"), std::string::npos);
  EXPECT_NE(refusal("das_neural_consensus", 2).find("allowed: 1"), std::string::npos);
}

}  // namespace
}  // namespace consort
