#include "core/random.hpp"

#include "core/errors.hpp"
#include "tests/core/cases.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace consort {
namespace {

using Words2 = std::array<std::uint64_t, 2>;
using Words4 = std::array<std::uint64_t, 4>;
constexpr std::uint64_t kOnes = 0xffffffffffffffffULL;

// The three known answers that Random123 publishes for philox4x64 with ten rounds.
TEST(Philox, GivesTheKnownAnswersOfRandom123) {
  EXPECT_EQ(philox({0, 0}, {0, 0, 0, 0}), (Words4{0x16554d9eca36314c, 0xdb20fe9d672d0fdc, 0xd7e772cee186176b, 0x7e68b68aec7ba23b}));
  EXPECT_EQ(philox({kOnes, kOnes}, {kOnes, kOnes, kOnes, kOnes}),
            (Words4{0x87b092c3013fe90b, 0x438c3c67be8d0224, 0x9cc7d7c69cd777b6, 0xa09caebf594f0ba0}));
  EXPECT_EQ(
      philox({0x452821e638d01377, 0xbe5466cf34e90c6c}, {0x243f6a8885a308d3, 0x13198a2e03707344, 0xa4093822299f31d0, 0x082efa98ec4e6c89}),
      (Words4{0xa528f45403e61d95, 0x38c72dbd566e9788, 0xa5a1610e72fd18b5, 0x57bd43b5e52b7fe6}));
}

TEST(Stream, IsPhiloxOfSeedPurposeKeysAndBlock) {
  const Purpose purpose{"any"};
  Stream stream(3, purpose, 5, 7, 11);
  for (std::uint64_t block = 0; block < 3; ++block) {
    for (const std::uint64_t word : philox({3, purpose.hash}, {5, 7, 11, block})) EXPECT_EQ(stream.bits(), word);
  }
}

TEST(Stream, ChangesWithEveryPartOfTheKey) {
  std::set<std::uint64_t> firsts;
  for (const Seed seed : {Seed{1}, Seed{2}}) {
    for (const Purpose purpose : {Purpose{"one"}, Purpose{"two"}}) {
      for (std::uint64_t key = 0; key < 8; ++key) firsts.insert(seed.stream(purpose, key & 1, (key >> 1) & 1, key >> 2).bits());
    }
  }
  EXPECT_EQ(firsts.size(), 32U);
}

TEST(Stream, ContinuesEquallyAfterACopy) {
  Stream stream = Seed{4}.stream(Purpose{"copy"});
  stream.normal();  // leaves a spare
  Stream copy = stream;
  for (int i = 0; i < 9; ++i) EXPECT_EQ(stream.normal(), copy.normal());
}

TEST(Stream, UniformStaysInItsIntervalForEverySeed) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"interval"});
    for (int i = 0; i < 50; ++i) {
      const double unit = stream.uniform();
      ASSERT_TRUE(unit >= 0.0 && unit < 1.0);
      const double value = stream.uniform(-3.0, 7.5);
      ASSERT_TRUE(value >= -3.0 && value < 7.5);
      // So narrow that rounding would reach the excluded end about every second time.
      const double narrow = stream.uniform(1.0, std::nextafter(1.0, 2.0));
      ASSERT_EQ(narrow, 1.0);
      ASSERT_LT(stream.below(7), 7U);
    }
  }
}

TEST(Stream, DegenerateRangesHaveOneValue) {
  Stream stream = Seed{1}.stream(Purpose{"degenerate"});
  EXPECT_EQ(stream.uniform(2.5, 2.5), 2.5);
  EXPECT_EQ(stream.below(1), 0U);
  EXPECT_THROW(stream.below(0), ContractViolation);
}

TEST(Stream, BelowReachesTheWholeRangeOfLargeBounds) {
  // With n = 3 * 2^62 every fourth word is rejected; thirds of the range must still be equally likely.
  constexpr std::uint64_t kBound = 3ULL << 62;
  Stream stream = Seed{9}.stream(Purpose{"large bound"});
  std::array<int, 3> thirds{};
  for (int i = 0; i < 30000; ++i) ++thirds[stream.below(kBound) >> 62];
  for (const int count : thirds) EXPECT_NEAR(count, 10000, 5 * std::sqrt(30000 * (1.0 / 3) * (2.0 / 3)));
}

TEST(Stream, BelowIsUniform) {
  constexpr int kDraws = 70000;
  Stream stream = Seed{2}.stream(Purpose{"dice"});
  std::array<int, 7> counts{};
  for (int i = 0; i < kDraws; ++i) ++counts[stream.below(7)];
  double chi_square = 0.0;
  for (const int count : counts) chi_square += std::pow(count - kDraws / 7.0, 2) / (kDraws / 7.0);
  EXPECT_LT(chi_square, 30.0);  // 6 degrees of freedom: exceeded with probability 4e-5
  EXPECT_GT(chi_square, 0.1);   // too even would be as suspicious
}

TEST(Stream, UniformHasTheMomentsOfTheUniformLaw) {
  constexpr int kDraws = 100000;
  double sum = 0.0, squares = 0.0;
  std::array<int, 16> bins{};
  // One draw from each of many streams: it is the keys that must give independent values.
  for (int i = 0; i < kDraws; ++i) {
    const double value = Seed{7}.stream(Purpose{"moments"}, static_cast<std::uint64_t>(i)).uniform();
    sum += value;
    squares += value * value;
    ++bins[static_cast<std::size_t>(value * 16)];
  }
  EXPECT_NEAR(sum / kDraws, 0.5, 5 * std::sqrt(1.0 / 12 / kDraws));
  EXPECT_NEAR(squares / kDraws, 1.0 / 3, 5 * std::sqrt(4.0 / 45 / kDraws));
  double chi_square = 0.0;
  for (const int count : bins) chi_square += std::pow(count - kDraws / 16.0, 2) / (kDraws / 16.0);
  EXPECT_LT(chi_square, 50.0);  // 15 degrees of freedom: exceeded with probability 1e-5
}

TEST(Stream, NormalHasTheMomentsOfTheNormalLaw) {
  constexpr int kDraws = 200000;
  Stream stream = Seed{8}.stream(Purpose{"bell"});
  double sum = 0.0, squares = 0.0, cubes = 0.0, fourths = 0.0, neighbours = 0.0, previous = 0.0;
  int within_one = 0, beyond_three = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double value = stream.normal();
    ASSERT_TRUE(std::isfinite(value));
    sum += value;
    squares += value * value;
    cubes += value * value * value;
    fourths += value * value * value * value;
    neighbours += value * previous;
    previous = value;
    within_one += std::abs(value) < 1.0;
    beyond_three += std::abs(value) > 3.0;
  }
  const double root = std::sqrt(double{kDraws});
  EXPECT_NEAR(sum / kDraws, 0.0, 5 / root);
  EXPECT_NEAR(squares / kDraws, 1.0, 5 * std::sqrt(2.0) / root);
  EXPECT_NEAR(cubes / kDraws, 0.0, 5 * std::sqrt(15.0) / root);
  EXPECT_NEAR(fourths / kDraws, 3.0, 5 * std::sqrt(96.0) / root);
  EXPECT_NEAR(neighbours / kDraws, 0.0, 5 / root);  // cosine and sine of one pair are independent
  EXPECT_NEAR(within_one, 0.682689 * kDraws, 5 * std::sqrt(0.2166 * kDraws));
  EXPECT_NEAR(beyond_three, 0.0026998 * kDraws, 5 * std::sqrt(0.0027 * kDraws));
}

TEST(Stream, NeighbouringKeysAreUncorrelated) {
  constexpr int kDraws = 50000;
  double by_key = 0.0, by_seed = 0.0;
  for (std::uint64_t i = 0; i < kDraws; ++i) {
    const double value = Seed{3}.stream(Purpose{"pairs"}, i).normal();
    by_key += value * Seed{3}.stream(Purpose{"pairs"}, i + 1).normal();
    by_seed += value * Seed{4}.stream(Purpose{"pairs"}, i).normal();
  }
  EXPECT_NEAR(by_key / kDraws, 0.0, 5 / std::sqrt(double{kDraws}));
  EXPECT_NEAR(by_seed / kDraws, 0.0, 5 / std::sqrt(double{kDraws}));
}

}  // namespace
}  // namespace consort
