#include "core/math/decompositions.hpp"

#include "core/errors.hpp"

#include <gtest/gtest.h>

#include <complex>
#include <functional>
#include <limits>
#include <string>

namespace consort {
namespace {

std::string error_of(const std::function<void()>& attempt) {
  try {
    attempt();
  } catch (const RunError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Decompositions, ASingularMatrixIsReportedWithItsNameSizeAndConditionNumber) {
  Matrix A(3, 3);
  A << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  const Matrix I = Matrix::Identity(3, 3);
  const Vector b = Vector::Ones(3);
  for (const std::string& message : {error_of([&] { inverse(A, "I + h G C"); }), error_of([&] { solve(A, I, "I + h G C"); }),
                                     error_of([&] { solve(A, b, "I + h G C"); })})
    EXPECT_EQ(message.find("I + h G C (3 x 3) is singular within rounding, condition number "), 0U) << message;
}

TEST(Decompositions, AMatrixThatIsNotFiniteIsSaidToBe) {
  Matrix A = Matrix::Identity(2, 2);
  A(0, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(error_of([&] { inverse(A, "P_j + Omega"); }), "P_j + Omega (2 x 2) is not finite");
}

TEST(Decompositions, NoIterationBeginsOnNumbersThatAreNotFinite) {
  for (const double beyond : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (const Eigen::Index n : {1, 2, 3}) {
      const Matrix A = Matrix::Constant(n, n, beyond);
      const Eigen::MatrixXcd complex = A.cast<std::complex<double>>();
      const std::string size = std::to_string(n) + " x " + std::to_string(n);
      for (const std::string& message : {error_of([&] { eigen(A, "A - L C"); }), error_of([&] { eigenvalues(A, "A - L C"); }),
                                         error_of([&] { spectral_radius(complex, "A - L C"); }),
                                         error_of([&] { symmetric_eigen(A, Matrix::Identity(n, n), "A - L C"); })})
        EXPECT_EQ(message, "A - L C (" + size + ") is not finite");
      for (const Vector& values : {symmetric_eigenvalues(A), symmetric_eigen(A).values})
        EXPECT_TRUE(values.array().isNaN().all() && values.size() == n) << size;
    }
  }
}

TEST(Decompositions, TheSpectralRadiusOfAComplexMatrixIsFoundNearTheLargestNumberToo) {
  Eigen::MatrixXcd a(2, 2);
  a << 1.0, std::complex<double>(0.0, 2.0), std::complex<double>(0.0, -2.0), 1.0;  // eigenvalues 3 and -1
  EXPECT_NEAR(spectral_radius(a, "a"), 3.0, 1e-14);
  EXPECT_NEAR(spectral_radius(1e307 * a, "a"), 3e307, 1e293);
  EXPECT_NEAR(spectral_radius(Eigen::MatrixXcd::Constant(1, 1, {3.0, 4.0}), "a"), 5.0, 1e-14);
}

TEST(Decompositions, AMatrixOfConditionTenToTheFourteenIsStillInverted) {
  const Vector diagonal{{1e7, 1e-7}};
  const Matrix A = diagonal.asDiagonal();
  EXPECT_DOUBLE_EQ(inverse(A, "A")(1, 1), 1e7);
  const Vector x = solve(A, diagonal, "A");
  EXPECT_DOUBLE_EQ(x[0], 1.0);
  EXPECT_DOUBLE_EQ(x[1], 1.0);
}

}  // namespace
}  // namespace consort
