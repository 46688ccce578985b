// Knotek, thesis, (3.4), (3.6), (3.7), Algorithm 3.1: agents that filter what they see of one plant.

#include "core/errors.hpp"
#include "core/math/decompositions.hpp"
#include "core/math/schur.hpp"
#include "protocols/filters/estimator_network.hpp"
#include "tests/support/observing_agents.hpp"
#include "tests/support/oscillator.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace consort {
namespace {

constexpr double kGamma = 5.0;
const Vector kStart = (Vector(2) << 1, -0.5).finished();

Matrix symmetric(double a, double b, double c) { return (Matrix(2, 2) << a, b, b, c).finished(); }
void expect_near(const Matrix& found, const Matrix& expected, double tolerance) {
  EXPECT_LE((found - expected).cwiseAbs().maxCoeff(), tolerance) << found;
}

ObservingAgents::Settings filters(const std::string& protocol, const Graph& graph, Seconds dt = 0.01) {
  ObservingAgents::Settings s{protocol, oscillator::A(), oscillator::C(), graph, dt, {{"Q", 0.1}}, {{"R", oscillator::R()}}, {}, kStart};
  if (protocol == "dkf_olfati_saber" || protocol == "dkf_kim") s.parameters["gamma"] = kGamma;
  if (protocol == "dkf_kim") {
    s.parameters["k"] = 2;
    s.C[3].setZero();
  }
  if (protocol == "dkf_iterative") s.parameters["Q"] = 0.1 * dt;
  return s;
}
const std::vector<std::string> kFilters{"kalman_bucy", "dkf_olfati_saber", "dkf_iterative", "dkf_kim"};
/// One agent that measures the one state.
ObservingAgents::Settings scalar(const std::string& protocol, double a, double q, double r, Seconds dt) {
  auto s = filters(protocol, Graph(1, std::span<const Edge>()), dt);
  s.A = Matrix::Constant(1, 1, a);
  s.C = {Matrix::Constant(1, 1, 1.0)};
  s.parameters["Q"] = q;
  s.by_agent["R"] = {r};
  s.x = Vector::Constant(1, 1.0);
  return s;
}

TEST(KalmanBucy, OneAgentFollowsTheScalarClosedForm) {
  // P' = q - P^2 / r from P = 1: sqrt(q r) tanh(t sqrt(q / r) + c), tanh c = 1 / sqrt(q r) < 1.
  const double q = 2.0, r = 3.0, root = std::sqrt(q * r), rate = std::sqrt(q / r);
  ObservingAgents one(scalar("kalman_bucy", 0.0, q, r, 0.01));
  for (int k = 1; k <= 300; ++k) {
    one.round();
    ASSERT_NEAR(one.P(0)(0, 0), root * std::tanh(0.01 * k * rate + std::atanh(1.0 / root)), 1e-12) << k;
  }
  // e' = -(P / r) e, so e(t) = e(0) cosh(c) / cosh(t rate + c); the rounds are first-order accurate.
  const double c = std::atanh(1.0 / root);
  ObservingAgents fine(scalar("kalman_bucy", 0.0, q, r, 0.001));
  fine.rounds(3000);
  EXPECT_NEAR(fine.error(0)[0] * std::cosh(3.0 * rate + c) / std::cosh(c), -1.0, 2e-3);
}

TEST(KalmanBucy, InRoundsItIsTheDiscreteFilterForHeldMeasurements) {
  const double a = 0.5, q = 2.0, r = 3.0, h = 0.1;
  ObservingAgents one(scalar("kalman_bucy", a, q, r, h));
  const double P = 1.0, K = P / (P + r / h), x = 0.0;
  one.round();
  EXPECT_NEAR(one.estimate(0)[0], std::exp(a * h) * (x + K * (1.0 - x)), 1e-15);
}

TEST(KalmanBucy, OnACompleteGraphEverybodyIsTheCentralisedFilter) {
  ObservingAgents all(filters("kalman_bucy", complete(4)));
  all.rounds(5000);
  for (std::size_t i = 0; i < 4; ++i) {
    expect_near(all.P(i), symmetric(.134208, .020761, .176480), 5e-7);
    expect_near(all.P(i), stationary_covariance(oscillator::A(), oscillator::seen_by_all(), oscillator::Q()), 1e-12);
    expect_near(all.estimate(i), all.estimate(0), 1e-12);
  }
  EXPECT_LT(all.error(), 1e-12);
}

TEST(KalmanBucy, InTheMiddleOfAStarAgentOneHearsEverybody) {
  ObservingAgents some(filters("kalman_bucy", star(4)));
  some.rounds(5000);
  expect_near(some.P(0), symmetric(.134208, .020761, .176480), 5e-7);
  const Matrix U = oscillator::sensor_of(1).U + oscillator::sensor_of(0).U;
  expect_near(some.P(1), stationary_covariance(oscillator::A(), U, oscillator::Q()), 1e-12);
}

TEST(KalmanBucy, AMissingMessageIsAMeasurementThatWasNotMade) {
  ObservingAgents all(filters("kalman_bucy", complete(4)));
  auto only = filters("kalman_bucy", Graph(4, std::span<const Edge>()));
  all.lost = [](Edge) { return true; };
  ObservingAgents none(only);
  for (int k = 0; k < 20; ++k) {
    all.round();
    none.round();
  }
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(all.all_of(i), none.all_of(i));
  // The covariance grows back to what all sensors give once messages come again.
  all.lost = [](Edge) { return false; };
  all.rounds(5000);
  expect_near(all.P(2), symmetric(.134208, .020761, .176480), 5e-7);
}

TEST(KalmanBucy, ALateMeasurementIsNotUsed) {
  for (const bool late : {false, true}) {
    SCOPED_TRACE(late);
    ObservingAgents pair(filters("kalman_bucy", complete(4)));
    ObservingAgents alone(filters("kalman_bucy", Graph(4, std::span<const Edge>())));
    pair.lost = [](Edge) { return true; };
    pair.round();
    alone.round();
    const std::vector<double> payload{1, 2, 3, 0, 0, 4}, y{0.7};  // u, U of some agent
    const std::vector<Received> inbox{{AgentId{2}, static_cast<Round>(late ? 0 : 1), 1.0, payload}};
    pair.agent(0).absorb({.k = 1, .dt = 0.01, .in_neighbours = {}, .y = y, .self = AgentId{1}}, inbox);
    alone.agent(0).absorb({.k = 1, .dt = 0.01, .in_neighbours = {}, .y = y, .self = AgentId{1}}, {});
    EXPECT_EQ(pair.all_of(0) == alone.all_of(0), late);
  }
}

/// Errors of all agents, one after the other.
Vector errors(const ObservingAgents& agents, Eigen::Index n) {
  Vector out(4 * n);
  for (std::size_t i = 0; i < 4; ++i) out.segment(static_cast<Eigen::Index>(i) * n, n) = agents.error(i);
  return out;
}
/// From stationary covariances P, ten seconds of rounds are ten seconds of the error matrix at these gains.
void expect_error_matrix(ObservingAgents::Settings settings, const std::vector<Matrix>& P, const std::vector<Matrix>& U, double stated) {
  EstimatorNetwork network{settings.A, {}, {}};
  for (std::size_t i = 0; i < 4; ++i) {
    Values initial;
    initial.set("P", P[i]);
    initial.set("x", Matrix(Vector::Constant(2, static_cast<double>(i))));
    settings.initial.push_back(initial);
    network.injection.push_back(P[i] * U[i]);
    network.coupling.push_back(kGamma * P[i]);
  }
  const Matrix R = network.error_matrix(settings.graph);
  EXPECT_NEAR(spectral_abscissa(R), stated, 5e-7);
  ObservingAgents agents(settings);
  const Vector expected = matrix_exponential(R, 10.0) * errors(agents, 2);
  agents.rounds(static_cast<int>(std::lround(10.0 / settings.dt)));
  EXPECT_LT((errors(agents, 2) - expected).norm(), 5e-3 * expected.norm());
}

TEST(DkfOlfatiSaber, HasTheStatedCovariance) {
  ObservingAgents agents(filters("dkf_olfati_saber", ring(4)));
  agents.rounds(4000);
  expect_near(agents.P(0), symmetric(.312606, .047723, .342443), 5e-7);
}

TEST(DkfOlfatiSaber, ErrorsFollowTheErrorMatrixWithTheStatedAbscissa) {
  std::vector<Matrix> P, U;
  for (std::size_t i = 0; i < 4; ++i) {
    U.push_back(oscillator::sensor_of(i).U);
    P.push_back(stationary_covariance(oscillator::A(), U[i], oscillator::Q()));
  }
  expect_error_matrix(filters("dkf_olfati_saber", ring(4), 0.001), P, U, -.349193);
}

TEST(DkfOlfatiSaber, WithAggregatedMeasurementsHasTheCovarianceOfEverySensorAround) {
  auto settings = filters("dkf_olfati_saber", ring(4));
  settings.parameters["aggregated"] = 1;
  ObservingAgents agents(settings);
  agents.rounds(5000);
  for (std::size_t i = 0; i < 4; ++i)
    expect_near(agents.P(i), stationary_covariance(oscillator::A(), oscillator::seen_around(ring(4), i), oscillator::Q()), 1e-12);
  EXPECT_LT(agents.error(), 1e-10);
  EXPECT_EQ(agents.agent(0).message_layout().size(), 2U + 2U + 4U);
  EXPECT_EQ(ObservingAgents(filters("dkf_olfati_saber", ring(4))).agent(0).message_layout().size(), 2U) << "without: the estimate alone";
}

TEST(DkfKim, HasTheStatedCovarianceAfterTwentySeconds) {
  // Rounds are first-order accurate: twice what half the length gives, less what the length gives, is second-order.
  ObservingAgents coarse(filters("dkf_kim", ring(4), 0.004)), fine(filters("dkf_kim", ring(4), 0.002));
  coarse.rounds(5000);
  fine.rounds(10'000);
  expect_near(2.0 * fine.P(0) - coarse.P(0), symmetric(.412137, .02429, .49166), 1e-6);
}

std::vector<Matrix> three_sensors() {
  return {oscillator::sensor_of(0).U, oscillator::sensor_of(1).U, oscillator::sensor_of(2).U, Matrix::Zero(2, 2)};
}

TEST(DkfKim, CovariancesEndWhereTheEquationEndsHoweverLongTheRound) {
  const auto P = coupled_covariances(oscillator::A(), oscillator::coupled(three_sensors(), 2.0), ring(4));
  for (const double dt : {0.01, 0.1}) {
    ObservingAgents agents(filters("dkf_kim", ring(4), dt));
    agents.rounds(static_cast<int>(std::lround(80.0 / dt)));
    for (std::size_t i = 0; i < 4; ++i) expect_near(agents.P(i), P[i], 1e-9);
  }
}

TEST(DkfKim, ErrorsFollowTheErrorMatrix) {
  // The abscissa is stated at the covariances after 20 s, -.230727; with the stationary ones it is this.
  const auto P = coupled_covariances(oscillator::A(), oscillator::coupled(three_sensors(), 2.0), ring(4));
  expect_error_matrix(filters("dkf_kim", ring(4), 0.001), P, three_sensors(), -.230673);
}

TEST(DkfKim, StaysStableWithAStiffCovarianceCoupling) {
  auto settings = filters("dkf_kim", ring(4), 0.1);
  settings.parameters["k"] = 1e4;  // k d dt = 2000
  ObservingAgents agents(settings);
  agents.rounds(3000);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_GT(symmetric_eigenvalues(agents.P(i)).minCoeff(), 0.0);
    expect_near(agents.P(i), agents.P(0), 1e-4);
  }
  EXPECT_LT(agents.error(), 1e-9);
}

TEST(DkfIterative, HasTheStatedCovarianceAndError) {
  ObservingAgents agents(filters("dkf_iterative", ring(4), 0.1));
  agents.rounds(200);
  expect_near(agents.P(0), symmetric(.048188, .013251, .087089), 5e-7);
  EXPECT_LT(agents.error(), 1e-6);
}

TEST(DkfIterative, ARoundIsTheAlgorithmsLetter) {
  auto settings = filters("dkf_iterative", path(2), 0.1);
  settings.C.resize(2);
  settings.parameters["epsilon"] = 0.5;
  Values first, second;
  first.set("x", Matrix(Vector(Vector::Constant(2, 0.3))));
  second.set("x", Matrix(Vector(Vector::Constant(2, -0.7))));
  settings.initial = {first, second};
  ObservingAgents agents(settings);
  agents.round();
  const Matrix A = matrix_exponential(oscillator::A(), 0.1), I = Matrix::Identity(2, 2);
  const Vector y1 = oscillator::C()[0] * kStart, y2 = oscillator::C()[1] * kStart;
  const Matrix C1 = oscillator::C()[0], C2 = oscillator::C()[1];
  const Matrix S = C1.transpose() * C1 / 0.5 + C2.transpose() * C2 / 1.0;
  const Vector z = C1.transpose() * y1 / 0.5 + C2.transpose() * y2 / 1.0;
  const Matrix M = inverse(I + S, "I + S");
  const Vector x = first.vector("x"), other = second.vector("x");
  expect_near(agents.estimate(0), A * (x + M * (z - S * x) + 0.5 * M * (other - x)), 1e-15);
  expect_near(agents.P(0), A * M * A.transpose() + 0.01 * I, 1e-15);
}

TEST(DkfIterative, BoundedGainKeepsABadlyScaledNetworkStable) {
  // Nobody sees much, so M_i stays near P(0) = 1 and with eight neighbours the printed gain overshoots sevenfold.
  const auto settings = [](bool bounded) {
    auto s = scalar("dkf_iterative", 0.0, 1.0, 1e3, 0.1);
    s.graph = complete(9);
    s.C.assign(9, s.C[0]);
    s.by_agent["R"].assign(9, 1e3);
    s.parameters["bounded"] = bounded ? 1 : 0;
    for (int i = 0; i < 9; ++i) {
      Values initial;
      initial.set("x", i % 2 == 0 ? 1.0 : -1.0);
      s.initial.push_back(initial);
    }
    return s;
  };
  ObservingAgents letter(settings(false)), bounded(settings(true));
  letter.rounds(20);
  bounded.rounds(20);
  EXPECT_GT(letter.error(), 1e6);
  EXPECT_LT(bounded.error(), 3.0);
  auto zero = settings(false);
  zero.parameters["epsilon"] = 0;
  ObservingAgents apart(zero);
  apart.rounds(20);
  EXPECT_NE(apart.error(0)[0], apart.error(1)[0]) << "without coupling agents with different starts stay apart";
}

TEST(Filters, WithoutMessagesAnAgentFiltersAlone) {
  for (const std::string& protocol : kFilters) {
    SCOPED_TRACE(protocol);
    ObservingAgents deaf(filters(protocol, ring(4))), alone(filters(protocol, Graph(4, std::span<const Edge>())));
    deaf.lost = [](Edge) { return true; };
    deaf.rounds(50);
    alone.rounds(50);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(deaf.all_of(i), alone.all_of(i));
    ObservingAgents hearing(filters(protocol, ring(4)));
    hearing.rounds(50);
    EXPECT_NE(hearing.all_of(0), alone.all_of(0));
  }
}

TEST(Filters, ErrorsVanishAlsoWhenEveryThirdMessageIsLost) {
  for (const std::string& protocol : kFilters) {
    SCOPED_TRACE(protocol);
    ObservingAgents agents(filters(protocol, ring(4)));
    int count = 0;
    agents.lost = [&](Edge) { return ++count % 3 == 0; };
    agents.rounds(10'000);
    EXPECT_LT(agents.error(), 1e-6);
  }
}

TEST(Filters, AnAgentWithoutASensorFollowsTheOthers) {
  for (const std::string& protocol : kFilters) {
    SCOPED_TRACE(protocol);
    auto without = filters(protocol, ring(4)), blind = filters(protocol, ring(4));
    without.C[3] = Matrix(0, 2);
    blind.C[3].setZero();
    ObservingAgents a(without), b(blind);
    a.rounds(8000);
    b.rounds(8000);
    EXPECT_LT(a.error(), 1e-5);
    EXPECT_EQ(a.all_of(3), b.all_of(3)) << "no sensor is a sensor that sees nothing";
  }
}

TEST(Filters, ALateEstimateIsMovedOnWithThePlant) {
  for (const std::string protocol : {"dkf_olfati_saber", "dkf_kim"}) {
    SCOPED_TRACE(protocol);
    // Perfect estimates stay perfect, though what is heard is ten rounds old.
    auto settings = filters(protocol, path(2));
    settings.C = {oscillator::C()[0], oscillator::C()[1]};
    Values exact;
    exact.set("x", Matrix(kStart));
    settings.initial = {exact, exact};
    ObservingAgents agents(settings);
    agents.lost = [](Edge) { return true; };
    std::vector<double> old(agents.agent(1).message_layout().size());
    const std::vector<double> y{0.0};
    agents.agent(1).emit({.k = 0, .dt = 0.01, .in_neighbours = {}, .y = y, .self = AgentId{2}}, old);
    agents.rounds(10);
    const Vector now = oscillator::C()[0] * agents.plant();
    const std::vector<double> seen(now.begin(), now.end());
    agents.agent(0).absorb({.k = 10, .dt = 0.01, .in_neighbours = {}, .y = seen, .self = AgentId{1}},
                           std::vector<Received>{{AgentId{2}, 0, 1.0, old}});
    expect_near(agents.estimate(0), matrix_exponential(oscillator::A(), 0.01) * agents.plant(), 1e-13);
  }
}

TEST(Filters, WeightsScaleTheCoupling) {
  for (const std::string protocol : {"dkf_olfati_saber", "dkf_kim", "dkf_iterative"}) {
    SCOPED_TRACE(protocol);
    // Twice the weight is twice the gain: gamma, k and epsilon.
    const auto agents = [&](double weight, double factor) {
      auto s =
          filters(protocol, Graph(2, std::vector<WeightedEdge>{{{AgentId{1}, AgentId{2}}, weight}, {{AgentId{2}, AgentId{1}}, weight}}));
      s.C.resize(2);
      for (const char* name : {"gamma", "k"})
        if (s.parameters.contains(name)) s.parameters[name] *= factor;
      if (protocol == "dkf_iterative") s.parameters["epsilon"] = 0.2 * factor;
      for (const double x : {1.0, -1.0}) {
        Values initial;
        initial.set("x", Matrix(Vector::Constant(2, x)));
        s.initial.push_back(initial);
      }
      ObservingAgents out(s);
      out.rounds(50);
      return Vector(out.all_of(0));
    };
    EXPECT_LT((agents(2, 1) - agents(1, 2)).norm(), 1e-12);
    EXPECT_GT((agents(2, 1) - agents(1, 1)).norm(), 1e-6);
  }
}

TEST(Filters, RefuseWhatMakesNoSense) {
  const auto refused = [](ObservingAgents::Settings s) { EXPECT_THROW(ObservingAgents{s}, ConfigError) << s.protocol; };
  for (const std::string& protocol : kFilters) {
    auto s = filters(protocol, ring(4));
    s.by_agent["R"][2] = 0.0;
    refused(s);
    s = filters(protocol, ring(4));
    s.parameters["Q"] = -1;
    refused(s);
    s = filters(protocol, ring(4));
    s.parameters.erase("Q");
    refused(s);
    s = filters(protocol, ring(4));
    Values initial;
    initial.set("x", 1.0);
    s.initial.assign(4, initial);  // one number for two states
    refused(s);
    s = filters(protocol, ring(4));
    s.by_agent.erase("R");
    refused(s);
    for (Matrix& C : s.C) C = Matrix(0, 2);
    ObservingAgents{s};  // without sensors nobody needs R
  }
  for (const std::string protocol : {"dkf_olfati_saber", "dkf_kim"}) {
    auto s = filters(protocol, ring(4));
    s.parameters["gamma"] = 0;
    refused(s);
  }
  auto kim = filters("dkf_kim", ring(4));
  kim.parameters["k"] = -1;
  refused(kim);
  auto mixed = filters("dkf_olfati_saber", ring(4));
  mixed.parameters["aggregated"] = 2;
  refused(mixed);
  auto iterative = filters("dkf_iterative", ring(4));
  iterative.parameters["epsilon"] = -1;
  refused(iterative);
}

TEST(Filters, SayWhatThePlantHasToBe) {
  const Values none;
  Values parameters;
  parameters.set("Q", 1.0);
  try {
    static_cast<void>(find_protocol("kalman_bucy").make(parameters, consort::Setup{AgentId{3}, 4, 0.1, none}));
    FAIL() << "a plant without A was accepted";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("agent 3"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("shared_linear"), std::string::npos) << error.what();
  }
  Values model;
  model.set("A", oscillator::A());
  model.set("C", oscillator::C()[0]);
  EXPECT_THROW(static_cast<void>(find_protocol("kalman_bucy").make(parameters, consort::Setup{AgentId{3}, 4, 0.1, none, model, 4})),
               ConfigError);
}

}  // namespace
}  // namespace consort
