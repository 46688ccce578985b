#include "core/network/link.hpp"

#include "core/errors.hpp"
#include "core/math/decompositions.hpp"
#include "tests/core/cases.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace consort {
namespace {

using cases::edge;

Vector noise_of(const Link& link, Round sent, Eigen::Index size) {
  Vector field = Vector::Zero(size);
  link.disturb(sent, std::span(field.data(), static_cast<std::size_t>(size)));
  return field;
}

/// Second moments of the noise of many rounds.
Matrix sample_covariance(const Link& link, Eigen::Index size, Round rounds) {
  Matrix sum = Matrix::Zero(size, size);
  for (Round k = 0; k < rounds; ++k) {
    const Vector noise = noise_of(link, k, size);
    sum += noise * noise.transpose();
  }
  return sum / static_cast<double>(rounds);
}

void expect_sampled(const Matrix& covariance, const LinkSpec& spec) {
  constexpr Round kRounds = 40000;
  const Link link(edge(1, 2), spec, covariance.rows(), Seed{6});
  const Matrix sample = sample_covariance(link, covariance.rows(), kRounds);
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    for (Eigen::Index j = 0; j < covariance.cols(); ++j) {
      // Variance of a second moment of normal variables.
      const double variance = covariance(i, i) * covariance(j, j) + covariance(i, j) * covariance(i, j);
      EXPECT_NEAR(sample(i, j), covariance(i, j), 5 * std::sqrt(variance / kRounds) + 1e-14) << i << ' ' << j;
    }
  }
}

TEST(Link, IsIdealByDefaultAndWithoutEffectiveNoise) {
  const Link link(edge(1, 2), {}, 3, Seed{1});
  EXPECT_TRUE(link.ideal());
  EXPECT_FALSE(link.lost(0));
  EXPECT_EQ(link.delay(0), 0U);
  EXPECT_FALSE(link.disturbs());
  EXPECT_EQ(noise_of(link, 0, 3), Vector(Vector::Zero(3)));
  EXPECT_TRUE(Link(edge(1, 2), {.noise_covariance = Matrix::Zero(1, 1)}, 3, Seed{1}).ideal());
  EXPECT_TRUE(Link(edge(1, 2), {.noise_covariance = Matrix::Ones(1, 1)}, 0, Seed{1}).ideal());
  EXPECT_FALSE(Link(edge(1, 2), {.noise_covariance = Matrix::Ones(1, 1)}, 1, Seed{1}).ideal());
  EXPECT_FALSE(Link(edge(1, 2), {.delay_rounds = 1}, 1, Seed{1}).ideal());
  EXPECT_FALSE(Link(edge(1, 2), {.loss_probability = 0.1}, 1, Seed{1}).ideal());
}

TEST(Link, RefusesWhatMakesNoSense) {
  for (const double probability : {-0.01, 1.01, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(Link(edge(1, 2), {.loss_probability = probability}, 1, Seed{1}), ConfigError);
  }
  EXPECT_THROW(Link(edge(1, 2), {.noise_covariance = Matrix::Identity(2, 2)}, 3, Seed{1}), ConfigError);
  EXPECT_THROW(Link(edge(1, 2), {.noise_covariance = -Matrix::Identity(2, 2)}, 2, Seed{1}), ConfigError);
  EXPECT_THROW(Link(edge(1, 2), {.noise_covariance = (Matrix(2, 2) << 1, 2, 2, 1).finished()}, 2, Seed{1}), ConfigError);
  Vector field = Vector::Zero(2);
  EXPECT_THROW(Link(edge(1, 2), {.noise_covariance = Matrix::Ones(1, 1)}, 3, Seed{1}).disturb(0, std::span(field.data(), 2)),
               ContractViolation);
}

TEST(Loss, HasTheProbabilityGivenAndIsKeyedByEdgeAndRound) {
  constexpr int kRounds = 40000;
  const LinkSpec spec{.loss_probability = 0.2};
  const Link there(edge(1, 2), spec, 1, Seed{1}), back(edge(2, 1), spec, 1, Seed{1});
  int lost = 0, differently = 0;
  for (Round k = 0; k < kRounds; ++k) {
    lost += there.lost(k);
    differently += there.lost(k) != back.lost(k);
    ASSERT_EQ(there.lost(k), Link(edge(1, 2), spec, 1, Seed{1}).lost(k));
  }
  EXPECT_NEAR(lost, kRounds * 0.2, 5 * std::sqrt(kRounds * 0.16));
  EXPECT_NEAR(differently, kRounds * 0.32, 5 * std::sqrt(kRounds * 0.32 * 0.68));  // independent: 2 * 0.2 * 0.8
}

TEST(Loss, OfProbabilityOneTakesEverything) {
  const Link link(edge(1, 2), {.loss_probability = 1.0}, 1, Seed{1});
  for (Round k = 0; k < 1000; ++k) ASSERT_TRUE(link.lost(k));
}

TEST(Noise, HasTheCovarianceGivenInEveryForm) {
  const Matrix full = (Matrix(3, 3) << 4, 1, -1, 1, 2, 0.5, -1, 0.5, 1).finished();
  expect_sampled(full, {.noise_covariance = full});
  expect_sampled(0.1 * Matrix::Identity(2, 2), {.noise_covariance = Matrix::Constant(1, 1, 0.1)});
  expect_sampled(Matrix(Vector(Vector::LinSpaced(3, 0, 2)).asDiagonal()), {.noise_covariance = Vector::LinSpaced(3, 0, 2)});
}

TEST(Noise, OfASingularCovarianceStaysInItsRange) {
  const Vector direction = (Vector(3) << 1, -2, 3).finished();
  const Matrix singular = direction * direction.transpose();
  const Link link(edge(1, 2), {.noise_covariance = singular}, 3, Seed{2});
  for (Round k = 0; k < 100; ++k) {
    const Vector noise = noise_of(link, k, 3);
    ASSERT_GT(noise.norm(), 0.0);
    ASSERT_LT((noise - direction * (noise.dot(direction) / direction.squaredNorm())).norm(), 1e-7 * noise.norm());
  }
  expect_sampled(singular, {.noise_covariance = singular});
  // Rank one, with the variance in the last component only: pivoting has to find it.
  Matrix last = Matrix::Zero(2, 2);
  last(1, 1) = 9;
  expect_sampled(last, {.noise_covariance = last});
}

TEST(Noise, FactorReproducesEveryPositiveSemidefiniteMatrix) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"factor"});
    const auto n = static_cast<Eigen::Index>(2 + stream.below(4));
    const auto rank = static_cast<Eigen::Index>(1 + stream.below(static_cast<std::uint64_t>(n)));
    const Matrix a = Matrix::NullaryExpr(n, rank, [&] { return stream.normal(); });
    const Matrix covariance = a * a.transpose();
    const Link link(edge(1, 2), {.noise_covariance = covariance}, n, Seed{seed});
    // The noise is linear in standard normal draws that do not depend on the covariance: with the identity the draws themselves come out.
    const Link draws(edge(1, 2), {.noise_covariance = Matrix::Identity(n, n)}, n, Seed{seed});
    Matrix z(n, n), noise(n, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      z.col(k) = noise_of(draws, static_cast<Round>(k), n);
      noise.col(k) = noise_of(link, static_cast<Round>(k), n);
    }
    const Matrix factor = noise * inverse(z, "z");
    const double worst = (factor * factor.transpose() - covariance).cwiseAbs().maxCoeff();
    const double condition = z.norm() * inverse(z, "z").norm();
    ASSERT_LT(worst, 1e-12 * condition * condition * covariance.norm()) << factor * factor.transpose() << "\n\n" << covariance;
  }
}

TEST(Noise, IsTheSameWheneverItIsAsked) {
  const LinkSpec spec{.noise_covariance = Matrix::Constant(1, 1, 2.0)};
  const Link link(edge(3, 4), spec, 2, Seed{1});
  const Vector first = noise_of(link, 5, 2);
  EXPECT_NE(noise_of(link, 6, 2), first);
  EXPECT_EQ(noise_of(link, 5, 2), first);
  EXPECT_NE(noise_of(Link(edge(4, 3), spec, 2, Seed{1}), 5, 2), first);
  EXPECT_NE(noise_of(Link(edge(3, 4), spec, 2, Seed{2}), 5, 2), first);
}

TEST(LinkModel, PrefersTheOverrideOfAnEdge) {
  LinkModel model;
  model.standard.loss_probability = 0.25;
  model.overrides[edge(1, 2)].delay_rounds = 3;
  EXPECT_EQ(model.of(edge(1, 2)).loss_probability, 0.0);
  EXPECT_EQ(model.of(edge(1, 2)).delay_rounds, 3U);
  EXPECT_EQ(model.of(edge(2, 1)).loss_probability, 0.25);
}

}  // namespace
}  // namespace consort
