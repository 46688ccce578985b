#include "core/math/decompositions.hpp"

#include "core/errors.hpp"

#include <gtest/gtest.h>

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
