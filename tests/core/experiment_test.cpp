#include "core/experiment.hpp"

#include "core/errors.hpp"
#include "tests/core/cases.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

Matrix scalar(double value) { return Matrix::Constant(1, 1, value); }

TEST(PerAgent, SameAndListAreTakenAsTheyAre) {
  const PerAgent same{PerAgent::Same{scalar(3)}}, list{PerAgent::List{{scalar(1), scalar(2)}}};
  EXPECT_EQ(same.of(AgentId{2}, 2, "x", Seed{1}), scalar(3));
  EXPECT_EQ(list.of(AgentId{2}, 2, "x", Seed{1}), scalar(2));
  EXPECT_THROW((void)same.of(AgentId{3}, 2, "x", Seed{1}), ContractViolation);
  EXPECT_THROW((void)same.of(AgentId{0}, 2, "x", Seed{1}), ContractViolation);
}

TEST(PerAgent, AListNeedsOneEntryPerAgent) {
  const PerAgent list{PerAgent::List{{scalar(1), scalar(2)}}};
  try {
    (void)list.of(AgentId{1}, 3, "x", Seed{1});
    FAIL() << "nothing was thrown";
  } catch (const ConfigError& error) {
    EXPECT_STREQ(error.what(), "initial 'x': the list has 2 entries; allowed: one per agent, 3");
  }
}

TEST(PerAgent, LinspaceGoesFromFirstToLast) {
  const PerAgent spread{PerAgent::Linspace{5, 7, 2}};
  EXPECT_EQ(spread.of(AgentId{1}, 10, "x", Seed{1}), Matrix(Matrix::Constant(2, 1, 5.0)));
  EXPECT_EQ(spread.of(AgentId{10}, 10, "x", Seed{1}), Matrix(Matrix::Constant(2, 1, 7.0)));
  EXPECT_DOUBLE_EQ(spread.of(AgentId{4}, 10, "x", Seed{1})(1, 0), 5 + 2.0 / 3);
  EXPECT_EQ(spread.of(AgentId{1}, 1, "x", Seed{1})(0, 0), 5.0);
}

TEST(PerAgent, UniformIsKeyedBySeedNameAgentAndComponent) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const PerAgent drawn{PerAgent::Uniform{-1, 3, 4}};
    const Matrix value = drawn.of(AgentId{2}, 5, "x", Seed{seed});
    ASSERT_TRUE((value.array() >= -1.0).all() && (value.array() < 3.0).all());
    ASSERT_EQ(value, drawn.of(AgentId{2}, 50, "x", Seed{seed}));  // more agents change nothing
    ASSERT_EQ(value.topRows(2), (PerAgent{PerAgent::Uniform{-1, 3, 2}}.of(AgentId{2}, 5, "x", Seed{seed})));
    ASSERT_NE(value, drawn.of(AgentId{3}, 5, "x", Seed{seed}));
    ASSERT_NE(value, drawn.of(AgentId{2}, 5, "P", Seed{seed}));
    ASSERT_NE(value, drawn.of(AgentId{2}, 5, "x", Seed{seed + 1}));
    ASSERT_EQ(value(3, 0), Seed{seed}.stream(Purpose{"initial x"}, 2, 3).uniform(-1, 3));
  }
}

TEST(Experiment, PutsAnAgentsOverridesOnTop) {
  Experiment experiment;
  experiment.agents = 2;
  experiment.initial = {{"x", {PerAgent::Linspace{0, 1, 1}}}, {"P", {PerAgent::Same{scalar(4)}}}};
  experiment.protocols.resize(1);
  experiment.protocols[0].parameters.set("Q", 0.1);
  experiment.overrides[AgentId{2}].initial.set("P", 0.001);
  experiment.overrides[AgentId{2}].parameters.set("Q", 0.2);
  EXPECT_EQ(experiment.initial_of(AgentId{1}, Seed{1}).scalar("P"), 4.0);
  EXPECT_EQ(experiment.initial_of(AgentId{2}, Seed{1}).scalar("P"), 0.001);
  EXPECT_EQ(experiment.initial_of(AgentId{2}, Seed{1}).scalar("x"), 1.0);
  EXPECT_EQ(experiment.parameters_of(experiment.protocols[0], AgentId{1}).scalar("Q"), 0.1);
  EXPECT_EQ(experiment.parameters_of(experiment.protocols[0], AgentId{2}).scalar("Q"), 0.2);
}

TEST(ReportInterval, IsTheSmallestThatKeepsTheTraceInItsBudget) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"interval"});
    Experiment experiment;
    experiment.rounds = static_cast<Round>(1 + stream.below(1'000'000));
    experiment.agents = 1 + stream.below(3000);
    const double m = experiment.report_interval();
    const double volume = static_cast<double>(experiment.rounds) * static_cast<double>(experiment.agents);
    ASSERT_TRUE(volume / m <= 100'000 || m == experiment.rounds);
    ASSERT_TRUE(m == 1 || volume / (m - 1) > 100'000);
  }
}

TEST(ReportInterval, FollowsTheUserAndIsNeverZero) {
  Experiment experiment;
  experiment.agents = 10;
  experiment.rounds = 300;
  EXPECT_EQ(experiment.report_interval(), 1U);
  experiment.rounds = 0;
  EXPECT_EQ(experiment.report_interval(), 1U);
  experiment.agents = 1'000'000;
  experiment.rounds = 5;
  EXPECT_EQ(experiment.report_interval(), 5U);  // never longer than the run
  experiment.report_every = 7;
  EXPECT_EQ(experiment.report_interval(), 7U);
  experiment.report_every = 0;
  EXPECT_THROW((void)experiment.report_interval(), ContractViolation);
}

}  // namespace
}  // namespace consort
