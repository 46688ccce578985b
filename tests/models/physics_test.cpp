#include "models/physics.hpp"
#include "core/errors.hpp"
#include "core/math/discretise.hpp"
#include "models/registry.hpp"
#include "tests/support/experiments.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace consort {
namespace {

Experiment with_plant(PlantSpec plant, std::size_t agents, Seconds dt) {
  Experiment e;
  e.name = "physics";
  e.agents = agents;
  e.dt = dt;
  e.rounds = 1000;
  e.protocols = {{"local_voting", {}}};
  e.topology = for_ever(complete(agents));
  e.plant = std::move(plant);
  return e;
}

Physics physics_of(const Experiment& e, Seed seed = {}) { return Physics(plant_task(e, seed)); }

Vector state_of(const Physics& physics, AgentId i) {
  const auto x = physics.state(i);
  return Eigen::Map<const Vector>(x.data(), static_cast<Eigen::Index>(x.size()));
}

TEST(Integrator, MovesExactlyUnderAConstantInput) {
  PlantSpec plant = integrators(2, {1.0, -2.0});
  plant.initial.push_back({"velocity", each({0.5, 0.0})});
  Physics physics = physics_of(with_plant(plant, 2, 0.1));
  for (int k = 0; k < 30; ++k) {
    physics.control(AgentId{1})[0] = 2.0;
    physics.advance();
  }
  // x = x0 + v0 t + u t^2 / 2, v = v0 + u t at t = 3
  EXPECT_NEAR(state_of(physics, AgentId{1})[0], 1.0 + 0.5 * 3 + 9.0, 1e-12);
  EXPECT_NEAR(state_of(physics, AgentId{1})[1], 0.5 + 6.0, 1e-12);
  EXPECT_EQ(state_of(physics, AgentId{2})[0], -2.0);
}

TEST(Integrator, HasAnyOrderAndDimension) {
  PlantSpec plant;
  plant.model = "integrator";
  plant.parameters.set("order", 3.0);
  plant.parameters.set("dimension", 2.0);
  Physics physics = physics_of(with_plant(plant, 1, 0.5));
  EXPECT_EQ(physics.state(AgentId{1}).size(), 6u);
  EXPECT_EQ(physics.control_size(AgentId{1}), 2u);
  EXPECT_EQ(physics.measurement_size(AgentId{1}), 6u);
  physics.control(AgentId{1})[1] = 6.0;
  physics.advance();
  const Vector x = state_of(physics, AgentId{1});
  EXPECT_NEAR(x[1], 6.0 * 0.125 / 6.0, 1e-14);  // u t^3 / 6
  EXPECT_NEAR(x[3], 6.0 * 0.25 / 2.0, 1e-14);
  EXPECT_NEAR(x[5], 3.0, 1e-14);
  EXPECT_EQ(x[0], 0.0);
}

TEST(Physics, TellsDistancesBetweenPositionsWhereLinksAskForThem) {
  PlantSpec plant;
  plant.model = "integrator";
  plant.parameters.set("order", 2.0);
  plant.parameters.set("dimension", 2.0);
  PerAgent::List positions;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {3.0, 4.0}, {0.0, 1.0}}) positions.values.push_back((Vector(2) << x, y).finished());
  plant.initial.push_back({"position", {positions}});
  plant.initial.push_back({"velocity", {PerAgent::Same{Vector::Constant(2, 7.0)}}});
  Experiment e = with_plant(plant, 3, 0.1);
  EXPECT_EQ(physics_of(e).distance_count(AgentId{1}), 0u);
  e.links.standard.distance = DistanceLoss{1.0, 2.0};
  const Physics physics = physics_of(e);
  std::vector<double> distances(physics.distance_count(AgentId{1}));
  physics.distances(AgentId{1}, distances);
  EXPECT_EQ(distances, (std::vector<double>{5.0, 1.0}));
  EXPECT_EQ(physics.measurement_size(AgentId{1}), 4u);  // the protocol measures what it did before
  e.plant->model = "linear";
  e.plant->parameters = {};
  e.plant->parameters.set("A", -1.0);
  e.plant->initial.clear();
  EXPECT_THROW(physics_of(e), ConfigError);
}

TEST(Physics, DegradesASensorFromARoundOn) {
  PlantSpec plant = integrators(1, {1.0, -2.0});
  Disturbance worse{Disturbance::On::measurement, Disturbance::Constant{{PerAgent::Same{Matrix::Constant(1, 1, 0.5)}}}, 1, {}};
  worse.agents = {AgentId{2}};
  worse.first = 3;
  plant.disturbances.push_back(worse);
  Physics physics = physics_of(with_plant(plant, 2, 0.1));
  for (Round k = 0; k < 6; ++k) {
    double y = 0.0;
    physics.measure(AgentId{2}, std::span(&y, 1));
    EXPECT_EQ(y, k < 3 ? -2.0 : -1.5) << k;
    physics.measure(AgentId{1}, std::span(&y, 1));
    EXPECT_EQ(y, 1.0) << k;
    physics.advance();
  }
}

TEST(Linear, FollowsTheMatrixExponential) {
  PlantSpec plant;
  plant.model = "linear";
  Matrix A(2, 2), C(1, 2);
  A << 0, 1, -1, 0;
  C << 1, 2;
  plant.parameters.set("A", A);
  plant.parameters.set("C", C);
  plant.initial = {{"x", same(Matrix(Vector::Unit(2, 0)))}};
  Physics physics = physics_of(with_plant(plant, 1, 0.25));
  for (int k = 0; k < 8; ++k) physics.advance();
  const Vector x = state_of(physics, AgentId{1});
  EXPECT_NEAR(x[0], std::cos(2.0), 1e-14);
  EXPECT_NEAR(x[1], -std::sin(2.0), 1e-14);
  std::vector<double> y(1);
  physics.measure(AgentId{1}, y);
  EXPECT_NEAR(y[0], std::cos(2.0) - 2.0 * std::sin(2.0), 1e-14);
}

TEST(SineDrift, AgreesWithItsSeparableSolution) {
  // x' = sin x: tan(x / 2) = tan(x0 / 2) e^t
  PlantSpec plant;
  plant.model = "sine_drift";
  plant.initial = {{"x", same(0.3)}};
  Physics physics = physics_of(with_plant(plant, 1, 0.01));
  for (int k = 0; k < 200; ++k) physics.advance();
  EXPECT_NEAR(state_of(physics, AgentId{1})[0], 2.0 * std::atan(std::tan(0.15) * std::exp(2.0)), 1e-9);
}

TEST(Disturbance, OfKnownShapeActsWhereItIsSaidTo) {
  PlantSpec plant = integrators(2, {0.0, 0.0});
  Disturbance push{Disturbance::On::input, Disturbance::Constant{same(3.0)}, 1, {AgentId{2}}};
  Matrix amplitude(2, 1);
  amplitude << 0.5, 0.0;
  Disturbance wave{Disturbance::On::measurement, Disturbance::Sinusoid{same(amplitude), 2.0, each({0.0, 1.0})}, 1, {}};
  plant.disturbances = {push, wave};
  Physics physics = physics_of(with_plant(plant, 2, 0.1));
  for (int k = 0; k < 10; ++k) physics.advance();
  EXPECT_EQ(state_of(physics, AgentId{1})[0], 0.0);
  EXPECT_NEAR(state_of(physics, AgentId{2})[0], 1.5, 1e-12);
  std::vector<double> y(2);
  physics.measure(AgentId{2}, y);
  EXPECT_NEAR(y[0], 1.5 + 0.5 * std::sin(2.0 * 1.0 + 1.0), 1e-12);
  EXPECT_NEAR(y[1], 3.0, 1e-12);
}

TEST(Disturbance, IsHeldOverItsRoundsAndKeyed) {
  PlantSpec plant = integrators(1, {0.0, 0.0, 0.0});
  plant.disturbances = {{Disturbance::On::measurement, Disturbance::Gaussian{Matrix::Constant(1, 1, 0.04), false}, 5, {}}};
  const Experiment e = with_plant(plant, 3, 0.1);
  Physics physics = physics_of(e, Seed{7}), again = physics_of(e, Seed{7}), other = physics_of(e, Seed{8});
  std::vector<double> y(1), before(1), same_seed(1), other_seed(1);
  for (int k = 0; k < 20; ++k) {
    physics.measure(AgentId{2}, y);
    again.measure(AgentId{2}, same_seed);
    other.measure(AgentId{2}, other_seed);
    EXPECT_EQ(y[0], same_seed[0]);
    EXPECT_NE(y[0], other_seed[0]);
    if (k > 0 && k % 5 != 0) {
      EXPECT_EQ(y[0], before[0]);
    }
    if (k > 0 && k % 5 == 0) {
      EXPECT_NE(y[0], before[0]);
    }
    before = y;
    for (Physics* each_one : {&physics, &again, &other}) each_one->advance();
  }
}

TEST(Disturbance, WhiteNoiseOfIntensityWGrowsTheVarianceByWtWhateverTheStep) {
  for (const double dt : {0.02, 0.1, 0.5}) {
    SCOPED_TRACE(dt);
    constexpr std::size_t kAgents = 4000;
    PlantSpec plant = integrators(1, std::vector<double>(kAgents, 0.0));
    plant.disturbances = {{Disturbance::On::state, Disturbance::Gaussian{Matrix::Constant(1, 1, 0.3), true}, 1, {}}};
    Experiment e = with_plant(plant, kAgents, dt);
    e.topology = for_ever(ring(kAgents));
    Physics physics = physics_of(e);
    for (int k = 0; k < std::lround(2.0 / dt); ++k) physics.advance();
    double sum = 0.0;
    for (std::size_t i = 0; i < kAgents; ++i) sum += std::pow(physics.state(agent_at(i))[0], 2);
    EXPECT_NEAR(sum / kAgents, 0.6, 0.6 * 4.0 * std::sqrt(2.0 / kAgents));  // four standard deviations of the sample variance
  }
}

TEST(Disturbance, UniformNoiseStaysWithinItsBound) {
  PlantSpec plant = integrators(1, {0.0});
  plant.disturbances = {{Disturbance::On::measurement, Disturbance::Uniform{Matrix::Constant(1, 1, 0.05)}, 1, {}}};
  Physics physics = physics_of(with_plant(plant, 1, 0.1));
  double smallest = 1.0, largest = -1.0;
  std::vector<double> y(1);
  for (int k = 0; k < 500; ++k) {
    physics.measure(AgentId{1}, y);
    smallest = std::min(smallest, y[0]);
    largest = std::max(largest, y[0]);
    physics.advance();
  }
  EXPECT_GE(smallest, -0.05);
  EXPECT_LT(largest, 0.05);
  EXPECT_LT(smallest, -0.045);
  EXPECT_GT(largest, 0.045);
}

TEST(Sensing, OfNeighboursPutsOwnOutputFirst) {
  PlantSpec plant = integrators(1, {1.0, 2.0, 3.0, 4.0});
  plant.sensing = PlantSpec::Sensing::neighbours;
  Experiment e = with_plant(plant, 4, 0.1);
  e.topology = for_ever(ring(4));
  const Physics physics = physics_of(e);
  ASSERT_EQ(physics.measurement_size(AgentId{3}), 3u);
  std::vector<double> y(3);
  physics.measure(AgentId{3}, y);
  EXPECT_EQ(y, (std::vector<double>{3.0, 2.0, 4.0}));
  const Vector expected = (Vector(3) << 3, 2, 4).finished();
  EXPECT_EQ(Vector(physics.knowledge(AgentId{3}).vector("sensed")), expected);
}

TEST(Sensing, RelativeIsTheOthersOutputMinusTheOwn) {
  PlantSpec plant = integrators(1, {1.0, 2.0, 4.0, 8.0});
  plant.sensing = PlantSpec::Sensing::relative;
  plant.relative = {{AgentId{1}, {AgentId{2}, AgentId{4}}}, {AgentId{3}, {AgentId{4}}}};
  plant.absolute = {AgentId{1}};
  Experiment e = with_plant(plant, 4, 0.1);
  e.presence[AgentId{4}] = {0, 1};
  Physics physics = physics_of(e);
  ASSERT_EQ(physics.measurement_size(AgentId{1}), 3u);
  ASSERT_EQ(physics.measurement_size(AgentId{2}), 0u);
  std::vector<double> y(3);
  physics.measure(AgentId{1}, y);
  EXPECT_EQ(y, (std::vector<double>{1.0, 7.0, -1.0}));
  EXPECT_EQ(physics.knowledge(AgentId{1}).vector("relative"), (Vector(2) << 2, 4).finished());
  EXPECT_TRUE(physics.knowledge(AgentId{1}).has("absolute"));
  EXPECT_FALSE(physics.knowledge(AgentId{2}).has("relative"));
  physics.advance();
  physics.measure(AgentId{1}, y);
  EXPECT_EQ(y[0], 1.0);
  EXPECT_TRUE(is_absent(y[1])) << "who has left is not measured";
  EXPECT_EQ(y[2], -1.0);
}

/// Agents 1 (two states) and 2 (one state): x_1 acts on x_2' and y_2.
PlantSpec coupled() {
  PlantSpec plant;
  plant.model = "linear";
  plant.parameters.set("A", (Matrix(2, 2) << 0.2, 1.0, 0.0, -0.8).finished());
  plant.overrides[AgentId{2}].parameters.set("A", -1.0);
  plant.initial = {{"x", same(1.0)}};
  Values acts;
  acts.set("A", (Matrix(1, 2) << 0.8, 1.0).finished());
  acts.set("C", (Matrix(1, 2) << 2.0, 3.0).finished());
  plant.couplings = {{{AgentId{1}, AgentId{2}}, acts}};
  return plant;
}

TEST(Linear, CoupledPartsMoveAsTheOneSystemTheyAre) {
  Physics physics = physics_of(with_plant(coupled(), 2, 0.1));
  Matrix A = Matrix::Zero(3, 3);
  A << 0.2, 1.0, 0.0, 0.0, -0.8, 0.0, 0.8, 1.0, -1.0;
  std::vector<double> y(1);
  for (int k = 0; k < 30; ++k) {
    const Vector expected = matrix_exponential(A, 0.1 * k + 1e-300) * Vector::Ones(3);
    EXPECT_NEAR(state_of(physics, AgentId{1})[0], expected[0], 1e-12);
    EXPECT_NEAR(state_of(physics, AgentId{2})[0], expected[2], 1e-12);
    physics.measure(AgentId{2}, y);
    EXPECT_NEAR(y[0], expected[2] + 2.0 * expected[0] + 3.0 * expected[1], 1e-12);
    physics.advance();
  }
}

TEST(Linear, WhoHasLeftActsOnNobody) {
  Experiment e = with_plant(coupled(), 2, 0.1);
  e.presence[AgentId{1}] = {0, 5};
  Physics physics = physics_of(e);
  for (int k = 0; k < 5; ++k) physics.advance();
  const double x = state_of(physics, AgentId{2})[0];
  std::vector<double> y(1);
  physics.measure(AgentId{2}, y);
  EXPECT_EQ(y[0], x);
  physics.advance();
  EXPECT_NEAR(state_of(physics, AgentId{2})[0], x * std::exp(-0.1), 1e-14);
}

TEST(Linear, PartsOfOtherSizesAreReportedSideBySide) {
  const Physics physics = physics_of(with_plant(coupled(), 2, 0.1));
  ASSERT_EQ(physics.state_layout().size(), 2u);
  std::vector<double> reported(2);
  physics.report_state(AgentId{2}, reported);
  EXPECT_EQ(reported[0], 1.0);
  EXPECT_TRUE(is_absent(reported[1]));
}

TEST(Linear, RefusesACouplingThatDoesNotFit) {
  PlantSpec plant = coupled();
  plant.couplings[0].values.set("A", 1.0);
  try {
    physics_of(with_plant(plant, 2, 0.1));
    FAIL() << "a 1 x 1 coupling from an agent of two states was taken";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("coupling 1 -> 2: A is 1 x 1; allowed: 1 x 2"), std::string::npos) << error.what();
  }
}

TEST(SharedLinear, IsOneStateThatEverybodyObserves) {
  PlantSpec plant;
  plant.model = "shared_linear";
  plant.parameters.set("A", (Matrix(2, 2) << 0.0, 1.0, -1.0, 0.0).finished());
  plant.overrides[AgentId{1}].parameters.set("C", (Matrix(1, 2) << 1.0, 0.0).finished());
  plant.overrides[AgentId{2}].parameters.set("B", (Matrix(2, 1) << 0.0, 1.0).finished());
  plant.initial = {{"x", {PerAgent::Same{(Matrix(2, 1) << 1.0, 0.0).finished()}}}};
  plant.disturbances = {{Disturbance::On::state, Disturbance::Constant{same(0.5)}, 1, {}}};
  Physics physics = physics_of(with_plant(plant, 3, 0.1));
  EXPECT_EQ(physics.measurement_size(AgentId{1}), 1u);
  EXPECT_EQ(physics.measurement_size(AgentId{3}), 0u);
  EXPECT_FALSE(physics.knowledge(AgentId{3}).has("C"));
  EXPECT_EQ(physics.control_size(AgentId{2}), 1u);
  physics.control(AgentId{2})[0] = 2.0;
  physics.advance();
  // x' = A x + (0, 2) + (0.5, 0.5), the disturbance once, not three times.
  const Discrete step = discretise(*plant.parameters.find("A"), Matrix::Identity(2, 2), {}, 0.1);
  const Vector expected = step.A * (Vector(2) << 1.0, 0.0).finished() + step.B * (Vector(2) << 0.5, 2.5).finished();
  for (std::uint32_t i = 1; i <= 3; ++i) {
    EXPECT_NEAR(state_of(physics, AgentId{i})[0], expected[0], 1e-14);
    EXPECT_NEAR(state_of(physics, AgentId{i})[1], expected[1], 1e-14);
  }
}

TEST(Presence, AnAbsentPartStandsStillUntilItJoins) {
  PlantSpec plant = integrators(2, {0.0, 5.0});
  plant.initial.push_back({"velocity", same(1.0)});
  Experiment e = with_plant(plant, 2, 1.0);
  e.presence[AgentId{2}] = {3, 6};
  Physics physics = physics_of(e);
  for (int k = 0; k < 10; ++k) physics.advance();
  EXPECT_NEAR(state_of(physics, AgentId{1})[0], 10.0, 1e-12);
  EXPECT_NEAR(state_of(physics, AgentId{2})[0], 8.0, 1e-12);
}

TEST(Physics, NamesTheAgentRoundAndModelThatDiverge) {
  PlantSpec plant;
  plant.model = "linear";
  plant.parameters.set("A", 1.0);
  plant.overrides[AgentId{2}].parameters.set("A", 400.0);
  plant.initial = {{"x", same(1.0)}};
  Physics physics = physics_of(with_plant(plant, 2, 1.0));
  try {
    for (int k = 0; k < 10; ++k) physics.advance();
    FAIL() << "a state beyond every number went unnoticed";
  } catch (const RunError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("linear"), std::string::npos) << text;
    EXPECT_NE(text.find("agent 2"), std::string::npos) << text;
    EXPECT_NE(text.find("round 1"), std::string::npos) << text;
  }
}

TEST(Models, RefuseWhatMakesNoSense) {
  const auto refusal = [](const PlantSpec& plant) -> std::string {
    try {
      static_cast<void>(physics_of(with_plant(plant, 2, 0.1)));
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  PlantSpec plant = integrators(2, {0.0, 0.0});
  plant.parameters.set("ordr", 2.0);
  EXPECT_NE(refusal(plant).find("order"), std::string::npos);
  plant = integrators(2, {0.0, 0.0});
  plant.parameters.set("order", 1.5);
  EXPECT_NE(refusal(plant).find("whole number"), std::string::npos);
  plant = integrators(1, {0.0, 0.0});
  plant.initial.push_back({"velocity", same(1.0)});
  EXPECT_NE(refusal(plant).find("velocity"), std::string::npos);
  plant = integrators(1, {0.0, 0.0});
  plant.disturbances = {{Disturbance::On::input, Disturbance::Constant{same(Matrix(Vector::Zero(3)))}, 1, {}}};
  EXPECT_NE(refusal(plant).find("plant.disturbances[0], agent 1"), std::string::npos);
  plant = {};
  plant.model = "linear";
  plant.parameters.set("A", Matrix(Matrix::Zero(2, 3)));
  EXPECT_NE(refusal(plant).find("square"), std::string::npos);
  plant.model = "liner";
  EXPECT_NE(refusal(plant).find("linear"), std::string::npos);
}

TEST(Models, AreDescribedInTheTable) {
  for (const PlantEntry& entry : plant_table()) {
    SCOPED_TRACE(entry.name);
    EXPECT_FALSE(entry.summary.empty());
    EXPECT_EQ(&find_plant(entry.name), &entry);
  }
}

}  // namespace
}  // namespace consort
