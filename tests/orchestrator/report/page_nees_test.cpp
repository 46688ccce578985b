/// Whether the covariance that an estimator claims is that of its error, as a page draws it.

#include "orchestrator/report/page_nees.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

namespace consort {
namespace {

TEST(PageNees, IsTheErrorSquaredInUnitsOfItsCovariance) {
  EXPECT_DOUBLE_EQ(nees(std::array{1.0, 2.0}, std::array{1.0, 0.0, 0.0, 4.0}), 2.0);
  EXPECT_NEAR(nees(std::array{1.0, 1.0}, std::array{2.0, 1.0, 1.0, 2.0}), 2.0 / 3.0, 1e-15);
}

TEST(PageNees, IsNoNumberWhereTheCovarianceSaysNothing) {
  const double nothing = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(nees(std::array{1.0}, std::array{0.0})));
  EXPECT_TRUE(std::isnan(nees(std::array{1.0}, std::array{-1.0})));
  EXPECT_TRUE(std::isnan(nees(std::array{1.0, 1.0}, std::array{1.0, 2.0, 2.0, 1.0})));
  EXPECT_TRUE(std::isnan(nees(std::array{nothing}, std::array{1.0})));
}

TEST(PageNees, LiesWithinItsBandNineteenTimesOfTwenty) {
  const auto [low, high] = nees_band(2);  // chi-square with two degrees of freedom: 1 - exp(-x / 2)
  EXPECT_NEAR(low, -2.0 * std::log(0.975), 1e-12);
  EXPECT_NEAR(high, -2.0 * std::log(0.025), 1e-12);
}

}  // namespace
}  // namespace consort
