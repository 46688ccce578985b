// Adaptive consensus and its reference estimators, one agent at a time.

#include "protocols/adaptive/adaptive_consensus.hpp"
#include "core/random.hpp"
#include "tests/protocols/plant_agent.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace consort {
namespace {

using std::numbers::pi;
constexpr double kRoot3 = 1.7320508075688772;
const std::vector<Neighbour> kTwo{{AgentId{2}, 1.0}, {AgentId{3}, 0.5}};

PlantAgent adaptive(const std::map<std::string, double>& parameters = {}, const std::map<std::string, double>& initial = {},
                    Seconds dt = 0.01) {
  return {"adaptive_consensus", parameters, initial, dt};
}

TEST(AdaptiveConsensus, GainsOfTheDoubleIntegratorAreTheAnalyticOnes) {
  Values model, parameters, initial;
  model.set("A", (Matrix(2, 2) << 0, 1, 0, 0).finished());
  model.set("B", (Matrix(2, 1) << 0, 1).finished());
  model.set("C", Matrix(Matrix::Identity(2, 2)));
  const auto p = AdaptiveConsensus::params(parameters, consort::Setup{AgentId{1}, 2, 0.01, initial, model, 2});
  EXPECT_NEAR(p.K(0, 0), 1.0, 1e-12);
  EXPECT_NEAR(p.K(0, 1), kRoot3, 1e-12);
  const Matrix Gamma = p.root.transpose() * p.root;
  EXPECT_NEAR((Gamma - (Matrix(2, 2) << 1, kRoot3, kRoot3, 3).finished()).norm(), 0.0, 1e-12);
  EXPECT_NEAR(p.beta, 0.9 / 2.732051, 1e-7);
}

TEST(AdaptiveConsensus, ControlAndGainFollowTheirEquations) {
  PlantAgent agent = adaptive({{"beta", 0.5}}, {{"c", 2.0}, {"kappa", 0.3}});
  agent.absorb({1, 0}, kTwo, {{2, {2, 1, 0, 0, 0}}, {3, {0, 1, 0, 0, 0}}});
  // K (x_2 - x_1) = 1 + sqrt3, K (x_3 - x_1) = -1 + sqrt3, the second with weight 1/2
  EXPECT_NEAR(agent.control(), 2.0 * (1 + kRoot3 + 0.5 * (-1 + kRoot3)), 1e-12);
  const double q = (1 + kRoot3) * (1 + kRoot3) + 0.5 * (-1 + kRoot3) * (-1 + kRoot3), r = 0.3 + q / 0.5;
  EXPECT_NEAR(agent.estimate()[0], r + (2.0 - r) * std::exp(-0.5 * 0.01), 1e-12);
  EXPECT_EQ(agent.estimate()[1], 0.3);
}

TEST(AdaptiveConsensus, AMissingMessageIsAnAbsentTermAndNoChangeOfTheNetwork) {
  PlantAgent agent = adaptive({{"beta", 0.5}}, {{"c", 2.0}, {"kappa", 2.0}});
  agent.absorb({0, 0}, kTwo, {{2, {0, 0, 0, 0, 0}}, {3, {0, 0, 0, 0, 0}}});
  agent.absorb({0, 0}, kTwo, {{2, {1, 0, 0, 0, 0}}});
  EXPECT_NEAR(agent.control(), 2.0, 1e-12);
  EXPECT_EQ(agent.emit({0, 0}, kTwo)[2], 0.0);
}

TEST(AdaptiveConsensus, WithAnEmptyInboxSteersNothingAndTheGainDecaysToItsReference) {
  PlantAgent agent = adaptive({{"beta", 2.0}}, {{"c", 5.0}, {"kappa", 1.0}}, 0.1);
  for (int k = 0; k < 10; ++k) agent.absorb({3, -1}, {}, {});
  EXPECT_EQ(agent.control(), 0.0);
  EXPECT_NEAR(agent.estimate()[0], 1.0 + 4.0 * std::exp(-2.0), 1e-12);
}

TEST(AdaptiveConsensus, WithoutDecayTheGainOnlyGrows) {
  PlantAgent agent = adaptive({{"beta", 0.0}}, {{"c", 1.0}});
  agent.absorb({0, 0}, {{AgentId{2}, 1.0}}, {{2, {1, 0, 0, 0, 0}}});
  EXPECT_NEAR(agent.estimate()[0], 1.01, 1e-12);
}

TEST(AdaptiveConsensus, BeginsAgainInTheRoundInWhichItsInNeighboursChange) {
  PlantAgent agent = adaptive({}, {{"c", 0.5}});
  for (int k = 0; k < 5; ++k) agent.absorb({0, 0}, kTwo, {{2, {4, 0, 0, 0, 0}}, {3, {4, 0, 0, 0, 0}}});
  EXPECT_GT(agent.estimate()[0], 0.5);
  const std::vector<Neighbour> one{{AgentId{2}, 1.0}};
  EXPECT_EQ(agent.emit({0, 0}, one)[2], 6.0) << "the change of round 5 is told as the round after it";
  agent.absorb({0, 0}, one, {{2, {1, 0, 0, 0, 0}}});
  EXPECT_NEAR(agent.control(), 0.5, 1e-12) << "the control of that round has c(0) already";
}

TEST(AdaptiveConsensus, BeginsAgainOnNewsOfAChangeOnceAndPassesItOn) {
  PlantAgent agent = adaptive({}, {{"c", 0.5}});
  for (int k = 0; k < 5; ++k) agent.absorb({0, 0}, kTwo, {{2, {4, 0, 0, 0, 0}}});
  agent.absorb({0, 0}, kTwo, {{2, {1, 0, 4, 0, 0}}});
  EXPECT_NEAR(agent.control(), 0.5, 1e-12);
  EXPECT_EQ(agent.emit({0, 0}, kTwo)[2], 4.0);
  const double before = agent.estimate()[0];
  agent.absorb({0, 0}, kTwo, {{2, {1, 0, 4, 0, 0}}});
  EXPECT_NEAR(agent.control(), before, 1e-12) << "old news";
}

TEST(AdaptiveConsensus, DoesNotBeginAgainWhenToldNotTo) {
  PlantAgent agent = adaptive({{"reset", 1.0}}, {{"c", 0.5}});
  agent.absorb({0, 0}, kTwo, {{2, {4, 0, 0, 0, 0}}});
  const double before = agent.estimate()[0];
  agent.absorb({0, 0}, {{AgentId{2}, 1.0}}, {{2, {1, 0, 9, 0, 0}}});
  EXPECT_NEAR(agent.control(), before, 1e-12);
}

TEST(AdaptiveConsensus, RefusesWhatMakesNoSenseAndSaysWhy) {
  const auto refusal = [](const std::map<std::string, double>& parameters, const std::map<std::string, double>& initial,
                          std::size_t measurement = 2) -> std::string {
    try {
      PlantAgent("adaptive_consensus", parameters, initial, 0.01, measurement);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal({}, {}), "");
  EXPECT_NE(refusal({{"beta", -1.0}}, {}).find("beta"), std::string::npos);
  EXPECT_NE(refusal({}, {{"c", 0.0}}).find("allowed: above 0"), std::string::npos);
  EXPECT_NE(refusal({}, {{"c", -1e-9}}).find("c is -1e-09; allowed: above 0"), std::string::npos);
  EXPECT_NE(refusal({}, {}, 4).find("whole state"), std::string::npos);
  EXPECT_NE(refusal({{"reference", 2.0}}, {}).find("xi"), std::string::npos);
  EXPECT_NE(refusal({{"reference", 2.0}, {"xi", 10.0}}, {}).find("initial r"), std::string::npos);
  EXPECT_NE(refusal({{"reference", 1.0}, {"sampling", 30.0}}, {}).find("rounds between two samples"), std::string::npos);
  EXPECT_NE(refusal({{"reference", 1.0}, {"window", 0.03}}, {}).find("samples in a window"), std::string::npos);
}

// --- Algorithm 4.1 ------------------------------------------------------------------------------------------------------

Reference::Rule halving(bool sliding, double dead_zone = 0.0) { return {Reference::Kind::halving, sliding, 2, 3, dead_zone, 0.0, 0.1}; }
Reference::State started(const Reference::Rule& rule, double c) {
  const Values none;
  return Reference::start("test", rule, Setup{AgentId{1}, 1, 0.1, none}, c);
}
/// kappa after each round.
std::vector<double> kappas(const Reference::Rule& rule, Reference::State state, const std::vector<double>& c) {
  std::vector<double> out;
  for (std::size_t k = 0; k < c.size(); ++k) {
    Reference::advance(rule, state, static_cast<Round>(k), c[k], 0.0, 0.0);
    out.push_back(state.kappa);
  }
  return out;
}

TEST(Halving, ABlockGivesTheMiddleOfItsSamplesAndIsEmptied) {
  // Samples in rounds 0, 2, 4 (5, 1, 3), then 6, 8, 10 (8, 9, 8).
  const auto got = kappas(halving(false), started(halving(false), 1.0), {5, 99, 1, 99, 3, 99, 8, 99, 9, 99, 8});
  EXPECT_EQ(got, (std::vector<double>{1, 1, 1, 1, 3, 3, 3, 3, 3, 3, 8.5}));
}

TEST(Halving, ASlidingWindowStartsFullOfTheInitialGain) {
  const auto got = kappas(halving(true), started(halving(true), 1.0), {5, 99, 4, 99, 6, 99, 6});
  EXPECT_EQ(got, (std::vector<double>{3, 3, 3, 3, 5, 5, 5}));
}

TEST(Halving, SmallChangesStayWithinTheDeadZone) {
  const auto got = kappas(halving(false, 0.5), started(halving(false, 0.5), 1.0), {1, 1, 1.8, 1, 1.9, 1, 3, 3, 3, 3, 3, 3});
  EXPECT_EQ(got[5], 1.0);  // 1.45
  EXPECT_EQ(got[11], 3.0);
}

TEST(Halving, RestartForgetsTheWindow) {
  for (const bool sliding : {false, true}) {
    Reference::State state = started(halving(sliding), 1.0);
    Reference::advance(halving(sliding), state, 0, 50.0, 0.0, 0.0);
    Reference::restart(state, 1.0, 1.0);
    EXPECT_EQ(kappas(halving(sliding), state, {2, 0, 2, 0, 2}).back(), 2.0);
  }
}

// --- Algorithm 4.2 ------------------------------------------------------------------------------------------------------

std::vector<std::complex<double>> turning(const std::vector<std::pair<std::complex<double>, double>>& lines, std::size_t samples,
                                          Seconds spacing) {
  std::vector<std::complex<double>> z(samples);
  for (std::size_t i = 0; i < samples; ++i)
    for (const auto& [amplitude, omega] : lines) z[i] += amplitude * std::polar(1.0, omega * spacing * static_cast<double>(i));
  return z;
}

TEST(SmallestFrequency, IsFoundWithin2PercentAmongOthersAndAConstant) {
  // Property: the smallest at two bins of the window or more, the next at least two bins on, all below half the sampling.
  constexpr Seconds kSpacing = 0.02;
  constexpr std::size_t kSamples = 250;
  constexpr double kBin = 2.0 * pi / (kSamples * kSpacing);
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"test"}, 1);
    const auto amplitude = [&] { return std::polar(stream.uniform(0.3, 1.0), stream.uniform(-pi, pi)); };
    const double smallest = kBin * stream.uniform(2.0, 30.0), next = smallest + kBin * stream.uniform(4.0, 40.0);
    const auto z = turning({{amplitude(), 0.0}, {amplitude(), smallest}, {amplitude(), next}}, kSamples, kSpacing);
    const auto found = Reference::smallest_frequency(z, kSpacing);
    ASSERT_TRUE(found.has_value());
    EXPECT_NEAR(*found, smallest, 0.02 * smallest);
  }
}

TEST(SmallestFrequency, IsNotThereInAConstant) {
  EXPECT_FALSE(Reference::smallest_frequency(turning({{{1.0, -1.0}, 0.0}}, 100, 0.1), 0.1).has_value());
}

TEST(SmallestFrequency, MissesALineBelowOneTwentiethOfTheStrongest) {
  const auto z = turning({{0.02, 20.0}, {1.0, 60.0}}, 250, 0.02);
  EXPECT_NEAR(Reference::smallest_frequency(z, 0.02).value(), 60.0, 0.1);
}

TEST(ArtificialStates, KeepTheirAmplitudeOverManyRounds) {
  // Two agents, lambda_2 = 2, xi = 10, dt = 0.01: dt xi lambda = 0.2.
  const Reference::Rule rule{Reference::Kind::eigenvalue, false, 2, 1'000'000, 0.0, 10.0, 0.01};
  Reference::State a, b;
  a.r = 1;
  b.r = -1;
  a.q = b.q = 1;
  double largest = 0.0;
  for (Round k = 0; k < 200'000; ++k) {
    const double r = a.r - b.r, q = a.q - b.q;
    Reference::advance(rule, a, k, 1.0, r, q);
    Reference::advance(rule, b, k, 1.0, -r, -q);
    if (k >= 199'000) largest = std::max(largest, std::abs(a.r));
  }
  EXPECT_GT(largest, 0.95);
  EXPECT_LT(largest, 1.1);
}

}  // namespace
}  // namespace consort
