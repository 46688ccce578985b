#include "core/errors.hpp"
#include "core/network/link.hpp"
#include "tests/core/cases.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace consort {
namespace {

using cases::edge;

Link bursty(const BurstLoss& bursts, std::uint64_t seed = 1) { return Link(edge(1, 2), {.bursts = bursts}, 1, Seed{seed}); }

/// The definition: one chain, moved round by round.
std::vector<bool> chain(const BurstLoss& bursts, Round rounds, Seed seed) {
  const auto u = [&](Round k) { return seed.stream(Purpose{"link state"}, 1, 2, k).uniform(); };
  std::vector<bool> bad{u(0) < bursts.bad_share()};
  for (Round k = 1; k < rounds; ++k) bad.push_back(u(k) < (bad.back() ? 1.0 - bursts.bad_to_good : bursts.good_to_bad));
  return bad;
}

TEST(Bursts, StateIsTheChainsFromWhateverRoundItIsAsked) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"bursts"});
    BurstLoss bursts{stream.uniform(), stream.uniform()};
    if (seed == 0) bursts = {1.0, 1.0};  // good and bad in turn: nothing is ever forgotten
    if (seed == 1) bursts = {0.0, 1.0};
    if (seed == 2) bursts = {1e-3, 1e-3};
    constexpr Round kRounds = 200;
    const std::vector<bool> expected = chain(bursts, kRounds, Seed{seed});
    const Link ascending = bursty(bursts, seed), descending = bursty(bursts, seed), anywhere = bursty(bursts, seed);
    for (Round k = 0; k < kRounds; ++k) {
      ASSERT_EQ(ascending.bad(k), expected[k]) << k;
      ASSERT_EQ(descending.bad(kRounds - 1 - k), expected[kRounds - 1 - k]) << k;
      ASSERT_EQ(bursty(bursts, seed).bad(k), expected[k]) << k;
      const auto round = static_cast<Round>(stream.below(kRounds));
      ASSERT_EQ(anywhere.bad(round), expected[round]) << round;
    }
  }
}

TEST(Bursts, LossIsThatOfTheStationaryDistributionFromTheFirstRoundOn) {
  const BurstLoss bursts{0.05, 0.2, 0.02, 0.7};
  EXPECT_NEAR(bursts.bad_share(), 0.2, 1e-15);
  EXPECT_NEAR(bursts.mean_loss(), 0.8 * 0.02 + 0.2 * 0.7, 1e-15);
  constexpr int kSeeds = 20000;
  for (const Round k : {Round{0}, Round{1}, Round{7}}) {
    int lost = 0, bad = 0;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
      const Link link = bursty(bursts, seed);
      bad += link.bad(k);
      lost += link.lost(k);
    }
    EXPECT_NEAR(bad, kSeeds * 0.2, 5 * std::sqrt(kSeeds * 0.16)) << k;
    EXPECT_NEAR(lost, kSeeds * 0.156, 5 * std::sqrt(kSeeds * 0.156 * 0.844)) << k;
  }
}

/// Mean length of the runs of losses that begin and end within so many rounds, and their number.
std::pair<double, int> runs_of_losses(const Link& link, Round rounds) {
  int length = 0, runs = 0, sum = 0;
  for (Round k = 0; k < rounds; ++k) {
    if (link.lost(k)) {
      ++length;
    } else if (length > 0) {
      ++runs;
      sum += length;
      length = 0;
    }
  }
  return {static_cast<double>(sum) / runs, runs};
}

TEST(Bursts, AreAsLongAsTheFormulaSays) {
  // Gilbert's case: everything is lost in the bad state, nothing in the good one. Bursts are geometric with mean 1 / q.
  EXPECT_NEAR((BurstLoss{0.05, 0.25}.mean_burst()), 4.0, 1e-12);
  // Equal losses in both states: Bernoulli, with bursts of 1 / (1 - loss).
  EXPECT_NEAR((BurstLoss{0.3, 0.4, 0.2, 0.2}.mean_burst()), 1.25, 1e-12);
  for (const BurstLoss& bursts : {BurstLoss{0.05, 0.25}, BurstLoss{0.01, 0.1, 0.0, 0.8}, BurstLoss{0.1, 0.3, 0.05, 0.9}}) {
    const auto [length, runs] = runs_of_losses(bursty(bursts), 200000);
    // A run's length deviates by at most about its mean, as a geometric one does; 1 / sqrt(runs) of that remains.
    EXPECT_NEAR(length, bursts.mean_burst(), 5 * 1.5 * bursts.mean_burst() / std::sqrt(runs));
  }
}

TEST(Bursts, AreKeyedByEdge) {
  const BurstLoss bursts{0.1, 0.1};
  const Link there = bursty(bursts), back(edge(2, 1), {.bursts = bursts}, 1, Seed{1});
  int different = 0;
  for (Round k = 0; k < 20000; ++k) different += there.bad(k) != back.bad(k);
  EXPECT_NEAR(different, 10000, 3000);  // independent; the chains keep their state for ten rounds on average
}

TEST(Bursts, AddUpWithIndependentLosses) {
  const LinkSpec spec{.loss_probability = 0.5, .bursts = BurstLoss{0.2, 0.2}};
  EXPECT_NEAR(spec.mean_loss(), 0.75, 1e-15);
  const Link link(edge(1, 2), spec, 1, Seed{3});
  int lost = 0;
  for (Round k = 0; k < 40000; ++k) {
    if (link.bad(k)) {
      ASSERT_TRUE(link.lost(k));
    }
    lost += link.lost(k);
  }
  EXPECT_NEAR(lost, 30000, 1500);
}

TEST(Bursts, RefuseProbabilitiesThatAreNone) {
  for (const BurstLoss& wrong : {BurstLoss{-0.1, 0.5}, BurstLoss{0.1, 1.5}, BurstLoss{0.1, 0.5, std::nan(""), 1.0},
                                 BurstLoss{0.1, 0.5, 0.0, 2.0}, BurstLoss{0.0, 0.0}})
    EXPECT_THROW(bursty(wrong), ConfigError);
}

}  // namespace
}  // namespace consort
