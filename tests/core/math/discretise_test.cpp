#include "core/math/discretise.hpp"

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

TEST(Discretisation, OfTheDoubleIntegratorIsTheTextbookOne) {
  for (const double h : {1e-9, 1e-3, 0.02, 0.1, 1.0, 3.0}) {
    SCOPED_TRACE(h);
    const Matrix W = Vector{{0, 5}}.asDiagonal();
    const auto [A, B, Q] = discretise(double_integrator(), Matrix{{0.0}, {1.0}}, W, h);
    EXPECT_DOUBLE_EQ(A(0, 0), 1.0);
    EXPECT_EQ(A(1, 0), 0.0);
    EXPECT_DOUBLE_EQ(A(1, 1), 1.0);
    EXPECT_DOUBLE_EQ(A(0, 1), h);
    EXPECT_DOUBLE_EQ(B(0, 0), h * h / 2);
    EXPECT_DOUBLE_EQ(B(1, 0), h);
    EXPECT_NEAR(Q(0, 0) / (5 * h * h * h / 3), 1.0, 1e-14);
    EXPECT_NEAR(Q(0, 1) / (5 * h * h / 2), 1.0, 1e-14);
    EXPECT_NEAR(Q(1, 1) / (5 * h), 1.0, 1e-14);
  }
}

TEST(Discretisation, OfScalarSystemsIsTheAnalyticOne) {
  for (const double a : {-1e4, -3.0, -1e-9, 0.5, 2.0})
    for (const double h : {1e-4, 0.02, 1.0}) {
      SCOPED_TRACE(testing::Message() << a << ' ' << h);
      const double rounding = 1e-15 * (4 + std::abs(a) * h);  // every squaring of the exponential doubles it
      const auto [A, B, Q] = discretise(Matrix{{a}}, Matrix{{3.0}}, Matrix{{0.7}}, h);
      EXPECT_NEAR(A(0, 0), std::exp(a * h), rounding * std::exp(a * h) + 1e-300);
      EXPECT_NEAR(B(0, 0) / (3 * std::expm1(a * h) / a), 1.0, rounding);
      EXPECT_NEAR(Q(0, 0) / (0.7 * std::expm1(2 * a * h) / (2 * a)), 1.0, rounding);
    }
}

TEST(Discretisation, OfTheOscillatorIsARotation) {
  const double omega = 651, h = 1e-2, angle = omega * h;
  const Matrix A = discretise(oscillator(omega), {}, {}, h).A;
  const Matrix rotation{{std::cos(angle), std::sin(angle)}, {-std::sin(angle), std::cos(angle)}};
  EXPECT_LT((A - rotation).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_EQ(matrix_exponential(Matrix::Zero(3, 3), 2.0), Matrix(Matrix::Identity(3, 3)));
}

TEST(Discretisation, LeavesOutWhatIsEmpty) {
  const auto [A, B, Q] = discretise(double_integrator(), {}, {}, 0.1);
  EXPECT_EQ(B.rows(), 2);
  EXPECT_EQ(B.cols(), 0);
  EXPECT_EQ(Q.size(), 0);
  EXPECT_EQ(discretise(double_integrator(), {}, Matrix::Zero(2, 2), 0.1).Q, Matrix(Matrix::Zero(2, 2)));
}

/// Simpson's rule over `f` on 0..h.
template <class Integrand>
Matrix quadrature(double h, const Integrand& f) {
  constexpr int kPanels = 400;
  Matrix sum = f(0.0) + f(h);
  for (int i = 1; i < kPanels; ++i) sum += (i % 2 == 1 ? 4.0 : 2.0) * f(h * i / kPanels);
  return sum * (h / (3 * kPanels));
}

TEST(Discretisation, AgreesWithFineQuadrature) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"quadrature"});
    const Eigen::Index n = random_size(stream, 5);
    const double h = stream.uniform(0.01, 2.0);
    const Matrix A = random_matrix(stream, n, n), B = random_matrix(stream, n, 2);
    const Matrix W = random_semidefinite(stream, n, random_size(stream, static_cast<std::uint64_t>(n)));
    const Discrete discrete = discretise(A, B, W, h);
    const auto transition = [&](double s) { return s == 0.0 ? Matrix(Matrix::Identity(n, n)) : matrix_exponential(A, s); };
    const Matrix integral_B = quadrature(h, [&](double s) { return Matrix(transition(s) * B); });
    const Matrix integral_W = quadrature(h, [&](double s) { return Matrix(transition(s) * W * transition(s).transpose()); });
    ASSERT_LT(relative_error(discrete.A, transition(h)), 1e-13);
    ASSERT_LT(relative_error(discrete.B, integral_B), 1e-8);
    ASSERT_LT(relative_error(discrete.Q, integral_W), 1e-7);
    ASSERT_EQ(discrete.Q, Matrix(discrete.Q.transpose()));
    ASSERT_GT(symmetric_eigenvalues(discrete.Q)(0), -1e-14 * discrete.Q.norm());
  }
}

// Stationary in continuous time is stationary in discrete time, however stiff the system and however long the step.
TEST(Discretisation, KeepsTheStationaryCovariance) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"stationary"});
    const Eigen::Index n = random_size(stream, 6);
    Matrix A = random_matrix(stream, n, n);
    A.diagonal().array() -= spectral_abscissa(A) + 0.5;
    A *= std::pow(10.0, stream.uniform(0.0, 4.0));
    const Matrix W = random_semidefinite(stream, n, n);
    const auto [F, B, Q] = discretise(A, {}, W, stream.uniform(1e-3, 1.0));
    const Matrix X = continuous_lyapunov(A, W);
    ASSERT_LT(relative_error(F * X * F.transpose() + Q, X), 1e-11);
  }
}

TEST(Discretisation, OfADoubleStepIsTwoSteps) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"two steps"});
    const Eigen::Index n = random_size(stream, 6);
    const Matrix A = random_matrix(stream, n, n), B = random_matrix(stream, n, 1), W = random_semidefinite(stream, n, n);
    const double h = stream.uniform(0.01, 1.0);
    const Discrete once = discretise(A, B, W, h), twice = discretise(A, B, W, 2 * h);
    ASSERT_LT(relative_error(once.A * once.A, twice.A), 1e-12);
    ASSERT_LT(relative_error(once.A * once.B + once.B, twice.B), 1e-12);
    ASSERT_LT(relative_error(once.A * once.Q * once.A.transpose() + once.Q, twice.Q), 1e-12);
  }
}

TEST(Discretisation, SaysWhatItRefuses) {
  const Matrix A = double_integrator(), W = Matrix::Identity(2, 2);
  EXPECT_EQ(complaint([&] { discretise(Matrix::Ones(2, 1), {}, {}, 1); }), "discretise: A is 2 x 1; allowed: n x n with n >= 1");
  EXPECT_EQ(complaint([&] { discretise(A, Matrix::Ones(3, 1), {}, 1); }), "discretise: B is 3 x 1; allowed: 2 x m with m >= 1");
  EXPECT_EQ(complaint([&] { discretise(A, {}, -W, 1); }), "discretise: W has the eigenvalue -1; allowed: positive semidefinite");
  EXPECT_EQ(complaint([&] { discretise(A, {}, W, 0); }), "discretise: the step h is 0 s; allowed: positive and finite");
  EXPECT_EQ(complaint([&] { matrix_exponential(A, std::numeric_limits<double>::infinity()); }),
            "discretise: the step h is inf s; allowed: positive and finite");
  EXPECT_EQ(complaint<RunError>([&] { discretise(Matrix{{1e3}}, {}, {}, 1.0); }),
            "discretise: exp(A h) overflows for A (1 x 1) of norm 1000 and h = 1 s; take a shorter step");
  EXPECT_THROW(discretise(Matrix{{500.0}}, {}, Matrix{{1.0}}, 1.0), RunError);  // exp(A h) fits, its square in Q does not
  EXPECT_THROW(discretise(Matrix{{-1e300}}, {}, Matrix{{1.0}}, 1e300), RunError);
}

}  // namespace
}  // namespace consort
