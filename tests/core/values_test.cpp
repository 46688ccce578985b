#include "core/values.hpp"

#include "core/errors.hpp"
#include "core/random.hpp"
#include "tests/core/cases.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace consort {
namespace {

/// The text of the ConfigError that `action` throws.
template <class Action>
std::string complaint(Action action) {
  try {
    action();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "nothing was thrown";
}

Matrix column(std::initializer_list<double> entries) {
  Matrix value(static_cast<Eigen::Index>(entries.size()), 1);
  std::copy(entries.begin(), entries.end(), value.data());
  return value;
}

TEST(Values, KeepTheOrderOfInsertionAndReplaceInPlace) {
  Values values;
  values.set("b", 1.0);
  values.set("a", column({2, 3}));
  values.set("b", 4.0);
  ASSERT_EQ(values.entries().size(), 2U);
  EXPECT_EQ(values.entries()[0].name, "b");
  EXPECT_EQ(values.scalar("b"), 4.0);
  EXPECT_EQ(values.vector("a"), Vector(column({2, 3})));
  EXPECT_EQ(values.vector("b"), Vector::Constant(1, 4.0));
  EXPECT_TRUE(values.has("a"));
  EXPECT_EQ(values.find("c"), nullptr);
}

TEST(Values, FallBackOnlyWhenAbsent) {
  Values values;
  values.set("Q", 2.0);
  EXPECT_EQ(values.scalar("Q", 5.0), 2.0);
  EXPECT_EQ(values.scalar("R", 5.0), 5.0);
  EXPECT_EQ(values.covariance("R", 2, 3.0), Matrix(3.0 * Matrix::Identity(2, 2)));
}

TEST(Values, ComplaintsNameTheValueWhatWasFoundAndWhatIsAllowed) {
  Values values;
  values.set("x", column({1, 2}));
  values.set("M", Matrix::Zero(2, 3));
  EXPECT_EQ(complaint([&] { (void)values.scalar("x"); }), "value 'x' is 2 x 1; allowed: a scalar");
  EXPECT_EQ(complaint([&] { (void)values.vector("M"); }), "value 'M' is 2 x 3; allowed: a vector n x 1 with n >= 1");
  EXPECT_EQ(complaint([&] { (void)values.scalar("y"); }), "value 'y' is required but was not given; given: x M");
  EXPECT_EQ(complaint([&] { (void)Values().vector("y"); }), "value 'y' is required but was not given; given: nothing");
  EXPECT_EQ(complaint([&] { (void)values.covariance("M", 2); }), "covariance 'M' is 2 x 3; allowed: a scalar, 2 x 1 (diagonal) or 2 x 2");
  EXPECT_THROW((void)values.covariance("y", 2), ConfigError);
}

TEST(Values, OverridingKeepsTheRest) {
  Values common, special;
  common.set("Q", 1.0);
  common.set("R", 2.0);
  special.set("R", 3.0);
  special.set("S", 4.0);
  const Values merged = common.overridden_by(special);
  EXPECT_EQ(merged.scalar("Q"), 1.0);
  EXPECT_EQ(merged.scalar("R"), 3.0);
  EXPECT_EQ(merged.scalar("S"), 4.0);
  EXPECT_EQ(common.scalar("R"), 2.0);
}

TEST(Covariance, IsAScalarADiagonalOrAMatrix) {
  const Matrix full = (Matrix(2, 2) << 2, 1, 1, 3).finished();
  EXPECT_EQ(expand_covariance(Matrix::Constant(1, 1, 0.5), 2, "P"), Matrix(0.5 * Matrix::Identity(2, 2)));
  EXPECT_EQ(expand_covariance(column({1, 4}), 2, "P"), (Matrix(2, 2) << 1, 0, 0, 4).finished());
  EXPECT_EQ(expand_covariance(full, 2, "P"), full);
  EXPECT_EQ(expand_covariance(Matrix::Constant(1, 1, 0.5), 1, "P"), Matrix::Constant(1, 1, 0.5));
  EXPECT_EQ(expand_covariance(Matrix::Constant(1, 1, 0.5), 0, "P").size(), 0);
}

TEST(Covariance, RefusesWhatIsNone) {
  const auto refused = [](const Matrix& given, bool strictly = false) {
    return complaint([&] { (void)expand_covariance(given, 2, "P", strictly); });
  };
  EXPECT_NE(refused((Matrix(2, 2) << 1, 0.5, 0.4, 1).finished()).find("not symmetric"), std::string::npos);
  EXPECT_NE(refused((Matrix(2, 2) << 1, 2, 2, 1).finished()).find("eigenvalue -1; allowed: positive semidefinite"), std::string::npos);
  EXPECT_NE(refused(column({1, -1})).find("eigenvalue -1"), std::string::npos);
  EXPECT_NE(refused(column({1, std::numeric_limits<double>::quiet_NaN()})).find("not finite"), std::string::npos);
  EXPECT_NE(refused(Matrix::Constant(1, 1, std::numeric_limits<double>::infinity())).find("not finite"), std::string::npos);
  EXPECT_NE(refused(Matrix::Ones(2, 2), true).find("allowed: positive definite"), std::string::npos);
  EXPECT_NE(refused(Matrix::Zero(1, 1), true).find("allowed: positive definite"), std::string::npos);
  EXPECT_EQ(refused(Matrix::Ones(2, 2)), "nothing was thrown");
  EXPECT_EQ(refused(Matrix::Zero(1, 1)), "nothing was thrown");
  EXPECT_EQ(complaint([] { (void)expand_covariance(Matrix::Constant(1, 1, 1e-300), 1, "P", true); }), "nothing was thrown");
}

TEST(Covariance, AcceptsEveryGramMatrixAndNoneWithANegativeDirection) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"gram"});
    const auto n = static_cast<Eigen::Index>(1 + stream.below(6));
    const auto rank = static_cast<Eigen::Index>(1 + stream.below(static_cast<std::uint64_t>(n)));
    const Matrix a = Matrix::NullaryExpr(n, rank, [&] { return stream.normal(); });
    const Matrix gram = a * a.transpose();
    ASSERT_NO_THROW((void)expand_covariance(gram, n, "P"));
    const Vector direction = Vector::NullaryExpr(n, [&] { return stream.normal(); }).normalized();
    ASSERT_THROW((void)expand_covariance(gram - 1.1 * (direction.dot(gram * direction) + 0.01) * direction * direction.transpose(), n, "P"),
                 ConfigError);
  }
}

}  // namespace
}  // namespace consort
