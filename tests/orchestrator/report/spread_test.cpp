#include "orchestrator/report/spread.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace consort {
namespace {

TEST(Spread, StudentsTIsThatOfTheTables) {
  // Abramowitz, Stegun 1964, table 26.10 (two-sided 0.95).
  const std::array<std::pair<std::size_t, double>, 8> table{
      {{1, 12.706}, {2, 4.303}, {3, 3.182}, {4, 2.776}, {10, 2.228}, {29, 2.045}, {30, 2.042}, {120, 1.980}}};
  for (const auto& [freedom, t] : table) EXPECT_NEAR(student_t95(freedom), t, 5.1e-4) << freedom;
  EXPECT_NEAR(student_t95(1), std::tan(0.475 * std::acos(-1.0)), 1e-10) << "Cauchy's distribution";
  EXPECT_NEAR(student_t95(1000), student_t95(1001), 1e-5) << "the exact series and the expansion meet";
  EXPECT_TRUE(std::isnan(student_t95(0)));
}

TEST(Spread, HasMeanIntervalAndQuantiles) {
  const Spread spread = spread_of(std::array{4.0, 1.0, 3.0, 2.0});
  EXPECT_EQ(spread.count, 4U);
  EXPECT_EQ(spread.mean, 2.5);
  EXPECT_NEAR(spread.deviation, std::sqrt(5.0 / 3.0), 1e-15);
  EXPECT_NEAR(spread.high - spread.mean, 3.182446 * spread.deviation / 2.0, 1e-6);
  EXPECT_EQ(spread.median, 2.5);
  EXPECT_EQ(spread.q25, 1.75);
  EXPECT_NEAR(spread.q95, 3.85, 1e-15);
}

TEST(Spread, OfOneNumberIsThatNumberAndOfNoneNothing) {
  const Spread one = spread_of(std::array{7.0}), none = spread_of({});
  EXPECT_EQ(one.mean, 7.0);
  EXPECT_EQ(one.median, 7.0);
  EXPECT_TRUE(std::isnan(one.low));
  EXPECT_TRUE(std::isnan(none.mean) && std::isnan(none.median));
}

}  // namespace
}  // namespace consort
