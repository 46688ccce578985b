#include "core/math/riccati.hpp"

#include "core/math/decompositions.hpp"
#include "core/math/lyapunov.hpp"
#include "core/math/schur.hpp"
#include "tests/core/cases.hpp"
#include "tests/core/math/systems.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace consort {
namespace {

using namespace cases;

Matrix scalar(double value) { return Matrix::Constant(1, 1, value); }
Matrix identity(Eigen::Index n) { return Matrix::Identity(n, n); }
Matrix column(double first, double second) { return Vector{{first, second}}; }
Matrix diagonal(std::initializer_list<double> entries) {
  return Eigen::Map<const Vector>(entries.begin(), static_cast<Eigen::Index>(entries.size())).asDiagonal();
}

TEST(Riccati, OfTheDoubleIntegratorIsTheAnalyticOne) {
  const double root = std::sqrt(3.0);
  const RiccatiSolution solution = continuous_riccati(double_integrator(), column(0, 1), identity(2), scalar(1));
  EXPECT_LT((solution.P - (Matrix(2, 2) << root, 1, 1, root).finished()).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LT((solution.K - Matrix{{1, root}}).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_NEAR(solution.abscissa, -root / 2, 1e-14);  // poles -.866025 +- .5 i
  EXPECT_EQ(lqr_gain(double_integrator(), column(0, 1), identity(2), scalar(1)), solution.K);
}

TEST(Riccati, OfScalarSystemsIsTheAnalyticOne) {
  for (const double a : {-1e3, -1.0, 0.0, 0.5, 200.0})
    for (const double b : {1e-3, 1.0, -40.0})
      for (const double q : {1e-6, 1.0, 1e4})
        for (const double r : {1e-3, 2.0}) {
          const RiccatiSolution solution = continuous_riccati(scalar(a), scalar(b), scalar(q), scalar(r));
          const double root = std::sqrt(a * a + q * b * b / r);
          const double expected = a > 0.0 ? (a + root) * r / (b * b) : q / (root - a);  // the form without cancellation
          SCOPED_TRACE(testing::Message() << a << ' ' << b << ' ' << q << ' ' << r);
          EXPECT_NEAR(solution.P(0, 0) / expected, 1.0, 1e-12);
          EXPECT_NEAR(solution.K(0, 0) / (expected * b / r), 1.0, 1e-12);
          EXPECT_NEAR(solution.abscissa / -root, 1.0, 1e-10);
        }
}

TEST(Riccati, WithoutCostIsZeroForAStableSystemAndMirrorsTheUnstableModes) {
  EXPECT_EQ(continuous_riccati(scalar(-1), scalar(1), scalar(0), scalar(1)).P, scalar(0));
  const RiccatiSolution mirrored = continuous_riccati(diagonal({2, -3}), column(1, 0), Matrix::Zero(2, 2), scalar(1));
  EXPECT_LT((mirrored.P - diagonal({4, 0})).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_NEAR(mirrored.abscissa, -2.0, 1e-13);
}

struct System {
  Matrix A, B, Q, R;
};

/// Weights of any rank on a pair that is controllable with probability one; n up to 8.
System random_system(std::uint64_t seed) {
  Stream stream = Seed{seed}.stream(Purpose{"riccati"});
  const Eigen::Index n = random_size(stream, 8), m = random_size(stream, 3);
  System system{random_matrix(stream, n, n), random_matrix(stream, n, m), {}, {}};
  system.Q = random_semidefinite(stream, n, random_size(stream, static_cast<std::uint64_t>(n)));
  system.R = random_semidefinite(stream, m, m) + 0.1 * identity(m);
  return system;
}

TEST(Riccati, LeavesNoResidualAndStabilises) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const auto [A, B, Q, R] = random_system(seed);
    const auto [P, K, abscissa, residual] = continuous_riccati(A, B, Q, R);
    ASSERT_LT(residual, 1e-12);
    const Matrix left = A.transpose() * P + P * A - P * B * inverse(R, "R") * B.transpose() * P + Q;
    ASSERT_LT(left.norm(), 1e-10 * (2 * (P * A).norm() + Q.norm() + (K.transpose() * R * K).norm()));
    ASSERT_EQ(P, Matrix(P.transpose()));
    ASSERT_GT(symmetric_eigenvalues(P)(0), -1e-11 * P.norm());
    ASSERT_LT(abscissa, 0.0);
    ASSERT_LT(relative_error(R * K, B.transpose() * P), 1e-11);
  }
}

// x'P x is what u = -K x costs from x on, and the cost of a given loop is a Lyapunov equation.
TEST(Riccati, IsTheCostOfItsOwnGainByASlowSolver) {
  int tame = 0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const auto [A, B, Q, R] = random_system(seed);
    const RiccatiSolution solution = continuous_riccati(A, B, Q, R);
    const Matrix loop = A - B * solution.K;
    const Matrix cost = lyapunov_by_kronecker(loop.transpose(), Q + solution.K.transpose() * R * solution.K);
    const double condition = lyapunov_condition(loop);
    ASSERT_LT(relative_error(solution.P, cost), 1e-14 * condition);
    tame += condition < 1e4 ? 1 : 0;
  }
  EXPECT_GT(tame, 150);
}

TEST(Riccati, OfTheFilterIsTheDual) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const auto [A, B, Q, R] = random_system(seed);
    const RiccatiSolution control = continuous_riccati(A, B, Q, R);
    const RiccatiSolution filter = filter_riccati(A.transpose(), B.transpose(), Q, R);
    ASSERT_EQ(filter.P, control.P);
    ASSERT_EQ(filter.K, Matrix(control.K.transpose()));
    ASSERT_EQ(filter.abscissa, control.abscissa);
  }
}

TEST(Riccati, SurvivesStatesInFarApartUnits) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const auto [A, B, Q, R] = random_system(seed);
    Stream stream = Seed{seed}.stream(Purpose{"units"});
    Vector unit(A.rows());
    for (double& value : unit) value = std::exp2(std::floor(stream.uniform(-13.0, 13.0)));
    const Matrix D = unit.asDiagonal(), D_inverse = unit.cwiseInverse().asDiagonal();  // x = D z
    const RiccatiSolution scaled = continuous_riccati(D_inverse * A * D, D_inverse * B, D * Q * D, R);
    const RiccatiSolution plain = continuous_riccati(A, B, Q, R);
    ASSERT_LT(relative_error(D_inverse * scaled.P * D_inverse, plain.P), 1e-14 * lyapunov_condition(A - B * plain.K));
  }
}

// The fixture of the literature estimators: an oscillator seen by four sensors.
TEST(Riccati, GivesTheCentralisedFilterOfTheOscillator) {
  const double half = 1 / std::sqrt(2.0);
  const Matrix C{{1, 0}, {0, 1}, {half, half}, {1, 0}};
  const RiccatiSolution filter = filter_riccati(oscillator(1), C, 0.1 * identity(2), diagonal({.5, 1, .8, .2}));
  EXPECT_LT((filter.P - Matrix{{.134208, .020761}, {.020761, .176480}}).cwiseAbs().maxCoeff(), 5e-7);
  EXPECT_LT(relative_error(filter.K, filter.P * C.transpose() * diagonal({2, 1, 1.25, 5})), 1e-14);
}

// Knotek 2020, 3.6: the clamped beam with four modes and four sensors, damped so little that the axis is near.
TEST(Riccati, GivesTheCentralisedFilterOfTheBeam) {
  const std::array<double, 4> omega{89, 221, 409, 651}, damping{.007931, .048851, .167291, .423811};
  const std::array<std::array<double, 4>, 4> shown{{{.2034645, .1596524, .1078220, .0593079},
                                                    {.5167411, 0, -.0937838, 0},
                                                    {.4781017, -.1368728, 0, .0626472},
                                                    {.3097591, -.1966885, .0886445, 0}}};
  Matrix A = Matrix::Zero(8, 8), C = Matrix::Zero(4, 8);
  for (std::size_t mode = 0; mode < 4; ++mode) {
    const auto at = static_cast<Eigen::Index>(2 * mode);
    A.block(at, at, 2, 2) << 0, omega[mode], -omega[mode], -damping[mode];
    for (std::size_t sensor = 0; sensor < 4; ++sensor) C(static_cast<Eigen::Index>(sensor), at) = shown[sensor][mode];
  }
  const RiccatiSolution filter = filter_riccati(A, C, 1e-4 * diagonal({6, 10, 10, 6, 18, 14, 8, 8}), 1e-6 * diagonal({2, 5, 3, .1}));
  const Vector expected{{3.88, 4.04, 6.38, 6.51, 19.18, 19.30, 59.72, 59.73}};
  EXPECT_LT((1e5 * filter.P.diagonal() - expected).cwiseAbs().maxCoeff(), .0051);
  EXPECT_LT(filter.residual, 1e-13);
}

TEST(Riccati, NamesTheConditionThatFailsAndItsEigenvalue) {
  const Matrix unreached = diagonal({-2, 1});
  EXPECT_EQ(complaint([&] { continuous_riccati(unreached, column(1, 0), identity(2), scalar(1)); }),
            "continuous_riccati: (A, B) is not stabilisable: B does not reach the eigenvalue 1 of A");
  EXPECT_EQ(complaint([&] { filter_riccati(unreached, column(1, 0).transpose(), identity(2), scalar(1)); }),
            "filter_riccati: (A, C) is not detectable: C does not see the eigenvalue 1 of A");
  EXPECT_EQ(complaint([&] {
              continuous_riccati(double_integrator(), column(0, 1), diagonal({0, 1}), scalar(1));
            }),
            "continuous_riccati: (A, Q) leaves an eigenvalue on the imaginary axis: Q does not see the eigenvalue 0 of A");
  Matrix A = Matrix::Zero(3, 3);
  A.topLeftCorner(2, 2) = oscillator(2);
  A(2, 2) = 1;
  const Matrix C{{1, 0, 1}};
  EXPECT_TRUE(complaint([&] {
                filter_riccati(A, C, diagonal({0, 0, 1}), scalar(1));
              }).starts_with("filter_riccati: (A, Q) leaves an eigenvalue on the imaginary axis: Q does not excite the eigenvalue 0 "));
  EXPECT_LT(filter_riccati(A, C, diagonal({0, 1, 0}), scalar(1)).abscissa, 0.0);  // the mode at 1 needs no excitation
}

TEST(Riccati, RefusesUnsolvableSystemsInAnyCoordinates) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"unsolvable"});
    const Matrix U = random_rotation(stream, 2);
    const Matrix A = U * double_integrator() * U.transpose();
    ASSERT_THROW(continuous_riccati(A, U * column(1, 0), identity(2), scalar(1)), ConfigError);
    ASSERT_THROW(continuous_riccati(A, U * column(0, 1), Matrix::Zero(2, 2), scalar(1)), ConfigError);
    ASSERT_THROW(continuous_riccati(A, U * column(0, 1), U * diagonal({0, 1}) * U.transpose(), scalar(1)), ConfigError);
    ASSERT_NO_THROW(continuous_riccati(A, U * column(0, 1), U * diagonal({1, 0}) * U.transpose(), scalar(1)));
  }
}

// Two modes 2^-k apart and one input: the gain grows as 2^2k until doubles cannot hold the loop, and then the modes are one.
TEST(Riccati, IsRightOrRefusesNearTheLossOfStabilisability) {
  const auto solution_for = [](int k) {
    return continuous_riccati(diagonal({1, 1 + std::exp2(-k)}), column(1, 1), identity(2), scalar(1));
  };
  for (int k = 1; k <= 15; ++k) {
    SCOPED_TRACE(k);
    const RiccatiSolution solution = solution_for(k);
    EXPECT_LT(solution.residual, 1e-11);
    EXPECT_NEAR(solution.abscissa, -1.0, std::exp2(-k));
  }
  for (int k = 25; k <= 37; ++k) EXPECT_THROW(solution_for(k), RunError) << k;
  for (int k = 42; k <= 52; ++k) EXPECT_THROW(solution_for(k), ConfigError) << k;
}

TEST(Riccati, RefusesMatricesThatDoNotFit) {
  const Matrix A = double_integrator(), B = column(0, 1), Q = identity(2), R = scalar(1);
  EXPECT_EQ(complaint([&] { continuous_riccati(Matrix::Zero(2, 3), B, Q, R); }),
            "continuous_riccati: A is 2 x 3; allowed: n x n with n >= 1");
  EXPECT_EQ(complaint([&] { continuous_riccati(Matrix(), B, Q, R); }), "continuous_riccati: A is 0 x 0; allowed: n x n with n >= 1");
  EXPECT_EQ(complaint([&] { continuous_riccati(A, Matrix::Ones(3, 1), Q, R); }),
            "continuous_riccati: B is 3 x 1; allowed: 2 x m with m >= 1");
  EXPECT_EQ(complaint([&] { filter_riccati(A, Matrix::Ones(1, 3), Q, R); }), "filter_riccati: C is 1 x 3; allowed: p x 2 with p >= 1");
  EXPECT_EQ(complaint([&] { continuous_riccati(A, B, identity(3), R); }), "continuous_riccati: Q is 3 x 3; allowed: 2 x 2");
  EXPECT_EQ(complaint([&] { continuous_riccati(A, B, Q, identity(2)); }), "continuous_riccati: R is 2 x 2; allowed: 1 x 1");
  EXPECT_EQ(complaint([&] { continuous_riccati(A, B, Q, scalar(0)); }),
            "continuous_riccati: R has the eigenvalue 0; allowed: positive definite");
  EXPECT_EQ(complaint([&] {
              continuous_riccati(A, B, diagonal({1, -1}), R);
            }),
            "continuous_riccati: Q has the eigenvalue -1; allowed: positive semidefinite");
  EXPECT_EQ(complaint([&] { continuous_riccati(A, B, A, R); }),
            "continuous_riccati: Q is not symmetric: largest difference to its transpose 1");
  const Matrix broken = A * std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(complaint([&] { continuous_riccati(broken, B, Q, R); }), "continuous_riccati: A has an entry that is not finite");
}

}  // namespace
}  // namespace consort
