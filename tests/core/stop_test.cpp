#include "core/stop.hpp"

#include "core/errors.hpp"
#include "tests/core/cases.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace consort {
namespace {

bool ends(StopRule& rule, Round k, std::vector<double> estimates) {
  return rule.ends(k, [&] { return consort::disagreement(estimates, estimates.size(), 1); });
}

TEST(Disagreement, IsTheLargestDistanceBetweenTwoAgents) {
  EXPECT_EQ(disagreement(std::vector<double>{1, 5, 3}, 3, 1), 4.0);
  EXPECT_EQ(disagreement(std::vector<double>{0, 0, 3, 4, 1, 1}, 3, 2), 5.0);
  EXPECT_EQ(disagreement(std::vector<double>{2, 2}, 2, 1), 0.0);
  EXPECT_EQ(disagreement(std::vector<double>{7}, 1, 1), 0.0);
  EXPECT_EQ(disagreement({}, 0, 1), 0.0);
  EXPECT_EQ(disagreement({}, 3, 0), 0.0);
  EXPECT_THROW(disagreement(std::vector<double>{1, 2, 3}, 2, 2), ContractViolation);
}

TEST(Disagreement, NeverHidesANumberThatIsNone) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& estimates : {std::vector<double>{nan, 1, 2, 3}, {1, 2, nan, 3}, {1, 2, 3, nan}}) {
    EXPECT_TRUE(std::isnan(disagreement(estimates, 4, 1)));
    EXPECT_TRUE(std::isnan(disagreement(estimates, 2, 2)));
  }
}

TEST(Disagreement, OnTheLineEqualsTheOneInThePlane) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"line"});
    std::vector<double> line, plane;
    for (std::uint64_t i = 0; i <= stream.below(10); ++i) {
      line.push_back(stream.uniform(-5, 5));
      plane.push_back(line.back());
      plane.push_back(1.5);
    }
    ASSERT_DOUBLE_EQ(disagreement(line, line.size(), 1), disagreement(plane, line.size(), 2));
  }
}

TEST(StopRule, EndsAfterTheRounds) {
  StopRule rule(10, std::nullopt);
  EXPECT_FALSE(ends(rule, 0, {0, 0}));
  EXPECT_FALSE(ends(rule, 9, {0, 0}));
  EXPECT_TRUE(ends(rule, 10, {0, 0}));
  EXPECT_FALSE(rule.converged());
}

TEST(StopRule, EndsWhenTheDisagreementHasBeenSmallForLongEnough) {
  StopRule rule(100, Convergence{0.5, 3});
  EXPECT_FALSE(ends(rule, 0, {0, 0.4}));
  EXPECT_FALSE(ends(rule, 1, {0, 0.5}));  // the bound itself is small enough
  EXPECT_FALSE(ends(rule, 2, {0, 0.6}));  // starts again
  EXPECT_FALSE(ends(rule, 3, {0, 0.1}));
  EXPECT_FALSE(ends(rule, 4, {0, 0.1}));
  EXPECT_FALSE(rule.converged());
  EXPECT_TRUE(ends(rule, 5, {0, 0.1}));
  EXPECT_TRUE(rule.converged());
}

TEST(StopRule, CountsTheRoundsBetweenReports) {
  StopRule rule(100, Convergence{0.5, 10});
  EXPECT_FALSE(ends(rule, 20, {0, 0.1}));
  EXPECT_FALSE(ends(rule, 28, {0, 0.1}));  // nine rounds
  EXPECT_TRUE(ends(rule, 29, {0, 0.1}));
}

TEST(StopRule, MayConvergeInTheFirstAndInTheLastReport) {
  StopRule at_once(100, Convergence{0.5, 1});
  EXPECT_TRUE(ends(at_once, 0, {1, 1}));
  EXPECT_TRUE(at_once.converged());
  StopRule at_last(7, Convergence{0.5, 1});
  EXPECT_FALSE(ends(at_last, 0, {0, 1}));
  EXPECT_TRUE(ends(at_last, 7, {0, 0}));
  EXPECT_TRUE(at_last.converged());
  StopRule never(7, Convergence{0.5, 1});
  EXPECT_TRUE(ends(never, 7, {0, std::numeric_limits<double>::quiet_NaN()}));
  EXPECT_FALSE(never.converged());
}

TEST(Disagreement, OfNobodyIsNoNumber) {
  const std::vector<double> nobody(3, kAbsent), one{kAbsent, 4.0, kAbsent};
  EXPECT_TRUE(std::isnan(disagreement(nobody, 3, 1)));
  EXPECT_TRUE(std::isnan(disagreement(std::span(nobody).first(1), 1, 1)));
  EXPECT_EQ(disagreement(one, 3, 1), 0.0);
  EXPECT_EQ(disagreement(std::span(one).subspan(1, 1), 1, 1), 0.0);
}

}  // namespace
}  // namespace consort
