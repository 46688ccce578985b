// Knotek, thesis, (3.9)-(3.16): gains of distributed Luenberger observers.

#include "protocols/luenberger.hpp"

#include "core/errors.hpp"
#include "core/math/schur.hpp"
#include "core/random.hpp"
#include "protocols/filters/estimator_network.hpp"
#include "tests/support/direct.hpp"
#include "tests/support/oscillator.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

const Matrix kOne = Matrix::Constant(1, 1, 1.0), kNone(0, 0);
Matrix identity(Eigen::Index n) { return Matrix::Identity(n, n); }

EstimatorNetwork network_of(const std::vector<ObserverGains>& gains) {
  EstimatorNetwork network{oscillator::two(), {}, {}};
  for (std::size_t i = 0; i < gains.size(); ++i) {
    network.injection.push_back(gains[i].L * oscillator::two_seen()[i]);
    network.coupling.push_back(gains[i].F);
  }
  return network;
}

std::vector<ObserverGains> kim(double gamma, double k) {
  std::vector<ObserverGains> gains;
  for (const Matrix& C : oscillator::two_seen())
    gains.push_back(kim_gains(oscillator::two(), C, identity(4), C.rows() ? kOne : kNone, gamma, k));
  return gains;
}
std::vector<ObserverGains> zhang(double c) {
  std::vector<ObserverGains> gains;
  for (const Matrix& C : oscillator::two_seen())
    gains.push_back(zhang_gains(oscillator::two(), C, identity(4), C.rows() ? kOne : kNone, c, identity(4), identity(4)));
  return gains;
}

TEST(KimGains, NetworkHasTheStatedAbscissa) {
  EXPECT_NEAR(spectral_abscissa(network_of(kim(8, 1)).error_matrix(ring(4))), -.233679, 5e-7);
  EXPECT_GT(spectral_abscissa(network_of(kim(8, 1)).error_matrix(Graph(4, std::span<const Edge>()))), -1e-9)
      << "alone nobody sees everything";
}

TEST(KimGains, InjectWhereTheAgentSeesAndCoupleByWhatItSees) {
  const auto gains = kim(8, 2);
  EXPECT_LT(gains[0].L.bottomRows(2).norm(), 1e-14);
  EXPECT_LT((gains[0].F.bottomRightCorner(2, 2) - 8 * identity(2)).norm(), 1e-13);
  EXPECT_LT((2 * gains[0].F.topLeftCorner(2, 2) - kim(8, 1)[0].F.topLeftCorner(2, 2)).norm(), 1e-12);
  EXPECT_EQ(gains[3].L.cols(), 0);
  EXPECT_EQ(gains[3].F, 8 * identity(4));
  // A sensor whose C is zero is none.
  const ObserverGains blind = kim_gains(oscillator::two(), Matrix::Zero(1, 4), identity(4), kOne, 8, 1);
  EXPECT_EQ(blind.L, Matrix::Zero(4, 1));
  EXPECT_EQ(blind.F, 8 * identity(4));
}

TEST(KimGains, ObservableErrorIsStableAndTheCouplingSolvesTheLyapunovEquation) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose("kim gains"));
    const Matrix A = Matrix::NullaryExpr(4, 4, [&] { return stream.uniform(-1.0, 1.0); });
    const Matrix C = Matrix::NullaryExpr(2, 4, [&] { return stream.uniform(-1.0, 1.0); });
    const ObserverGains gains = kim_gains(A, C, identity(4), direct::random_spd(stream, 2), 3, 0.5);
    const Matrix closed = A - gains.L * C;
    EXPECT_LT(spectral_abscissa(closed), 0.0);
    // F = (gamma / k) M^-1, so M^-1 closed' + closed M^-1 = -M^-2                                             (3.12) times M^-1 twice
    const Matrix inverse = gains.F * (0.5 / 3);
    EXPECT_LT((inverse * closed.transpose() + closed * inverse + inverse * inverse).norm(), 1e-8 * inverse.norm() * (1 + inverse.norm()));
  }
}

TEST(StateGroups, AreTheBlocksOfTheMatrix) {
  EXPECT_EQ(state_groups(oscillator::two()), (StateGroups{{0, 1}, {2, 3}}));
  EXPECT_EQ(state_groups(oscillator::A()), (StateGroups{{0, 1}}));
  EXPECT_EQ(state_groups(Matrix::Zero(3, 3)), (StateGroups{{0}, {1}, {2}}));
  Matrix crossed = Matrix::Zero(4, 4);  // the blocks need not lie together
  crossed(0, 2) = 1;
  crossed(3, 1) = 1;
  EXPECT_EQ(state_groups(crossed), (StateGroups{{0, 2}, {1, 3}}));
  EXPECT_EQ(seen_groups(state_groups(crossed), (Matrix(1, 4) << 0, 0, 1, 0).finished()), (std::vector<bool>{true, false}));
  EXPECT_EQ(seen_groups(state_groups(crossed), Matrix(0, 4)), (std::vector<bool>{false, false}));
  EXPECT_EQ(group_text({0, 2}), "{x1, x3}");
}

TEST(ZhangGains, NetworkOnADirectedRingHasTheStatedAbscissa) {
  EXPECT_NEAR(spectral_abscissa(network_of(zhang(5)).error_matrix(directed_ring(4))), -.608967, 5e-7);
}

TEST(ZhangGains, CoupleOnlyWhatTheAgentDoesNotSee) {
  const auto gains = zhang(5);
  EXPECT_EQ(gains[0].F.topRows(2), Matrix::Zero(2, 4));
  EXPECT_LT((gains[0].F.bottomRightCorner(2, 2) - 5 * identity(2)).norm(), 1e-12) << "F_j = I";
  EXPECT_EQ(gains[2].F, Matrix::Zero(4, 4));
  EXPECT_LT((gains[3].F - 5 * identity(4)).norm(), 1e-12);
  EXPECT_EQ(gains[0].L.bottomRows(2), Matrix::Zero(2, 1));
}

TEST(ZhangGains, RefuseAGroupThatIsSeenInPart) {
  // One number cannot tell two equal oscillators apart.
  Matrix equal = oscillator::two();
  equal(2, 3) = 1;
  equal(3, 2) = -1;
  try {
    static_cast<void>(zhang_gains(equal, oscillator::two_seen()[2], identity(4), kOne, 5, identity(4), identity(4)));
    FAIL() << "a mode that cannot be observed was accepted";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("{x1, x2} {x3, x4}"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("eigenvalue"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace consort
