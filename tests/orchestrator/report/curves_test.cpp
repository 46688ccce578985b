#include "orchestrator/report/curves.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

namespace consort {
namespace {

const double kNaN = std::numeric_limits<double>::quiet_NaN();

Curves thinned(const std::vector<double>& values, std::size_t most) {
  Decimation decimation(1, values.size(), most);
  for (std::size_t i = 0; i < values.size(); ++i) decimation.add(static_cast<double>(i), std::span(&values[i], 1));
  return decimation.finish();
}

TEST(Decimation, KeepsEverythingThatFits) {
  const Curves curves = thinned({3, 1, 4, 1, 5, 9, 2, 6}, 8);
  EXPECT_FALSE(curves.thinned);
  EXPECT_EQ(curves.y[0], (std::vector<double>{3, 1, 4, 1, 5, 9, 2, 6}));
  EXPECT_EQ(curves.x, (std::vector<double>{0, 1, 2, 3, 4, 5, 6, 7}));
}

TEST(Decimation, KeepsEveryPeakAndBothEnds) {
  for (std::size_t peak = 1; peak < 999; peak += 13) {
    std::vector<double> values(1000, 0.0);
    values.front() = 7.0;
    values.back() = -7.0;
    values[peak] = 100.0;
    const Curves curves = thinned(values, 40);
    EXPECT_TRUE(curves.thinned);
    EXPECT_LE(curves.x.size(), 40u);
    EXPECT_EQ(curves.y[0].front(), 7.0);
    EXPECT_EQ(curves.y[0].back(), -7.0);
    EXPECT_EQ(std::count(curves.y[0].begin(), curves.y[0].end(), 100.0), 1) << peak;
    EXPECT_TRUE(std::is_sorted(curves.x.begin(), curves.x.end()));
  }
}

TEST(Decimation, KeepsTheOrderOfSmallestAndLargest) {
  std::vector<double> rising, falling;
  for (int i = 0; i < 500; ++i) {
    rising.push_back(i);
    falling.push_back(-i);
  }
  const Curves up = thinned(rising, 20), down = thinned(falling, 20);
  EXPECT_TRUE(std::is_sorted(up.y[0].begin(), up.y[0].end()));
  EXPECT_TRUE(std::is_sorted(down.y[0].rbegin(), down.y[0].rend()));
}

TEST(Decimation, LeavesOutWhatIsNotThere) {
  std::vector<double> values(300, kNaN);
  for (std::size_t i = 150; i < 300; ++i) values[i] = static_cast<double>(i);
  const Curves curves = thinned(values, 30);
  EXPECT_TRUE(std::isnan(curves.y[0].front()));
  EXPECT_EQ(curves.y[0].back(), 299.0);
  for (std::size_t i = 0; i < curves.x.size(); ++i)
    if (!std::isnan(curves.y[0][i])) {
      EXPECT_GE(curves.y[0][i], 150.0);
    }
}

TEST(Quantiles, InterpolateBetweenOrderStatistics) {
  std::vector<double> values{4, kNaN, 1, 3, 2};
  const std::vector<double> shares{0.0, 0.25, 0.5, 1.0};
  EXPECT_EQ(quantiles(values, shares), (std::vector<double>{1, 1.75, 2.5, 4}));
  std::vector<double> nothing{kNaN};
  EXPECT_TRUE(std::isnan(quantiles(nothing, shares)[0]));
}

}  // namespace
}  // namespace consort
