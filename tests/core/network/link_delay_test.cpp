#include "core/errors.hpp"
#include "core/network/link.hpp"
#include "tests/core/cases.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

namespace consort {
namespace {

using cases::edge;

Link late(const LinkSpec& spec, std::uint64_t seed = 1) { return Link(edge(1, 2), spec, 1, Seed{seed}); }

/// Every delay occurs as often as `probability` says.
void expect_distribution(const LinkSpec& spec, Round longest, const std::function<double(Round)>& probability) {
  constexpr int kRounds = 40000;
  const Link link = late(spec);
  std::map<Round, int> counts;
  for (Round k = 0; k < kRounds; ++k) ++counts[link.delay(k)];
  double rest = 1.0;
  for (Round d = 0; d <= longest; ++d) {
    const double p = probability(d);
    rest -= p;
    EXPECT_NEAR(counts[d], kRounds * p, 5 * std::sqrt(kRounds * p * (1 - p)) + 1e-9) << d;
  }
  EXPECT_NEAR(rest, 0.0, 1e-3);
}

TEST(Delay, UniformTakesEveryWholeNumberOfRoundsEquallyOften) {
  const LinkSpec spec{.delay_rounds = 2, .jitter = {Jitter::Kind::uniform, 0.0, 3.0}};
  expect_distribution(spec, 7, [](Round d) { return d >= 2 && d <= 5 ? 0.25 : 0.0; });
}

TEST(Delay, ExponentialIsRoundedUpToWholeRounds) {
  const LinkSpec spec{.delay_rounds = 1, .jitter = {Jitter::Kind::exponential, 2.0, 0.0}};
  const auto distribution = [](double d) { return d < 0 ? 0.0 : 1.0 - std::exp(-d / 2.0); };
  expect_distribution(spec, 25, [&](Round d) { return d < 2 ? 0.0 : distribution(d - 1.0) - distribution(d - 2.0); });
}

TEST(Delay, NormalIsTruncatedAtZeroAndRoundedUp) {
  const LinkSpec spec{.jitter = {Jitter::Kind::normal, 1.0, 2.0}};
  const auto phi = [](double d) { return 0.5 * std::erfc(-(d - 1.0) / 2.0 / std::sqrt(2.0)); };
  const double kept = 1.0 - phi(0.0);
  expect_distribution(spec, 12, [&](Round d) { return d == 0 ? 0.0 : (phi(d) - phi(d - 1.0)) / kept; });
}

TEST(Delay, OfNoSpreadIsTheMean) {
  const Link link = late({.jitter = {Jitter::Kind::normal, 3.0, 0.0}});
  for (Round k = 0; k < 100; ++k) ASSERT_EQ(link.delay(k), 3U);
}

TEST(Delay, IsCutWhereTheWireEnds) {
  const Link link = late({.delay_rounds = kLongestDelay, .jitter = {Jitter::Kind::exponential, 100.0, 0.0}});
  for (Round k = 0; k < 100; ++k) ASSERT_EQ(link.delay(k), kLongestDelay);
}

TEST(Reordering, MakesSomeMessagesLater) {
  constexpr int kRounds = 40000;
  const Link link = late({.delay_rounds = 1, .reordering = Reordering{0.25, 4}});
  int later = 0;
  for (Round k = 0; k < kRounds; ++k) {
    const Round delay = link.delay(k);
    ASSERT_TRUE(delay == 1 || delay == 5);
    later += delay == 5;
  }
  EXPECT_NEAR(later, kRounds * 0.25, 5 * std::sqrt(kRounds * 0.1875));
}

TEST(Duplication, CopiesSomeMessagesWithADelayOfTheirOwn) {
  constexpr int kRounds = 40000;
  const Link link = late({.jitter = {Jitter::Kind::uniform, 0.0, 1.0}, .duplication = 0.2});
  int copies = 0, differently = 0;
  for (Round k = 0; k < kRounds; ++k) {
    const auto again = link.copy_delay(k);
    if (!again) continue;
    ASSERT_LE(*again, 1U);
    ++copies;
    differently += *again != link.delay(k);
  }
  EXPECT_NEAR(copies, kRounds * 0.2, 5 * std::sqrt(kRounds * 0.16));
  EXPECT_NEAR(differently, copies / 2, 5 * std::sqrt(copies / 4.0));
  EXPECT_FALSE(late({.delay_rounds = 1}).copy_delay(0).has_value());
}

TEST(Distance, DecidesHowMuchIsLost) {
  constexpr int kRounds = 40000;
  const Link link = late({.distance = DistanceLoss{2.0, 6.0}});
  for (const auto& [distance, probability] : {std::pair{0.0, 0.0}, {2.0, 0.0}, {3.0, 0.25}, {5.0, 0.75}, {6.0, 1.0}, {100.0, 1.0}}) {
    int lost = 0;
    for (Round k = 0; k < kRounds; ++k) lost += link.lost(k, distance);
    EXPECT_NEAR(lost, kRounds * probability, 5 * std::sqrt(kRounds * probability * (1 - probability)) + 1e-9) << distance;
  }
  EXPECT_THROW(late({.distance = DistanceLoss{2.0, 2.0}}), ConfigError);
  EXPECT_THROW(late({.distance = DistanceLoss{-1.0, 2.0}}), ConfigError);
}

TEST(Quantiser, IsExactAtItsLevelsAndNeverFurtherThanHalfAStep) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"quantiser"});
    const double low = stream.uniform(-100.0, 50.0);
    const Quantiser quantiser{static_cast<std::uint32_t>(1 + stream.below(32)), low, low + stream.uniform(0.1, 100.0)};
    const double rounding = 1e-13;
    for (int i = 0; i < 50; ++i) {
      double value = stream.uniform(quantiser.low, quantiser.high), exact = value;
      quantiser.apply(std::span(&value, 1));
      ASSERT_LE(std::abs(value - exact), 0.5 * quantiser.step() + rounding);
      ASSERT_GE(value, quantiser.low);
      ASSERT_LE(value, quantiser.high);
      const double level = value;
      quantiser.apply(std::span(&value, 1));
      ASSERT_EQ(value, level);
    }
  }
}

TEST(Quantiser, SaturatesAtTheEndsOfItsRange) {
  const Quantiser quantiser{2, -1.0, 2.0};  // levels -1, 0, 1, 2
  std::vector<double> values{-1e9, -1.0, -0.6, -0.4, 0.4, 0.6, 1.6, 2.0, 1e9};
  quantiser.apply(values);
  EXPECT_EQ(values, (std::vector<double>{-1, -1, -1, 0, 0, 1, 2, 2, 2}));
}

TEST(Quantiser, ComesAfterTheNoise) {
  const Link link(edge(1, 2), {.noise_covariance = Matrix::Ones(1, 1), .quantiser = Quantiser{3, -3.5, 3.5}}, 2, Seed{1});
  EXPECT_TRUE(link.disturbs());
  for (Round k = 0; k < 100; ++k) {
    std::vector<double> field{0.2, 0.3};
    link.disturb(k, field);
    for (const double value : field) ASSERT_EQ(value - 0.5, std::round(value - 0.5));
  }
}

TEST(Link, RefusesDelaysCopiesAndLevelsThatMakeNoSense) {
  const double inf = std::numeric_limits<double>::infinity();
  for (const LinkSpec& wrong :
       {LinkSpec{.delay_rounds = kLongestDelay + 1}, LinkSpec{.jitter = {Jitter::Kind::uniform, 0.0, 1.5}},
        LinkSpec{.jitter = {Jitter::Kind::exponential, -1.0, 0.0}}, LinkSpec{.jitter = {Jitter::Kind::normal, 1.0, std::nan("")}},
        LinkSpec{.duplication = 1.1}, LinkSpec{.reordering = Reordering{0.5, 0}}, LinkSpec{.reordering = Reordering{-0.5, 1}},
        LinkSpec{.quantiser = Quantiser{0, 0.0, 1.0}}, LinkSpec{.quantiser = Quantiser{33, 0.0, 1.0}},
        LinkSpec{.quantiser = Quantiser{8, 1.0, 1.0}}, LinkSpec{.quantiser = Quantiser{8, 0.0, inf}}})
    EXPECT_THROW(late(wrong), ConfigError);
}

TEST(LinkModel, ChangesFromARoundOn) {
  LinkModel model;
  model.overrides[edge(1, 2)].delay_rounds = 3;
  model.changes.push_back({10, std::nullopt, {.loss_probability = 0.5}});
  model.changes.push_back({20, edge(1, 2), {.loss_probability = 0.25}});
  model.changes.push_back({20, edge(2, 1), {.loss_probability = 0.75}});
  EXPECT_EQ(model.of(edge(1, 2), 15).delay_rounds, 3U);  // a rule of its own outlives what changes for all
  EXPECT_EQ(model.of(edge(1, 2), 20).loss_probability, 0.25);
  EXPECT_EQ(model.of(edge(2, 1), 9).loss_probability, 0.0);
  EXPECT_EQ(model.of(edge(2, 1), 10).loss_probability, 0.5);
  EXPECT_EQ(model.of(edge(2, 1), 1000).loss_probability, 0.75);
  const auto periods = model.periods(edge(2, 1));
  ASSERT_EQ(periods.size(), 3U);
  EXPECT_EQ(periods[1].first, 10U);
  EXPECT_EQ(periods[2].first, 20U);
  EXPECT_EQ(model.periods(edge(1, 2)).size(), 2U);
  EXPECT_EQ(model.periods(edge(3, 1)).size(), 2U);
}

}  // namespace
}  // namespace consort
