// Knotek, thesis, (3.9)-(3.16): agents that each see a part of one plant.

#include "core/errors.hpp"
#include "core/math/schur.hpp"
#include "protocols/filters/estimator_network.hpp"
#include "protocols/luenberger.hpp"
#include "tests/support/observing_agents.hpp"
#include "tests/support/oscillator.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace consort {
namespace {

const std::vector<std::string> kObservers{"dlo_kim", "dlo_zhang"};

ObservingAgents::Settings observers(const std::string& protocol, Seconds dt = 0.01) {
  const bool kim = protocol == "dlo_kim";
  return {protocol,
          oscillator::two(),
          oscillator::two_seen(),
          kim ? ring(4) : directed_ring(4),
          dt,
          {{kim ? "gamma" : "c", kim ? 8.0 : 5.0}},
          {},
          {},
          (Vector(4) << 1, 0, 0, 2).finished()};
}

TEST(LuenbergerObservers, ErrorsFollowTheErrorMatrixWithTheStatedAbscissa) {
  const Matrix A = oscillator::two(), I = Matrix::Identity(4, 4), one = Matrix::Constant(1, 1, 1.0);
  for (const auto& [protocol, stated] : {std::pair{"dlo_kim", -.233679}, std::pair{"dlo_zhang", -.608967}}) {
    SCOPED_TRACE(protocol);
    const bool kim = protocol == std::string("dlo_kim");
    EstimatorNetwork network{A, {}, {}};
    for (const Matrix& C : oscillator::two_seen()) {
      const Matrix R = C.rows() == 0 ? Matrix(0, 0) : one;
      const ObserverGains gains = kim ? kim_gains(A, C, I, R, 8, 1) : zhang_gains(A, C, I, R, 5, I, I);
      network.injection.push_back(gains.L * C);
      network.coupling.push_back(gains.F);
    }
    const auto settings = observers(protocol, 0.001);
    const Matrix R = network.error_matrix(settings.graph);
    EXPECT_NEAR(spectral_abscissa(R), stated, 5e-7);
    ObservingAgents agents(settings);
    const Vector expected = matrix_exponential(R, 5.0) * (-settings.x).replicate(4, 1);
    agents.rounds(5000);
    Vector found(16);
    for (std::size_t i = 0; i < 4; ++i) found.segment(4 * static_cast<Eigen::Index>(i), 4) = agents.error(i);
    EXPECT_LT((found - expected).norm(), 1e-2 * expected.norm());
  }
}

TEST(LuenbergerObservers, KimsErrorIsGoneAfterTwoMinutesThoughNobodySeesEverythingAlone) {
  ObservingAgents agents(observers("dlo_kim"));
  agents.rounds(12'000);
  EXPECT_LT(agents.error(), 1e-9);
  EXPECT_GT(agents.plant().norm(), 2.0) << "the plant goes on";
  ObservingAgents deaf(observers("dlo_kim"));
  deaf.lost = [](Edge) { return true; };
  deaf.rounds(12'000);
  EXPECT_LT(deaf.error(0).head(2).norm(), 1e-9) << "what it sees";
  EXPECT_NEAR(deaf.error(0).tail(2).norm(), 2.0, 1e-6) << "what it does not see";
  EXPECT_LT(deaf.error(2).norm(), 1e-9) << "agent 3 sees both";
  EXPECT_NEAR(deaf.error(3).norm(), std::sqrt(5.0), 1e-6) << "agent 4 has no sensor";
}

TEST(LuenbergerObservers, ZhangTakesNothingOverOfWhatItSees) {
  // Agent 1 hears nonsense about the group it sees, and about the other.
  ObservingAgents agents(observers("dlo_zhang")), alone(observers("dlo_zhang"));
  const std::vector<double> y{1.0}, nonsense{1e3, -1e3, 5, 7};
  const Sense sense{.k = 0, .dt = 0.01, .in_neighbours = {}, .y = y, .self = AgentId{1}};
  agents.agent(0).absorb(sense, std::vector<Received>{{AgentId{4}, 0, 1.0, nonsense}});
  alone.agent(0).absorb(sense, {});
  EXPECT_EQ(agents.estimate(0).head(2), alone.estimate(0).head(2));
  EXPECT_GT((agents.estimate(0) - alone.estimate(0)).tail(2).norm(), 0.1);
}

TEST(LuenbergerObservers, ErrorsVanishAlsoWhenEveryThirdMessageIsLost) {
  for (const std::string& protocol : kObservers) {
    SCOPED_TRACE(protocol);
    ObservingAgents agents(observers(protocol));
    int count = 0;
    agents.lost = [&](Edge) { return ++count % 3 == 0; };
    agents.rounds(15'000);
    EXPECT_LT(agents.error(), 1e-6);
  }
}

TEST(LuenbergerObservers, ZhangsGainMayBeOfAnySize) {
  auto settings = observers("dlo_zhang");
  settings.parameters["c"] = 1e6;
  ObservingAgents agents(settings);
  agents.rounds(6000);
  EXPECT_LT(agents.error(), 1e-6);
}

TEST(LuenbergerObservers, KimsRoundsMayNotBeLongOnAnEvenRing) {
  // Neighbours that jump to each other's estimates never meet; with gamma = 8 that begins between 0.1 s and 0.3 s.
  ObservingAgents well(observers("dlo_kim", 0.1)), badly(observers("dlo_kim", 0.3));
  well.rounds(1500);
  badly.rounds(1500);
  EXPECT_LT(well.error(), 1e-9);
  EXPECT_GT(badly.error(), 1e3);
}

TEST(LuenbergerObservers, TheCouplingFollowsTheWeightsHeard) {
  // One agent without a sensor, gain gamma = 8 in both: S = (1 - exp(-8 d h)) / d.
  for (const double weight : {1.0, 3.0}) {
    auto settings = observers("dlo_kim");
    settings.C[0] = Matrix(0, 4);
    ObservingAgents agents(settings);
    const std::vector<double> other{1, 0, 0, 0};
    agents.agent(0).absorb({.k = 0, .dt = 0.01, .in_neighbours = {}, .y = {}, .self = AgentId{1}},
                           std::vector<Received>{{AgentId{2}, 0, weight, other}});
    const Vector expected = matrix_exponential(oscillator::two(), 0.01) * Vector::Unit(4, 0) * (1.0 - std::exp(-8.0 * weight * 0.01));
    EXPECT_LT((agents.estimate(0) - expected).norm(), 1e-14) << weight;
  }
}

TEST(LuenbergerObservers, RefuseWhatMakesNoSense) {
  const auto refused = [](ObservingAgents::Settings s) { EXPECT_THROW(ObservingAgents{s}, ConfigError) << s.protocol; };
  auto kim = observers("dlo_kim");
  kim.parameters["k"] = 0;
  refused(kim);
  kim = observers("dlo_kim");
  kim.parameters.erase("gamma");
  refused(kim);
  auto zhang = observers("dlo_zhang");
  zhang.parameters["c"] = -1;
  refused(zhang);
  zhang = observers("dlo_zhang");
  zhang.parameters["coupling_R"] = 0;
  refused(zhang);
  zhang = observers("dlo_zhang");
  zhang.A(2, 3) = 1;  // two equal oscillators, of which agent 3 sees the sum only
  zhang.A(3, 2) = -1;
  try {
    ObservingAgents agents(zhang);
    FAIL() << "a group that is seen in part was accepted";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("agent 3"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace consort
