// Knotek, thesis, section 3.1: the filters (3.4), (3.6), (3.7) at their stationary gains.

#include "protocols/filters/estimator_network.hpp"

#include "core/math/decompositions.hpp"
#include "core/math/discretise.hpp"
#include "core/math/schur.hpp"
#include "protocols/filters/riccati_step.hpp"
#include "tests/support/direct.hpp"
#include "tests/support/oscillator.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

using namespace oscillator;

constexpr double kGamma = 5.0;

void expect_near(const Matrix& found, const Matrix& expected, double tolerance) {
  EXPECT_LE((found - expected).cwiseAbs().maxCoeff(), tolerance) << found;
}
Matrix symmetric(double a, double b, double c) { return (Matrix(2, 2) << a, b, b, c).finished(); }

TEST(Observers, ASensorSaysWhatItsMeasurementIsWorth) {
  const Matrix C = (Matrix(2, 3) << 1, 2, 0, 0, 1, 1).finished(), R = (Matrix(2, 2) << 2, 0.5, 0.5, 1).finished();
  const Sensor found = sensor(C, R);
  expect_near(found.to_u, C.transpose() * inverse(R, "R"), 1e-15);
  expect_near(found.U, C.transpose() * inverse(R, "R") * C, 1e-15);
  EXPECT_EQ(found.U, found.U.transpose());
  const Sensor none = sensor(Matrix(0, 3), Matrix(0, 0));
  EXPECT_EQ(none.to_u.cols(), 0);
  EXPECT_EQ(none.U, Matrix::Zero(3, 3));
  EXPECT_THROW(static_cast<void>(sensor(C, Matrix::Zero(2, 2))), ConfigError);
  EXPECT_THROW(static_cast<void>(sensor(C, Matrix::Identity(3, 3))), ConfigError);
}

TEST(Observers, TheCorrectionIsThatOfTheKalmanFilter) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose("correction"));
    const Matrix P = direct::random_spd(stream, 3), R = direct::random_spd(stream, 2);
    const Matrix C = Matrix::NullaryExpr(2, 3, [&] { return stream.uniform(-1.0, 1.0); });
    const Vector y = direct::random_vector(stream, 2), z = direct::random_vector(stream, 3);
    const double h = 0.3;
    const Matrix K = P * C.transpose() * inverse(C * P * C.transpose() + R / h, "C P C' + R / h");
    const Sensor s = sensor(C, R);
    expect_near(corrected_by(s.to_u * y, s.U, P, z, h), K * (y - C * z), 1e-11);
  }
}

TEST(Observers, CouplingStepsAgreeAndNeverOvershoot) {
  const Matrix P = symmetric(2, 0.5, 1);
  for (const double h : {1e-6, 0.1, 10.0}) expect_near(coupling_step(kGamma * P, 2.0, h), coupling_step(P, kGamma, 2.0, h), 1e-14);
  expect_near(coupling_step(kGamma * P, 2.0, 1e-9), kGamma * 1e-9 * P, 1e-15);
  expect_near(coupling_step(P, kGamma, 2.0, 1e4), 0.5 * Matrix::Identity(2, 2), 1e-15);  // on the mean of the two neighbours
  expect_near(coupling_step(Matrix::Zero(2, 2), 2.0, 1.0), Matrix::Zero(2, 2), 0.0);
}

TEST(Observers, CentralisedCovarianceIsTheStatedOne) {
  expect_near(stationary_covariance(A(), seen_by_all(), Q()), symmetric(.134208, .020761, .176480), 5e-7);
}

EstimatorNetwork olfati_saber(const Graph& graph, bool aggregated, std::vector<Matrix>* P = nullptr) {
  EstimatorNetwork network{A(), {}, {}};
  for (std::size_t i = 0; i < 4; ++i) {
    const Matrix U = aggregated ? seen_around(graph, i) : sensor_of(i).U;
    const Matrix own = stationary_covariance(A(), U, Q());
    network.injection.push_back(own * U);
    network.coupling.push_back(kGamma * own);
    if (P != nullptr) P->push_back(own);
  }
  return network;
}

TEST(Observers, OlfatiSaberHasTheStatedCovarianceAndAbscissa) {
  std::vector<Matrix> P;
  const EstimatorNetwork network = olfati_saber(ring(4), false, &P);
  expect_near(P[0], symmetric(.312606, .047723, .342443), 5e-7);
  EXPECT_NEAR(spectral_abscissa(network.error_matrix(ring(4))), -.349193, 5e-7);
  P.clear();
  EXPECT_NEAR(spectral_abscissa(olfati_saber(ring(4), true, &P).error_matrix(ring(4))), -.580611, 5e-7);
  expect_near(P[0], symmetric(.150298, .029499, .186846), 1e-6);
}

/// (3.7c) for all agents at once, by the Runge-Kutta method of step 0.01 s.
std::vector<Matrix> integrated(const std::vector<Matrix>& U, double k, const Graph& graph, double seconds) {
  using All = std::vector<Matrix>;
  const auto slope = [&](const All& P) {
    All out;
    for (std::size_t i = 0; i < P.size(); ++i) {
      out.push_back(A() * P[i] + P[i] * A().transpose() + Q() - P[i] * U[i] * P[i]);
      for (const Neighbour& j : graph.in_neighbours(agent_at(i))) out[i] += k * j.weight * (P[index_of(j.id)] - P[i]);
    }
    return out;
  };
  const auto along = [](All P, const All& by, double h) {
    for (std::size_t i = 0; i < P.size(); ++i) P[i] += h * by[i];
    return P;
  };
  All P(U.size(), Matrix::Identity(2, 2));
  constexpr double h = 0.01;
  for (int step = 0; step < std::lround(seconds / h); ++step) {
    const All k1 = slope(P), k2 = slope(along(P, k1, h / 2)), k3 = slope(along(P, k2, h / 2)), k4 = slope(along(P, k3, h));
    P = along(along(along(along(P, k1, h / 6), k2, h / 3), k3, h / 3), k4, h / 6);
  }
  return P;
}
std::vector<Matrix> three_sensors() { return {sensor_of(0).U, sensor_of(1).U, sensor_of(2).U, Matrix::Zero(2, 2)}; }

EstimatorNetwork kim(const std::vector<Matrix>& P) {
  EstimatorNetwork network{A(), {}, {}};
  for (std::size_t i = 0; i < 4; ++i) {
    network.injection.push_back(P[i] * three_sensors()[i]);
    network.coupling.push_back(kGamma * P[i]);
  }
  return network;
}

TEST(Observers, KimHasTheStatedCovarianceAndAbscissaAfterTwentySeconds) {
  const auto P = integrated(three_sensors(), 2.0, ring(4), 20.0);
  expect_near(P[0], symmetric(.412137, .02429, .49166), 1e-6);
  EXPECT_NEAR(spectral_abscissa(kim(P).error_matrix(ring(4))), -.230727, 5e-7);
}

TEST(Observers, CoupledCovariancesAreWhereTheEquationEnds) {
  const auto P = coupled_covariances(A(), coupled(three_sensors(), 2.0), ring(4));
  const auto late = integrated(three_sensors(), 2.0, ring(4), 100.0);
  for (std::size_t i = 0; i < 4; ++i) expect_near(P[i], late[i], 1e-10);
  expect_near(P[0], symmetric(.412054, .024281, .491528), 1e-6);
  EXPECT_NEAR(spectral_abscissa(kim(P).error_matrix(ring(4))), -.230673, 5e-7);
  // Uncoupled, agent 4 has nothing that bounds its covariance.
  EXPECT_THROW(static_cast<void>(coupled_covariances(A(), coupled(three_sensors(), 0.0), ring(4))), ConfigError);
  // An unseen growing mode needs k d / 2 above its rate.
  const Matrix growing = Matrix::Constant(1, 1, 1.0), one = Matrix::Constant(1, 1, 1.0), none = Matrix::Zero(1, 1);
  EXPECT_THROW(static_cast<void>(coupled_covariances(growing, {{one, one, 1.9}, {none, one, 1.9}}, path(2))), ConfigError);
  EXPECT_EQ(coupled_covariances(growing, {{one, one, 2.5}, {none, one, 2.5}}, path(2)).size(), 2U);
}

TEST(Observers, Algorithm31EndsWithTheStatedCovarianceAndForgetsItsErrors) {
  const Matrix step = matrix_exponential(A(), 0.1), noise = 0.1 * Q();
  std::vector<IterativeFilter> filters;
  for (std::size_t i = 0; i < 4; ++i) {
    const Matrix S = seen_around(ring(4), i);
    filters.push_back({S, stationary_update(step, S, noise), 1.0});
  }
  expect_near(step * filters[0].M * step.transpose() + noise, symmetric(.048188, .013251, .087089), 5e-7);
  const Matrix E = iterative_error_matrix(step, filters, ring(4));
  EXPECT_LT(std::pow(spectral_radius(E), 200), 1e-6) << "what is left after 200 rounds";
  // The pull of the others is that of the mean of their errors.
  const Vector equal = Vector::Constant(2, 0.7).replicate(4, 1);
  expect_near((E * equal).head(2), step * (Matrix::Identity(2, 2) - filters[0].M * filters[0].S) * equal.head(2), 1e-15);
  EXPECT_THROW(static_cast<void>(stationary_update(1.1 * step, Matrix::Zero(2, 2), noise)), RunError) << "it grows for ever";
}

TEST(Observers, InShortRoundsTheErrorMovesAsInContinuousTime) {
  const EstimatorNetwork network = olfati_saber(ring(4), false);
  const Matrix R = network.error_matrix(ring(4));
  const auto error = [&](Seconds h) { return (network.sampled_error_matrix(ring(4), h) - matrix_exponential(R, h)).norm(); };
  EXPECT_LT(error(1e-4), 1e-6);
  EXPECT_NEAR(error(1e-3) / error(1e-4), 100.0, 2.0) << "the local error is of second order";
  for (const double h : {0.01, 0.1, 0.5}) EXPECT_LT(spectral_radius(network.sampled_error_matrix(ring(4), h)), 1.0) << h;
}

TEST(Observers, TheCorrectionNeverOvershoots) {
  // What is left of an error after it has eigenvalues in (0, 1], however large the gain and long the round.
  for (const double h : {1e-3, 1.0, 1e6}) {
    SCOPED_TRACE(h);
    Matrix left(2, 2);
    for (Eigen::Index c = 0; c < 2; ++c) {
      const Vector z = Matrix::Identity(2, 2).col(c);
      left.col(c) = z + corrected_by(Vector::Zero(2), seen_by_all(), symmetric(3, 1, 2), z, h);
    }
    const Eigen::VectorXcd kept = eigenvalues(left, "what is left");
    EXPECT_EQ(kept.imag().norm(), 0.0);
    EXPECT_GT(kept.real().minCoeff(), 0.0);
    EXPECT_LT(kept.real().maxCoeff(), 1.0);
  }
}

}  // namespace
}  // namespace consort
