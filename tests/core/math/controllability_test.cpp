#include "core/math/controllability.hpp"

#include "core/math/decompositions.hpp"
#include "core/math/schur.hpp"
#include "tests/core/cases.hpp"
#include "tests/core/math/systems.hpp"

#include <gtest/gtest.h>
#include <Eigen/SVD>

#include <algorithm>

namespace consort {
namespace {

using namespace cases;

/// Smallest singular value of [A - lambda, B]: zero if and only if B does not reach lambda (Hautus).
double distance_from_rank_loss(const Matrix& A, const Matrix& B, std::complex<double> lambda) {
  Eigen::MatrixXcd pencil(A.rows(), A.rows() + B.cols());
  pencil << A - lambda * Matrix::Identity(A.rows(), A.rows()), B;
  return Eigen::JacobiSVD<Eigen::MatrixXcd>(pencil).singularValues().tail(1)(0);
}

/// A system in random coordinates whose last `rest` states the inputs do not reach.
struct Planted {
  Matrix A, B, rest;
  Eigen::Index reached;
};

Planted planted(Stream& stream) {
  const Eigen::Index reached = random_size(stream, 4), unreached = random_size(stream, 4), n = reached + unreached;
  Matrix A = random_matrix(stream, n, n), B = random_matrix(stream, n, random_size(stream, 3));
  A.bottomLeftCorner(unreached, reached).setZero();
  B.bottomRows(unreached).setZero();
  const Matrix U = random_rotation(stream, n);
  return {U * A * U.transpose(), U * B, A.bottomRightCorner(unreached, unreached), reached};
}

TEST(Controllability, SplitsOffThePartThatIsNotReached) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"controllable split"});
    const auto [A, B, rest, reached] = planted(stream);
    const Split split = controllable_split(A, B);
    ASSERT_EQ(split.dimension, reached);
    const Eigen::Index n = A.rows(), unreached = n - reached;
    const Matrix turned = split.U.transpose() * A * split.U;
    ASSERT_LT((split.U.transpose() * split.U - Matrix::Identity(n, n)).norm(), 1e-13);
    ASSERT_LT(turned.bottomLeftCorner(unreached, reached).norm(), 1e-12 * A.norm());
    ASSERT_LT((turned.bottomRightCorner(unreached, unreached) - split.rest).norm(), 1e-12 * A.norm());
    ASSERT_LT((split.U.transpose() * B).bottomRows(unreached).norm(), 1e-12 * B.norm());
    ASSERT_NEAR(split.rest.trace(), rest.trace(), 1e-11);
  }
}

TEST(Controllability, NamesAnEigenvalueThatFailsTheHautusTest) {
  int unstabilisable = 0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"hautus"});
    const auto [A, B, rest, reached] = planted(stream);
    const Verdict reaches_all = controllable(A, B), reaches_unstable = stabilisable(A, B);
    ASSERT_TRUE(reaches_all.offending);
    ASSERT_LT(distance_from_rank_loss(A, B, *reaches_all.offending), 1e-8);
    ASSERT_NEAR(reaches_all.offending->real(), spectral_abscissa(rest), 1e-8);
    ASSERT_EQ(bool{reaches_unstable}, spectral_abscissa(rest) < 0.0);
    ASSERT_EQ(bool(detectable(A.transpose(), B.transpose())), bool{reaches_unstable});
    if (reaches_unstable) continue;
    ++unstabilisable;
    ASSERT_EQ(*reaches_unstable.offending, *reaches_all.offending);
  }
  EXPECT_GT(unstabilisable, 50);
  EXPECT_LT(unstabilisable, 190);
}

TEST(Controllability, HoldsWhereverTheHautusTestDoes) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"generic pair"});
    const Eigen::Index n = random_size(stream, 8);
    const Matrix A = random_matrix(stream, n, n), B = random_matrix(stream, n, 1);
    double distance = 1.0;
    for (const auto value : eigenvalues_of(A)) distance = std::min(distance, distance_from_rank_loss(A, B, value));
    ASSERT_GT(distance, 1e-6);
    ASSERT_TRUE(controllable(A, B));
    ASSERT_TRUE(stabilisable(A, B));
    ASSERT_TRUE(observable(A.transpose(), B.transpose()));
    ASSERT_EQ(controllable_split(A, B).dimension, n);
  }
}

// In random coordinates the double eigenvalue comes out as two, 1e-8 apart: a rank test at either would not see the loss.
TEST(Controllability, IsNotFooledByADefectiveEigenvalue) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"defective"});
    const Matrix U = random_rotation(stream, 2);
    const Matrix A = U * double_integrator() * U.transpose();
    const Verdict on_position = stabilisable(A, U.col(0)), of_velocity = detectable(A, U.col(1).transpose());
    ASSERT_TRUE(on_position.offending);
    ASSERT_LT(std::abs(*on_position.offending), 1e-14);
    ASSERT_TRUE(of_velocity.offending);
    ASSERT_LT(std::abs(*of_velocity.offending), 1e-14);
    ASSERT_TRUE(controllable(A, U.col(1)));
    ASSERT_TRUE(observable(A, U.col(0).transpose()));
  }
}

TEST(Controllability, IgnoresTheUnitsOfInputs) {
  const Matrix A = Vector{{1, 2}}.asDiagonal();
  EXPECT_TRUE(controllable(A, Vector{{1e6, 1e-5}}.asDiagonal()));
  EXPECT_EQ(controllable(A, Matrix{{1, 0}, {0, 1e-16}}).offending, std::complex<double>(2, 0));
  EXPECT_EQ(controllable(A, Matrix::Zero(2, 1)).offending, std::complex<double>(2, 0));
}

TEST(Observability, SplitsOffThePartThatIsNotSeen) {
  // A mode-wise sensor: sees the first oscillator, not the second.
  Matrix A = Matrix::Zero(4, 4);
  A.topLeftCorner(2, 2) = oscillator(1);
  A.bottomRightCorner(2, 2) = oscillator(2);
  const Matrix C{{1, 0, 0, 0}};
  const Split split = observable_split(A, C);
  ASSERT_EQ(split.dimension, 2);
  EXPECT_LT((C * split.U).rightCols(2).norm(), 1e-15);
  EXPECT_LT((split.U.transpose() * A * split.U).topRightCorner(2, 2).norm(), 1e-15);
  EXPECT_LT((split.rest * split.rest + 4 * Matrix::Identity(2, 2)).norm(), 1e-14);
  const Verdict sees_axis = observable_on_the_axis(A, C);
  ASSERT_TRUE(sees_axis.offending);
  EXPECT_NEAR(std::abs(sees_axis.offending->imag()), 2.0, 1e-14);
  EXPECT_TRUE(observable(A, Matrix{{1, 0, 0, 1}}));
}

TEST(Observability, OnTheAxisAsksNothingOfOtherModes) {
  const Matrix A = Vector{{-1, 0, 2}}.asDiagonal();
  EXPECT_TRUE(observable_on_the_axis(A, Matrix{{0, 1, 0}}));
  EXPECT_EQ(observable_on_the_axis(A, Matrix{{1, 0, 1}}).offending, std::complex<double>(0, 0));
  EXPECT_EQ(detectable(A, Matrix{{0, 1, 0}}).offending, std::complex<double>(2, 0));
  EXPECT_TRUE(detectable(A, Matrix{{0, 1, 1}}));
  const Verdict sees_all = observable(A, Matrix{{0, 1, 1}});
  ASSERT_TRUE(sees_all.offending);
  EXPECT_NEAR(sees_all.offending->real(), -1.0, 1e-14);
}

TEST(Controllability, RefusesMatricesThatDoNotFit) {
  const Matrix A = double_integrator();
  EXPECT_EQ(complaint([&] { (void)controllable(Matrix::Ones(1, 2), A); }), "controllability: A is 1 x 2; allowed: n x n with n >= 1");
  EXPECT_EQ(complaint([&] { (void)controllable(A, Matrix::Ones(1, 2)); }), "controllability: B is 1 x 2; allowed: 2 x m with m >= 1");
  EXPECT_EQ(complaint([&] { (void)observable(A, Matrix::Ones(2, 1)); }), "observability: C is 2 x 1; allowed: p x 2 with p >= 1");
}

}  // namespace
}  // namespace consort
