#include "core/math/lyapunov.hpp"

#include "core/math/decompositions.hpp"
#include "core/math/schur.hpp"
#include "tests/core/cases.hpp"
#include "tests/core/math/systems.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <complex>

namespace consort {
namespace {

using namespace cases;

TEST(Lyapunov, OfScalarAndDiagonalSystemsIsTheAnalyticOne) {
  EXPECT_NEAR(continuous_lyapunov(Matrix{{-4.0}}, Matrix{{2.0}})(0, 0), 0.25, 1e-16);
  const Matrix A = Vector{{-1, -2, -1e4}}.asDiagonal();
  const Matrix Q{{1, 2, 3}, {2, 5, 6}, {3, 6, 9}};
  const Matrix X = continuous_lyapunov(A, Q);
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j) EXPECT_NEAR(X(i, j) * -(A(i, i) + A(j, j)) / Q(i, j), 1.0, 1e-14);
}

TEST(Lyapunov, GivesTheEquipartitionOfADampedOscillator) {
  const double omega = 89, damping = .007931, intensity = 6e-4;  // noise on the velocity alone
  const Matrix A{{0, omega}, {-omega, -damping}}, Q = Vector{{0, intensity}}.asDiagonal();
  const Matrix expected = intensity / (2 * damping) * Matrix::Identity(2, 2);
  EXPECT_LT(relative_error(continuous_lyapunov(A, Q), expected), 1e-10);
}

TEST(Lyapunov, AgreesWithTheKroneckerSolution) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"lyapunov"});
    const Eigen::Index n = random_size(stream, 8);
    Matrix A = random_matrix(stream, n, n);
    A.diagonal().array() -= spectral_abscissa(A) + stream.uniform(0.1, 2.0);
    const Matrix Q = random_semidefinite(stream, n, random_size(stream, static_cast<std::uint64_t>(n)));
    const Matrix X = continuous_lyapunov(A, Q);
    ASSERT_EQ(X, Matrix(X.transpose()));
    ASSERT_LT((A * X + X * A.transpose() + Q).norm(), 1e-13 * (2 * A.norm() * X.norm() + Q.norm()));
    ASSERT_LT(relative_error(X, lyapunov_by_kronecker(A, Q)), 1e-9);
    ASSERT_GT(symmetric_eigenvalues(X)(0), -1e-12 * X.norm());
  }
}

TEST(Lyapunov, NeedsNoStability) {
  const Matrix A{{3, 1}, {0, -1}}, Q{{1, 2}, {2, -3}};
  EXPECT_LT(relative_error(continuous_lyapunov(A, Q), lyapunov_by_kronecker(A, Q)), 1e-14);
}

TEST(Lyapunov, NamesTheEigenvaluesThatSumToZero) {
  const Matrix identity = Matrix::Identity(2, 2);
  const std::string rest = " of A sum to zero within rounding; allowed: no two opposite eigenvalues (a stable A has none)";
  EXPECT_EQ(complaint([&] { continuous_lyapunov(Matrix{{0.0}}, Matrix{{1.0}}); }), "continuous_lyapunov: the eigenvalues 0 and 0" + rest);
  EXPECT_EQ(complaint([&] {
              continuous_lyapunov(Matrix{{1, 5}, {0, -1}}, identity);
            }),
            "continuous_lyapunov: the eigenvalues 1 and -1" + rest);
  EXPECT_EQ(complaint([&] { continuous_lyapunov(oscillator(2), identity); }),
            "continuous_lyapunov: the eigenvalues 0 + 2i and 0 - 2i" + rest);
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"opposite"});
    const Eigen::Index n = 2 + random_size(stream, 5);
    const Matrix U = random_rotation(stream, n);
    Matrix T = random_matrix(stream, n, n).triangularView<Eigen::Upper>();
    T(0, 0) = -T(n - 1, n - 1);
    ASSERT_THROW(continuous_lyapunov(U * T * U.transpose(), Matrix::Identity(n, n)), ConfigError);
  }
}

TEST(Lyapunov, RefusesASystemWhoseSolutionWouldHaveHardlyACorrectDigit) {
  // Three integrators in a row, each leaking 1e-6: the eigenvalues are far from zero beside rounding, the solution is not.
  const Matrix A{{-1e-6, 1, 0}, {0, -1e-6, 1}, {0, 0, -1e-6}};
  EXPECT_THROW(continuous_lyapunov(A, Matrix::Identity(3, 3)), ConfigError);
  EXPECT_NO_THROW(continuous_lyapunov(A - 1e-2 * Matrix::Identity(3, 3), Matrix::Identity(3, 3)));
}

TEST(Lyapunov, RefusesMatricesThatDoNotFit) {
  EXPECT_EQ(complaint([] { continuous_lyapunov(Matrix::Ones(1, 2), Matrix::Ones(1, 1)); }),
            "continuous_lyapunov: A is 1 x 2; allowed: n x n with n >= 1");
  EXPECT_EQ(complaint([] { continuous_lyapunov(-Matrix::Identity(2, 2), Matrix::Ones(1, 1)); }),
            "continuous_lyapunov: Q is 1 x 1; allowed: 2 x 2");
  EXPECT_EQ(complaint([] { continuous_lyapunov(-Matrix::Identity(2, 2), double_integrator()); }),
            "continuous_lyapunov: Q is not symmetric: largest difference to its transpose 1");
}

TEST(SpectralAbscissa, IsTheLargestRealPart) {
  EXPECT_EQ(spectral_abscissa(double_integrator()), 0.0);
  EXPECT_NEAR(spectral_abscissa(Matrix{{-1, 7}, {-7, -1}}), -1.0, 1e-14);
  EXPECT_EQ(spectral_abscissa(Vector{{-3, -2, -5}}.asDiagonal()), -2.0);
}

TEST(Schur, FactorsAndPutsTheStableEigenvaluesFirst) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"schur"});
    const Eigen::Index n = random_size(stream, 12);
    const Matrix A = random_matrix(stream, n, n);
    const auto [U, T, eigenvalues] = stable_first_schur(A);
    ASSERT_LT((U * T * U.transpose() - A).norm(), 1e-13 * A.norm());
    ASSERT_LT((U.transpose() * U - Matrix::Identity(n, n)).norm(), 1e-13);
    for (Eigen::Index i = 2; i < n; ++i) ASSERT_TRUE(T.row(i).head(i - 1).isZero(0.0));
    ASSERT_TRUE(std::is_partitioned(eigenvalues.begin(), eigenvalues.end(), [](auto value) { return value.real() < 0.0; }));
    std::complex<double> sum = 0.0;
    for (const auto value : eigenvalues) sum += value;
    ASSERT_NEAR(sum.real(), A.trace(), 1e-12 * A.norm());
    ASSERT_NEAR(sum.imag(), 0.0, 1e-12 * A.norm());
  }
}

}  // namespace
}  // namespace consort
