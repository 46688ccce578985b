#include "protocols/filters/riccati_step.hpp"

#include "core/errors.hpp"
#include "core/random.hpp"
#include "protocols/filters/estimator_network.hpp"
#include "tests/support/direct.hpp"
#include "tests/support/oscillator.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace consort {
namespace {

Matrix one(double value) { return Matrix::Constant(1, 1, value); }

/// The Runge-Kutta method with very short steps.
Matrix integrated(const Matrix& A, const Matrix& U, const Matrix& Q, Matrix P, Seconds h, int steps) {
  const auto slope = [&](const Matrix& p) -> Matrix { return A * p + p * A.transpose() + Q - p * U * p; };
  const double s = h / steps;
  for (int i = 0; i < steps; ++i) {
    const Matrix k1 = slope(P), k2 = slope(P + 0.5 * s * k1), k3 = slope(P + 0.5 * s * k2), k4 = slope(P + s * k3);
    P += s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
  }
  return P;
}

TEST(RiccatiStep, ScalarFollowsTheClosedForm) {
  // p' = 2 a p + q - u p^2 with a = 0, q = u = 1: p = tanh(t + artanh p(0)).
  for (const double h : {1e-3, 0.3, 5.0}) {
    const RiccatiStep step(one(0), one(1), one(1), h);
    EXPECT_NEAR(step(one(0.2))(0, 0), std::tanh(h + std::atanh(0.2)), 1e-14) << h;
    EXPECT_NEAR(step(one(0.0))(0, 0), std::tanh(h), 1e-14) << h;
  }
  // Without measurements p grows by q h; without noise 1/p grows by u h.
  EXPECT_NEAR(RiccatiStep(one(0), one(0), one(3), 0.5)(one(2))(0, 0), 3.5, 1e-14);
  EXPECT_NEAR(RiccatiStep(one(0), one(3), one(0), 0.5)(one(2))(0, 0), 1.0 / (0.5 + 1.5), 1e-14);
}

TEST(RiccatiStep, AgreesWithShortStepsOfRungeKutta) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose("riccati step"));
    const Eigen::Index n = 1 + static_cast<Eigen::Index>(seed % 4);
    const Matrix A = Matrix::NullaryExpr(n, n, [&] { return stream.uniform(-1.0, 1.0); });
    const Matrix U = direct::random_spd(stream, n), Q = direct::random_spd(stream, n), P = direct::random_spd(stream, n);
    const Matrix expected = integrated(A, U, Q, P, 0.2, 400);
    const Matrix found = RiccatiStep(A, U, Q, 0.2)(P);
    EXPECT_LT((found - expected).norm(), 1e-9 * expected.norm());
    EXPECT_EQ(found, found.transpose());
  }
}

TEST(RiccatiStep, TwoStepsAreOneOfTwiceTheLength) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose("riccati step"));
    const Matrix A = Matrix::NullaryExpr(3, 3, [&] { return stream.uniform(-2.0, 2.0); });
    const Matrix U = 1e4 * direct::random_spd(stream, 3), Q = direct::random_spd(stream, 3), P = direct::random_spd(stream, 3);
    const RiccatiStep half(A, U, Q, 0.05);
    const Matrix expected = half(half(P));
    EXPECT_LT((RiccatiStep(A, U, Q, 0.1)(P) - expected).norm(), 1e-10 * expected.norm());
  }
}

TEST(RiccatiStep, LeavesWhatIsStationaryWhereItIsAndGetsThereInOneLongStep) {
  using namespace oscillator;
  const Matrix P = stationary_covariance(A(), seen_by_all(), Q());
  for (const double h : {1e-4, 0.01, 1.0, 1e3}) EXPECT_LT((RiccatiStep(A(), seen_by_all(), Q(), h)(P) - P).norm(), 1e-12) << h;
  for (const double start : {0.0, 1.0, 1e9})
    EXPECT_LT((RiccatiStep(A(), seen_by_all(), Q(), 1e3)(start * Matrix::Identity(2, 2)) - P).norm(), 1e-11) << start;
}

TEST(RiccatiStep, IsStableForStiffEquationsAndHugeStarts) {
  // p' = q - u p^2 with u = 1e8: from 1e6 it falls to sqrt(q / u) = 1e-4.
  EXPECT_NEAR(RiccatiStep(one(0), one(1e8), one(1), 1.0)(one(1e6))(0, 0), 1e-4, 1e-14);
}

TEST(RiccatiStep, RefusesShapesThatDoNotFit) {
  EXPECT_THROW(RiccatiStep(Matrix::Zero(2, 3), one(1), one(1), 1.0), ConfigError);
  EXPECT_THROW(RiccatiStep(Matrix::Zero(2, 2), one(1), Matrix::Zero(2, 2), 1.0), ConfigError);
  EXPECT_THROW(RiccatiStep(Matrix::Zero(2, 2), Matrix::Zero(2, 2), one(1), 1.0), ConfigError);
  EXPECT_THROW(RiccatiStep(one(0), one(1), one(1), 0.0), ConfigError);
}

}  // namespace
}  // namespace consort
