#include "core/metrics/estimation.hpp"

#include "core/errors.hpp"
#include "core/gaussian.hpp"
#include "core/stop.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace consort {
namespace {

/// Two agents with parts of two and one numbers.
Trace everybody() {
  Trace trace;
  trace.agents = 2;
  trace.state_layout = {{{"x", 2, 1}}};
  trace.state_dimension = 2;
  trace.estimate_layout = {{{"x", 2, 2}, {"bar", 2, 1}}};
  trace.dimension = 6;
  trace.truth = Truth::everybody;
  return trace;
}

void add(Trace& trace, Round k, const std::vector<double>& estimates, const std::vector<double>& states) {
  const std::vector<std::uint64_t> hashes(trace.agents);
  const std::vector<AgentCounters> counters(trace.agents);
  trace.add({k, estimates, hashes, counters, states, hashes});
}

Metrics all_of(const Trace& trace, std::size_t runs = 1) {
  Experiment e;
  e.runs = runs;
  const ProtocolChoice choice{"test", {}};
  Metrics out;
  for (const auto compute : {final_error, relative_error, error_peak, rmse, nees}) compute(e, Seed{1}, choice, trace, out);
  return out;
}

TEST(EstimationMetrics, CompareEveryAgentsSlotsWithEverybodysStates) {
  Trace trace = everybody();
  const std::vector<double> states{1.0, 2.0, 3.0, kAbsent};
  add(trace, 0, {9, 9, 9, kAbsent, 0, 0, 9, 9, 9, kAbsent, 0, 0}, states);
  // Agent 1 is off by (3, 0 | 4), agent 2 has no idea of agent 1 and is right about itself.
  add(trace, 10, {4, 2, 7, kAbsent, 0, 0, kAbsent, kAbsent, 3, kAbsent, 0, 0}, states);
  const Metrics out = all_of(trace);
  EXPECT_DOUBLE_EQ(out.at("error.1"), 5.0);
  EXPECT_DOUBLE_EQ(out.at("error.2"), std::sqrt(5.0)) << "a part without an estimate counts with its whole state";
  EXPECT_DOUBLE_EQ(out.at("error"), std::sqrt(30.0));
  EXPECT_DOUBLE_EQ(out.at("error_relative"), std::sqrt(30.0 / 28.0));
  EXPECT_DOUBLE_EQ(out.at("error_peak"), 4.0) << "of the second half alone";
  EXPECT_DOUBLE_EQ(out.at("rmse"), std::sqrt(30.0 / 6.0));
  EXPECT_DOUBLE_EQ(out.at("rmse.1"), std::sqrt(25.0 / 3.0));
  EXPECT_FALSE(out.contains("nees"));
  EXPECT_DOUBLE_EQ(deviation(trace, trace.report(1)), std::sqrt(30.0));
}

TEST(EstimationMetrics, LeaveOutWhoIsNotThere) {
  Trace trace = everybody();
  add(trace, 0, {1, 2, 5, kAbsent, 0, 0, kAbsent, kAbsent, kAbsent, kAbsent, kAbsent, kAbsent}, {1.0, 2.0, kAbsent, kAbsent});
  const Metrics out = all_of(trace);
  EXPECT_EQ(out.at("error"), 0.0);
  EXPECT_FALSE(out.contains("error.2"));
}

TEST(EstimationMetrics, NameTheErrorsOfGroupsOfTheState) {
  Trace trace;
  trace.agents = 1;
  trace.state_layout = {{{"mode1", 2, 1}, {"mode2", 1, 1}}};
  trace.state_dimension = 3;
  trace.estimate_layout = {{{"x", 3, 1}}};
  trace.dimension = 3;
  trace.truth = Truth::state;
  add(trace, 0, {3, 4, 1}, {0, 0, 0});
  const Metrics out = all_of(trace);
  EXPECT_DOUBLE_EQ(out.at("error.1.mode1"), 5.0);
  EXPECT_DOUBLE_EQ(out.at("error.1.mode2"), 1.0);
}

/// A filter of two numbers whose errors are drawn with covariance `actual` and which claims `claimed`.
Trace filter(const Matrix& actual, const Matrix& claimed, Round rounds) {
  Trace trace;
  trace.agents = 1;
  trace.state_layout = {{{"x", 2, 1}}};
  trace.state_dimension = 2;
  trace.estimate_layout = {{{"x", 2, 1}, {"P", 2, 2}}};
  trace.dimension = 6;
  trace.truth = Truth::state;
  const Gaussian noise(actual);
  for (Round k = 0; k < rounds; ++k) {
    std::vector<double> estimate{1.0, -1.0, claimed(0, 0), claimed(1, 0), claimed(0, 1), claimed(1, 1)};
    noise.add(Seed{7}.stream(Purpose("filter"), k), std::span(estimate).first(2));
    add(trace, k, estimate, {1.0, -1.0});
  }
  return trace;
}

TEST(Nees, IsTheDimensionWhereTheCovarianceIsTrueAndDoublesWhereItIsHalf) {
  const Matrix P = (Matrix(2, 2) << 2.0, 0.5, 0.5, 1.0).finished();
  // The mean of 10 000 chi-square numbers with 2 degrees of freedom has a standard deviation of 0.02.
  EXPECT_NEAR(all_of(filter(P, P, 20'000)).at("nees"), 2.0, 0.08);
  EXPECT_NEAR(all_of(filter(P, 0.5 * P, 20'000)).at("nees"), 4.0, 0.16);
}

TEST(Nees, OfASingleRunHasNoBounds) {
  const Metrics out = all_of(filter(Matrix::Identity(2, 2), Matrix::Identity(2, 2), 4), 1);
  EXPECT_TRUE(out.contains("nees"));
  EXPECT_FALSE(out.contains("nees_low") || out.contains("nees_high"));
}

TEST(Nees, HasTheChiSquareBoundsOfTheRuns) {
  const Trace trace = filter(Matrix::Identity(2, 2), Matrix::Identity(2, 2), 4);
  // Tables: chi-square with 4 degrees of freedom .4844 and 11.143, with 100 degrees 74.222 and 129.561.
  EXPECT_NEAR(all_of(trace, 2).at("nees_low"), 0.4844 / 2, 5e-5);
  EXPECT_NEAR(all_of(trace, 2).at("nees_high"), 11.143 / 2, 5e-4);
  EXPECT_NEAR(all_of(trace, 50).at("nees_low"), 74.222 / 50, 1e-4);
  EXPECT_NEAR(all_of(trace, 50).at("nees_high"), 129.561 / 50, 1e-4);
}

TEST(Nees, NamesAgentAndRoundWhereACovarianceIsNone) {
  try {
    all_of(filter(Matrix::Identity(2, 2), -Matrix::Identity(2, 2), 3));
    FAIL() << "a negative covariance was taken";
  } catch (const RunError& error) {
    const std::string text = error.what();
    for (const char* part : {"nees of test", "agent 1, round 1", "matrix P (2 x 2)", "condition 1"})
      EXPECT_NE(text.find(part), std::string::npos) << text;
  }
}

TEST(Nees, HasNoNumberWhereACovarianceHasVanished) {
  for (const double left : {0.0, 1e-310, 1e-291})
    EXPECT_TRUE(std::isnan(all_of(filter(Matrix::Identity(2, 2), Matrix(Vector{{1.0, left}}.asDiagonal()), 3)).at("nees"))) << left;
}

TEST(EstimationMetrics, SayNothingOfAgentsThatAgree) {
  Trace trace;
  trace.agents = 2;
  trace.estimate_layout = {{{"x", 1, 1}}};
  trace.dimension = 1;
  add(trace, 0, {1, 2}, {});
  EXPECT_TRUE(all_of(trace).empty());
  EXPECT_EQ(deviation(trace, trace.report(0)), 1.0);
}

}  // namespace
}  // namespace consort
