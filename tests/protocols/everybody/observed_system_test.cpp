// Huang, Jiang, Zhao, Cheng, Wu 2025: the mathematics of the whole observer. Numbers of an independent implementation.

#include "protocols/everybody/observed_system.hpp"

#include "core/math/discretise.hpp"
#include "core/math/schur.hpp"
#include "tests/core/math/systems.hpp"
#include "tests/support/huang_cases.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <limits>
#include <numbers>

namespace consort {
namespace {

using namespace huang;

double error_after(const ObservedSystem& system, const Vector& x, double t) {
  const Vector e = start_error(system, x);
  return t > 0.0 ? (matrix_exponential(error_matrix(system), t) * e).norm() : e.norm();
}

TEST(Observer, ErrorsOf51AreTheOnesStated) {
  const std::vector<std::pair<double, double>> expected{{0, 2}, {1, 1.052594}, {2, 0.553408}, {5, 0.041092}};
  for (const auto& [t, e] : expected) EXPECT_NEAR(error_after(different(), different_start(), t), e, 1e-6) << t;
  EXPECT_NEAR(error_after(different(), different_start(), 10), 0.000159, 5e-7);
  EXPECT_NEAR(error_after(different(path(3)), different_start(), 10), 0.002836, 5e-7);
  EXPECT_NEAR(error_after(different(complete(3)), different_start(), 10), 3.2e-5, 5e-7);
}

TEST(Observer, EigenvaluesOfTheWholeErrorAreTheOnesStated) {
  std::vector<double> expected{-1.251223, -1.421223, -1.651223, -1.7, -1.97, -2.151223, -3, -4};
  for (const double twice : {-17.574388, -17.744388, -17.974388, -18.474388}) expected.insert(expected.end(), 2, twice);
  std::vector<double> real;
  for (const auto& lambda : eigenvalues_of(error_matrix(different()))) real.push_back(lambda.real());
  std::sort(real.begin(), real.end(), std::greater<>());
  ASSERT_EQ(real.size(), expected.size());
  for (std::size_t i = 0; i < real.size(); ++i) EXPECT_NEAR(real[i], expected[i], 1e-6);
}

TEST(Observer, TheConsensusEigenvaluesOf51AreTheOnesStated) {
  for (unsigned j = 1; j <= 3; ++j) {
    auto spectrum = eigenvalues_of(consensus_matrix(different().communication, AgentId{j}, ConsensusWeights::binary));
    std::sort(spectrum.begin(), spectrum.end(),
              [](const auto& a, const auto& b) { return std::pair(a.real(), a.imag()) < std::pair(b.real(), b.imag()); });
    EXPECT_LT(std::abs(spectrum[0] - 0.245122), 1e-6);
    EXPECT_LT(std::abs(spectrum[1] - std::complex(1.877439, -0.744862)), 2e-6);
    EXPECT_LT(std::abs(spectrum[2] - std::complex(1.877439, 0.744862)), 2e-6);
  }
  EXPECT_NEAR(1.2 / consensus_spectrum(different().communication, ConsensusWeights::binary).smallest_real, 4.8955, 5e-5) << "(13)";
}

TEST(Observer, TheRowsOfTheConsensusMatrixSumToTheWeightOfTheSecondEstimate) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    const Graph any = erdos_renyi(2 + seed % 6, 0.5, true, Seed{seed});
    for (const auto rule : {ConsensusWeights::binary, ConsensusWeights::in_degree, ConsensusWeights::out_degree}) {
      const Matrix S = consensus_matrix(any, AgentId{2}, rule);
      Vector expected = Vector::Zero(S.rows());
      expected[1] = rule == ConsensusWeights::in_degree ? 1.0 / static_cast<double>(any.in_degree(AgentId{2}) + 1) : 1.0;
      EXPECT_LT((S * Vector::Ones(S.cols()) - expected).norm(), 1e-14);
      const ConsensusSpectrum spectrum = consensus_spectrum(any, rule);
      EXPECT_EQ(spectrum.smallest_real > 1e-9, strongly_connected(any)) << "Lemma 2";
    }
  }
}

TEST(Observer, TheConsensusEigenvaluesOfTheSystemsThatChangeAreTheOnesStated) {
  const auto smallest = [](const ObservedSystem& s) { return consensus_spectrum(s.communication, s.weights).smallest_modulus; };
  EXPECT_NEAR(smallest(alike_three()), 0.206299, 1e-6);
  EXPECT_NEAR(smallest(alike_joined()), 0.159104, 1e-6);
  EXPECT_NEAR(smallest(alike_left()), 0.292893, 1e-6);
}

TEST(Observer, ErrorsOfAgentsThatAreAlikeAreTheOnesStated) {
  const Vector x{{.5, -.5, .5, -.5, .5, -.5}};
  EXPECT_NEAR(error_after(alike_three(), x, 0), 2.44949, 1e-5);
  EXPECT_NEAR(error_after(alike_three(), x, 1), 0.274361, 1e-6);
  EXPECT_NEAR(error_after(alike_three(), x, 2), 0.033038, 1e-6);
  EXPECT_NEAR(error_after(alike_three(), x, 5), 9.5e-6, 5e-8);
}

TEST(Observer, GainsAndBoundsAreTheOnesStated) {
  EXPECT_NEAR(directed_gain(4, 1.2), 574.196862, 1e-6);
  EXPECT_EQ(smallest_whole_above(directed_gain(4, 1.2)), 575);
  EXPECT_NEAR(undirected_gain(4, 1.2), 307.2, 1e-9);
  EXPECT_EQ(smallest_whole_above(undirected_gain(4, 1.2)), 308);
  EXPECT_EQ(smallest_whole_above(3.0), 4) << "above, not at";
  EXPECT_NEAR(undirected_consensus_bound(ring(4)), 0.074074, 1e-6);
  EXPECT_NEAR(consensus_spectrum(ring(4), ConsensusWeights::binary).smallest_modulus, 0.186393, 1e-6);
  EXPECT_NEAR(directed_consensus_bound(3), 0.014086, 1e-6);
  EXPECT_NEAR(directed_consensus_bound(4), 0.00208988, 1e-8);
  EXPECT_NEAR(directed_consensus_bound(6), 3.307e-5, 5e-9);
}

TEST(Observer, TheConsensusEigenvaluesStayAboveTheirBounds) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    const std::size_t m = 2 + seed % 6;
    const Graph either = erdos_renyi(m, 0.6, false, Seed{seed});
    if (strongly_connected(either)) {
      EXPECT_GE(consensus_spectrum(either, ConsensusWeights::binary).smallest_modulus, undirected_consensus_bound(either) * (1 - 1e-9));
    }
    const Graph directed = erdos_renyi(m, 0.6, true, Seed{seed});
    if (strongly_connected(directed)) {
      EXPECT_GE(consensus_spectrum(directed, ConsensusWeights::in_degree).smallest_modulus, directed_consensus_bound(m));
    }
  }
}

TEST(Observer, UnknownInputsAreBoundedAsStated) {
  const auto decay = error_decay(error_matrix(different()));
  ASSERT_TRUE(decay);
  EXPECT_NEAR(decay->eta, 1.1261, 5e-5);
  EXPECT_NEAR(decay->kappa, 33.82, 5e-3);
  EXPECT_NEAR(ultimate_bound(*decay, 1.0, 0.1), 3.003, 1e-3);
  EXPECT_FALSE(error_decay(Matrix{{0.1}})) << "nothing decays";
}

TEST(Observer, UnknownInputsStayBelowTheUltimateErrorStated) {
  // e' = R e + D u, u_i = .1 sin(t + i - 1) per state; the largest |e| over one period of the forced solution
  const ObservedSystem system = different();
  const Matrix R = error_matrix(system), D = unknown_input_matrix(system);
  const auto n = R.rows();
  const Eigen::VectorXcd u =
      0.1 * Eigen::VectorXcd{{std::polar(1.0, 0.0), std::polar(1.0, 0.0), std::polar(1.0, 1.0), std::polar(1.0, 2.0)}};
  const Eigen::MatrixXcd resolvent = std::complex(0.0, 1.0) * Eigen::MatrixXcd::Identity(n, n) - R;
  const Eigen::VectorXcd response = resolvent.partialPivLu().solve(D * u);
  double largest = 0.0;
  for (int k = 0; k < 10000; ++k) largest = std::max(largest, (response * std::polar(1.0, k * 2 * std::numbers::pi / 10000)).imag().norm());
  EXPECT_LE(largest, 0.2245);
  EXPECT_GT(largest, 0.21) << "and they do move it";
}

TEST(Observer, LocalisationErrorsAreTheOnesStated) {
  const ObservedSystem system = localisation_single();
  const Matrix R = error_matrix(system);
  EXPECT_NEAR(spectral_abscissa(R), -0.108693, 1e-6);
  const Vector e = start_error(system, localisation_start());
  EXPECT_NEAR((matrix_exponential(R, 10) * e).norm(), 45.584, 5e-4);
  EXPECT_NEAR((matrix_exponential(R, 100) * e).norm(), 0.31715, 5e-6);
  EXPECT_NEAR((matrix_exponential(R, 200) * e).norm(), 8.4e-5, 5e-7);
  const Vector at_50 = matrix_exponential(R, 50) * e;
  EXPECT_NEAR(at_50.norm(), 7.7761, 5e-5);
  const std::vector<double> third{-.11255, -.09662, -.07166, -.09662, -.11255, -.11803};
  const std::vector<double> fifth{-1.13562, -1.17494, -1.13562, -1.01999, -.83494, -1.01999};
  for (unsigned i = 1; i <= 6; ++i) {
    EXPECT_NEAR(at_50[system.at_hat(AgentId{i}, AgentId{3})], third[i - 1], 5e-6);
    EXPECT_NEAR(at_50[system.at_hat(AgentId{i}, AgentId{5})], fifth[i - 1], 5e-6);
  }
}

TEST(Observer, TheSlowestModeOfDoubleIntegratorsIsTheOneStated) {
  EXPECT_NEAR(spectral_abscissa(error_matrix(localisation_double())), -0.108002, 1e-6);
}

TEST(Observer, LongestStepsOfEulersRuleAreTheOnesStated) {
  const auto limit = [](const ObservedSystem& system) {
    double step = std::numeric_limits<double>::infinity();
    for (const auto& s : eigenvalues_of(error_matrix(system))) step = std::min(step, -2.0 * s.real() / std::norm(s));
    return step;
  };
  EXPECT_NEAR(limit(different()), 0.0931, 5e-5);
  EXPECT_NEAR(limit(alike_three()), 0.00202, 5e-6);
  EXPECT_NEAR(limit(alike_joined()), 0.00190, 5e-6);
  EXPECT_NEAR(limit(alike_left()), 0.00205, 5e-6);
  EXPECT_NEAR(limit(localisation_single()), 0.467, 5e-4);
}

TEST(Observer, LongestStepsOfRungeKuttaAreTheOnesStated) {
  const auto stable = [](const ObservedSystem& system, double h) {
    for (const auto& s : eigenvalues_of(error_matrix(system))) {
      const std::complex<double> z = h * s;
      if (std::abs(1.0 + z + z * z / 2.0 + z * z * z / 6.0 + z * z * z * z / 24.0) >= 1.0) return false;
    }
    return true;
  };
  const auto expect = [&](const ObservedSystem& system, double h, double digit) {
    EXPECT_TRUE(stable(system, h - digit)) << h;
    EXPECT_FALSE(stable(system, h + digit)) << h;
  };
  expect(different(), 0.143, 1e-3);
  expect(alike_three(), 0.00321, 1e-5);
  expect(alike_joined(), 0.00265, 1e-5);
  expect(alike_left(), 0.00286, 1e-5);
  expect(localisation_single(), 0.651, 1e-3);
}

TEST(Observer, TheSampledSchemeIsStableUpToTheStepsStated) {
  EXPECT_NEAR(spectral_radius(sampled_error_matrix(different(), 0.1)), .966, 5e-4);
  EXPECT_GT(spectral_radius(sampled_error_matrix(different(), 0.2)), 1.0);
  for (const ObservedSystem& system : {alike_three(), alike_joined(), alike_left()})
    EXPECT_LT(spectral_radius(sampled_error_matrix(system, 0.1)), 1.0);
  EXPECT_LT(spectral_radius(sampled_error_matrix(localisation_single(), 0.2)), 1.0);
}

TEST(Observer, TheSampledSchemeTendsToTheContinuousError) {
  const ObservedSystem system = different();
  const auto after = [&](double h, double t) {
    Vector e = start_error(system, different_start());
    const Matrix step = sampled_error_matrix(system, h);
    for (int k = 0; k < static_cast<int>(std::lround(t / h)); ++k) e = step * e;
    return e.norm();
  };
  EXPECT_NEAR(after(.01, 1), 1.0922, 5e-5);
  EXPECT_NEAR(after(.01, 2), .6073, 5e-5);
  EXPECT_NEAR(after(.01, 5), .0584, 5e-5);
  EXPECT_NEAR(after(.01, 10), .000377, 5e-7);
  const double exact = error_after(system, different_start(), 2.0);
  EXPECT_NEAR((after(.001, 2) - exact) / (after(.002, 2) - exact), 0.5, 0.01) << "first order";
}

TEST(Observer, TheSecondOrderSchemeTendsToTheContinuousErrorFaster) {
  for (const ObservedSystem& system : {second_order(different()), second_order(alike_three())}) {
    const Vector start = start_error(system, system.mu == 10.0 ? different_start() : Vector{{.5, -.5, .5, -.5, .5, -.5}});
    const Vector exact = matrix_exponential(error_matrix(system), 1.0) * start;
    const auto deviation = [&](double h) {
      const Matrix step = sampled_error_matrix(system, h);
      Vector e = second_order_start(system, start);
      for (int k = 0; k < static_cast<int>(std::lround(1.0 / h)); ++k) e = step * e;
      return (e.head(start.size()) - exact).norm();
    };
    EXPECT_NEAR(deviation(1e-4) / deviation(2e-4), 0.25, 0.02);
    EXPECT_LT(spectral_radius(sampled_error_matrix(system, 1e-3)), 1.0);
  }
  EXPECT_GT(spectral_radius(sampled_error_matrix(second_order(alike_three()), 1e-2)), 1.0) << "mu h = 5.7";
}

}  // namespace
}  // namespace consort
