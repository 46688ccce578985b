// The network of observers of Knotek's thesis, chapter 3: its design, and the covariances of section 3.6.3.

#include "protocols/sensor_network/errors.hpp"

#include "core/math/decompositions.hpp"
#include "core/math/discretise.hpp"
#include "core/math/riccati.hpp"
#include "core/math/schur.hpp"
#include "protocols/filters/estimator_network.hpp"
#include "tests/core/cases.hpp"
#include "tests/core/math/systems.hpp"
#include "tests/support/beam_network.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace consort {
namespace {

using namespace cases;
using beam::Case;

Vector diagonal_of(const Matrix& P, std::size_t agent) { return P.diagonal().segment(8 * static_cast<Eigen::Index>(agent - 1), 8); }

/// In units of `unit`, to the digits stated.
void expect_digits(const Vector& value, const Vector& stated, double unit, double half_digit) {
  ASSERT_EQ(value.size(), stated.size());
  for (Eigen::Index c = 0; c < value.size(); ++c) EXPECT_NEAR(value[c] / unit, stated[c], half_digit * 1.0001) << "component " << c;
}
void expect_paper(const Vector& value, const Vector& paper, double unit, double tolerance = 0.08) {
  for (Eigen::Index c = 0; c < value.size(); ++c) EXPECT_NEAR(value[c] / unit / paper[c], 1.0, tolerance) << "component " << c;
}

// --- the beam's table ------------------------------------------------------------------------------------------------------

TEST(BeamNetwork, LocalCovariancesAreTheOnesStated) {
  const auto [network, observers] = beam::designed();
  const Vector M1 = observers[0].M_inverse.diagonal();
  expect_digits(M1, Vector{{27.79, 27.80, 35.07, 35.09, 71.39, 71.41, 74.29, 74.29}}, 1e-5, 5e-3);
  expect_paper(M1, Vector{{27, 27, 33, 33, 73, 73, 74, 74}}, 1e-5);
  double sum = 0.0;
  for (const LocalObserver& observer : observers) sum += observer.M_inverse.trace();
  EXPECT_NEAR(sum * 1e3, 10.598, 6e-4);
  EXPECT_NEAR(sum * 1e3 / 10.5, 1.0, 0.08);
}

double sum_of_observable(const beam::Designed& designed, const Matrix& P) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 6; ++i)
    for (const Eigen::Index c : designed.observers[i].observable) sum += diagonal_of(P, i + 1)[c];
  return sum;
}

TEST(BeamNetwork, StationaryCovariancesOf373AreTheOnesStated) {
  const beam::Designed designed = beam::designed();
  const Matrix P = error_covariance(designed.network);
  expect_digits(diagonal_of(P, 1), Vector{{13.76, 13.72, 17.62, 17.60, 32.61, 32.59, 65.85, 65.85}}, 1e-5, 5e-3);
  expect_digits(diagonal_of(P, 5), Vector{{13.31, 13.36, 25.46, 25.46, 41.61, 41.63, 66.82, 66.82}}, 1e-5, 5e-3);
  expect_paper(diagonal_of(P, 1), Vector{{14, 14, 17, 17, 33, 33, 66, 66}}, 1e-5);
  expect_paper(diagonal_of(P, 5), Vector{{14, 14, 24, 24, 42, 42, 67, 67}}, 1e-5);
  EXPECT_NEAR(P.trace() * 1e3, 16.053, 5e-4);
  EXPECT_NEAR(P.trace() * 1e3 / 16.1, 1.0, 0.08);
  const double observable = sum_of_observable(designed, P);
  EXPECT_NEAR(observable * 1e3, 6.466, 5e-4);
  EXPECT_NEAR(observable * 1e3 / 6.4, 1.0, 0.08);
}

TEST(BeamNetwork, CovarianceSolvesItsEquation) {
  const SensorNetwork network = beam::designed().network;
  const Matrix P = error_covariance(network), A = error_matrix(network);
  Matrix noise = kronecker(Matrix::Ones(6, 6), network.Omega);
  for (Eigen::Index i = 0; i < 6; ++i)
    noise.block(8 * i, 8 * i, 8, 8) += network.G[static_cast<std::size_t>(i)] * network.Xi[static_cast<std::size_t>(i)] *
                                       network.G[static_cast<std::size_t>(i)].transpose();
  EXPECT_LT((A * P + P * A.transpose() + noise).norm() / noise.norm(), 1e-6);
}

/// Variances of the filter with the sensors of agents 1 to 4 (rows of C).
Vector filter_variances(const Matrix& A, const Matrix& C) {
  const Vector Xi = Eigen::Map<const Vector>(beam::sensor_noises().data(), 4);
  return filter_riccati(A, C, beam::process_noise(), Xi.asDiagonal()).P.diagonal();
}
const Vector kPrinted{{4, 4, 6, 6, 20, 20, 60, 60}};  // e-5, one digit each

TEST(BeamNetwork, AFilterWithAllSensorsHasTheCovarianceStated) {
  const SensorNetwork network = beam::designed().network;
  Matrix C(4, 8);
  for (Eigen::Index i = 0; i < 4; ++i) C.row(i) = network.C[static_cast<std::size_t>(i)];
  const Vector P = filter_variances(network.A, C);
  expect_digits(P, Vector{{3.88, 4.04, 6.38, 6.51, 19.18, 19.30, 59.72, 59.73}}, 1e-5, 5e-3);
  // All within 8 % of the digit but one: 6.51 is 8.5 % above the thesis' 6, which stands for what rounds to it: 6.51 is 0.2 % above that.
  for (Eigen::Index c = 0; c < 8; ++c) {
    EXPECT_NEAR(P[c] / 1e-5 / kPrinted[c], 1.0, c == 3 ? 0.09 : 0.08) << c;
    const double half = kPrinted[c] < 10.0 ? 0.5 : 5.0, nearest = std::clamp(P[c] / 1e-5, kPrinted[c] - half, kPrinted[c] + half);
    EXPECT_NEAR(P[c] / 1e-5 / nearest, 1.0, 0.003) << c;
  }
}

TEST(BeamNetwork, TheFilterOfTheFiniteElementsHasTheDigitsOfTheThesis) {
  const ModalModel model = modal_model(bending_modes(Beam{}, 4), {3, 7, 9, 11}, 6, 10.0);
  const Matrix C = (model.C.array().abs() < 0.055).select(0.0, model.C);
  const Vector P = filter_variances(model.A, C) / 1e-5;
  for (Eigen::Index c = 0; c < 8; ++c) {
    const double digit = kPrinted[c] < 10.0 ? 1.0 : 10.0;
    EXPECT_EQ(std::round(P[c] / digit) * digit, kPrinted[c]) << c << ": " << P[c];
  }
}

TEST(BeamNetwork, GainsOfTheBestSensorAreTheOnesStatedAndTheThesisUsedATenthOfOmega) {
  const auto norms = [](Case given) {
    const auto [network, observers] = beam::designed(given);
    return Vector{{spectral_norm(observers[3].G), given.gamma * spectral_norm(observers[3].M_inverse)}};
  };
  const Vector good = norms({}), bad = norms({.Xi44 = 1e-2});
  EXPECT_NEAR(good[0], 251.5, 0.05);
  EXPECT_NEAR(good[1], 2.037, 5e-4);
  EXPECT_NEAR(bad[0], .444, 5e-4);
  EXPECT_NEAR(bad[1], 121.2, 0.05);
  const Vector tenth = norms({.Omega_scale = .1}), bad_tenth = norms({.Xi44 = 1e-2, .Omega_scale = .1});
  EXPECT_NEAR(tenth[0], 78.56, 5e-3);
  EXPECT_NEAR(tenth[1], .619, 5e-4);
  EXPECT_NEAR(bad_tenth[0], .108, 5e-4);
  EXPECT_NEAR(bad_tenth[1], 33.40, 5e-3);
  expect_paper(tenth, Vector{{77, .64}}, 1.0);
  expect_paper(bad_tenth, Vector{{.11, 33}}, 1.0);
}

TEST(BeamNetwork, NotAllVariancesAreSmallerThanTheLocalOnes) {
  // The thesis says they are; of its best sensor, agent 4, modes 2 and 3 are not, by less than 0.8 %.
  const beam::Designed designed = beam::designed();
  const Matrix P = error_covariance(designed.network);
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& [observes, observable, M_inverse, G, decay] = designed.observers[i];
    for (std::size_t c = 0; c < observable.size(); ++c) {
      const double ratio = diagonal_of(P, i + 1)[observable[c]] / M_inverse(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(c));
      if (i == 3 && c >= 2) {
        EXPECT_GT(ratio, 1.0) << c;
        EXPECT_LT(ratio, 1.008) << c;
      } else {
        EXPECT_LT(ratio, 1.0) << "agent " << i + 1 << ", component " << c;
      }
    }
  }
  const Matrix& M4 = designed.observers[3].M_inverse;
  EXPECT_NEAR(diagonal_of(P, 4)[2] * 1e5, 6.552, 5e-4);
  EXPECT_NEAR(M4(2, 2) * 1e5, 6.549, 5e-4);
  EXPECT_NEAR(diagonal_of(P, 4)[4] * 1e5, 20.24, 5e-3);
  EXPECT_NEAR(M4(4, 4) * 1e5, 20.09, 5e-3);
}

TEST(BeamNetwork, ADegradedSensorAndABrokenLinkCostMoreThanNothing) {
  // The thesis calls the differences in variance negligible: they are 42 % and 25 % of the trace.
  const Case a, b{.Xi44 = 1e-2}, c{.link_4_1 = false};
  const std::vector<Case> all{a, b, c};
  const std::vector<double> traces{16.05, 22.73, 20.09}, abscissas{-.793, -.793, -.812};
  for (std::size_t s = 0; s < 3; ++s) {
    SCOPED_TRACE(s);
    const SensorNetwork network = beam::designed(all[s]).network;
    EXPECT_NEAR(error_covariance(network).trace() * 1e3, traces[s], 5e-3);
    EXPECT_NEAR(spectral_abscissa(error_matrix(network)), abscissas[s], 5e-4);
  }
  const auto first = [](const Case& given) {
    const Vector diagonal = diagonal_of(error_covariance(beam::designed(given).network), 1);
    return Vector{{diagonal[0], diagonal[2], diagonal[4], diagonal[6]}};
  };
  expect_digits(first(b), Vector{{16.9, 32.0, 70.7, 65.8}}, 1e-5, 5e-2);
  expect_digits(first(c), Vector{{19.4, 31.2, 66.3, 64.2}}, 1e-5, 5e-2);
}

TEST(BeamNetwork, TracesForOtherGammasAreTheOnesStated) {
  const auto trace = [](double gamma) { return error_covariance(beam::designed({.gamma = gamma}).network).trace() * 1e3; };
  EXPECT_NEAR(trace(1e3), 22.29, 5e-3);
  EXPECT_NEAR(trace(1e5), 12.73, 5e-3);
}

TEST(BeamNetwork, AgentSixHearingFiveInsteadOfTwoHasTheTraceStated) {
  SensorNetwork network = beam::designed().network;
  std::vector<Edge> edges = beam::edges();
  std::replace(edges.begin(), edges.end(), edge(2, 6), edge(5, 6));
  network.graph = Graph(6, edges);
  EXPECT_NEAR(error_covariance(network).trace() * 1e3, 16.194, 5e-4);
}

TEST(BeamNetwork, TheMirroredGraphFitsAsWell) {
  SensorNetwork network = beam::designed().network;
  std::vector<Edge> edges;
  for (const auto& [from, to] :
       std::vector<std::pair<std::uint32_t, std::uint32_t>>{{1, 3}, {3, 2}, {2, 1}, {2, 4}, {4, 1}, {2, 5}, {3, 6}})
    edges.push_back(edge(from, to));
  network.graph = Graph(6, edges);
  const Matrix P = error_covariance(network);
  const Vector P1 = diagonal_of(P, 1), P5 = diagonal_of(P, 5);
  expect_digits(Vector{{P1[0], P1[2], P1[4], P1[6]}}, Vector{{14.0, 17.6, 32.6, 65.8}}, 1e-5, 5e-2);
  expect_digits(Vector{{P5[0], P5[2], P5[4], P5[6]}}, Vector{{15.0, 25.5, 41.6, 66.8}}, 1e-5, 5e-2);
}

TEST(BeamNetwork, UntruncatedSensorsGiveTheCentralisedFilterAnotherFourthMode) {
  SensorNetwork network = beam::designed().network;
  const Matrix C{{.2034645, 0, .1596524, 0, .1078220, 0, .0593079, 0},
                 {.5167411, 0, .0498207, 0, -.0937838, 0, -.0288264, 0},
                 {.4781017, 0, -.1368728, 0, -.0449330, 0, .0626472, 0},
                 {.3097591, 0, -.1966885, 0, .0886445, 0, -.0109810, 0}};
  const Matrix Xi = Vector{{2e-6, 5e-6, 3e-6, .1e-6}}.asDiagonal();
  EXPECT_NEAR(filter_riccati(network.A, C, network.Omega, Xi).P(6, 6) * 1e5, 51.0, 0.5);
}

TEST(BeamNetwork, ErrorNormsWithoutNoiseAreTheOnesStated) {
  const Matrix A = error_matrix(beam::designed().network);
  const Vector e0 = Vector{{2.9, 0, -5.2, 0, -6.2, 0, 21.5, 0}}.replicate(6, 1);
  const std::vector<std::pair<double, double>> global{{.1, 50.97}, {.5, 35.60}, {1, 23.82}, {2, 10.77}, {5, .998}};
  for (const auto& [t, stated] : global) EXPECT_NEAR((matrix_exponential(A, t) * e0).norm(), stated, stated > 1 ? 5.1e-3 : 5e-4) << t;
  const Vector e = matrix_exponential(A, .5) * e0;
  const auto norms = [&](Eigen::Index agent) {
    Vector out(4);
    for (Eigen::Index j = 0; j < 4; ++j) out[j] = e.segment(8 * (agent - 1) + 2 * j, 2).norm();
    return out;
  };
  const Vector one = norms(1), four = norms(4), five = norms(5);
  expect_digits(one, Vector{{.2210, .8852, 1.0164, 14.4325}}, 1, 5e-5);
  EXPECT_NEAR(four[0], .00812, 5e-6);
  EXPECT_NEAR(four[1], .0940, 5e-5);
  EXPECT_NEAR(four[2], .4206, 5e-5);
  EXPECT_NEAR(four[3], 14.488, 5e-4);
  expect_digits(five.head(3), Vector{{.2392, 1.2862, 1.2096}}, 1, 5e-5);
  EXPECT_NEAR(five[3], 14.488, 5e-4);
}

TEST(BeamNetwork, SampledCovariancesAreTheOnesStated) {
  const SensorNetwork network = beam::designed().network;
  EXPECT_NEAR(sampled_error_covariance(network, 1e-4).trace() * 1e3, 16.055, 5e-4);
  EXPECT_NEAR(sampled_error_covariance(network, 1e-3).trace() * 1e3, 16.087, 5e-4);
  EXPECT_LT(spectral_radius(sampled_error_matrix(network, 2e-2)), 1.0);
}

TEST(BeamNetwork, TheStiffestEigenvalueIsTheOneStated) {
  double largest = 0.0;
  for (const auto& lambda : eigenvalues_of(error_matrix(beam::designed().network))) largest = std::max(largest, std::abs(lambda));
  EXPECT_NEAR(largest, 1.003e4, 5.0);
}

// --- the design in general -------------------------------------------------------------------------------------------------

TEST(StateGroups, AreTheBlocksOfAPermutedBlockDiagonalMatrix) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"state groups"});
    StateGroups expected;
    Eigen::Index n = 0;
    const std::size_t blocks = 1 + stream.below(5);
    std::vector<Eigen::Index> sizes;
    for (std::size_t b = 0; b < blocks; ++b) n += sizes.emplace_back(random_size(stream, 3));
    const auto order = random_order(stream, static_cast<std::size_t>(n));
    Matrix A = Matrix::Zero(n, n);
    Eigen::Index at = 0;
    for (const Eigen::Index size : sizes) {
      std::vector<Eigen::Index> group;
      for (Eigen::Index c = 0; c < size; ++c) group.push_back(static_cast<Eigen::Index>(order[static_cast<std::size_t>(at + c)]));
      for (Eigen::Index c = 0; c < size; ++c) {
        A(group[static_cast<std::size_t>(c)], group[static_cast<std::size_t>(c)]) = stream.normal();
        if (c > 0) {  // a chain, coupled in one direction only
          const auto from = group[static_cast<std::size_t>(c - 1)], to = group[static_cast<std::size_t>(c)];
          (stream.uniform() < 0.5 ? A(from, to) : A(to, from)) = 1.0;
        }
      }
      std::sort(group.begin(), group.end());
      expected.push_back(group);
      at += size;
    }
    std::sort(expected.begin(), expected.end());
    ASSERT_EQ(state_groups(A), expected);
  }
}

TEST(StateGroups, OfTheBeamAreItsModes) {
  EXPECT_EQ(state_groups(beam::dynamics()), (StateGroups{{0, 1}, {2, 3}, {4, 5}, {6, 7}}));
  const auto observers = beam::designed().observers;
  EXPECT_EQ(observers[0].observes, (std::vector<char>{1, 1, 1, 1}));
  EXPECT_EQ(observers[1].observes, (std::vector<char>{1, 0, 1, 0}));
  EXPECT_EQ(observers[2].observes, (std::vector<char>{1, 1, 0, 1}));
  EXPECT_EQ(observers[3].observes, (std::vector<char>{1, 1, 1, 0}));
  EXPECT_EQ(observers[4].observes, (std::vector<char>{0, 0, 0, 0}));
}

TEST(LocalObserver, HasNothingToSayWithoutASensor) {
  const LocalObserver none = beam::designed().observers[4];
  EXPECT_EQ(none.G.rows(), 8);
  EXPECT_EQ(none.G.cols(), 0);
  EXPECT_EQ(none.M_inverse.size(), 0);
  EXPECT_EQ(none.decay, std::numeric_limits<double>::infinity());
  const StateGroups groups = state_groups(beam::dynamics());
  EXPECT_EQ(consensus_gain(none, groups, 1e4, Vector{{1, 2, 3, 4}}), Matrix(1e4 * Vector{{1, 1, 2, 2, 3, 3, 4, 4}}.asDiagonal()));
}

TEST(LocalObserver, GainsActOnObservedGroupsAloneAndSolve329) {
  const auto [network, observers] = beam::designed();
  const LocalObserver& two = observers[1];
  EXPECT_EQ(two.observable, (std::vector<Eigen::Index>{0, 1, 4, 5}));
  for (const Eigen::Index c : {2, 3, 6, 7}) EXPECT_EQ(two.G(c, 0), 0.0);
  const auto& o = two.observable;
  const Matrix A = network.A(o, o), C = network.C[1](Eigen::all, o), Q = network.Omega(o, o), M = two.M_inverse;
  const Matrix rest = M * A.transpose() + A * M + Q - M * C.transpose() * C * M / 5e-6;
  EXPECT_LT(rest.norm() / Q.norm(), 1e-9);
  EXPECT_LT(relative_error(two.G(o, Eigen::all), M * C.transpose() / 5e-6), 1e-12);
}

TEST(LocalObserver, RefusesAGroupThatIsSeenInPart) {
  const Matrix A{{-1, 0, 0}, {0, -2, 1}, {0, 0, -3}}, C{{1, 0, 1}};
  EXPECT_EQ(complaint([&] { local_observer(AgentId{7}, A, state_groups(A), C, Matrix::Identity(3, 3), Matrix::Identity(1, 1)); }),
            "sensor network observer: agent 7: found that its C sees state group 2 (components 2, 3) only in part; allowed: a group is "
            "observable or its entries of C are zero (Assumption 8)");
}

TEST(AlphaBound, OfAScalarUnstableGroupIsTheAnalyticOne) {
  // M^-1 a 2 + Q - c^2 M^-2 / R = 0: with a = 1, Q = 3, c = R = 1, M^-1 = 3, so M Q M = 1 / 3.
  const Matrix A{{1.0}}, one = Matrix::Identity(1, 1);
  const StateGroups groups = state_groups(A);
  const LocalObserver observer = local_observer(AgentId{1}, A, groups, one, 3 * one, one);
  EXPECT_NEAR(observer.M_inverse(0, 0), 3.0, 1e-12);
  EXPECT_NEAR(observer.decay, 1.0 / 3.0, 1e-12);
  // alpha_max = balance (M Q M) / ((p - 1) 2 a) = .5 / 3 / (4 * 2)
  EXPECT_NEAR(inverse_alpha_bounds(observer, A, groups, 5, 0.5)[0], 48.0, 1e-10);
}

TEST(AlphaBound, IsNoneForTheDampedModesOfTheBeam) {
  const auto [network, observers] = beam::designed();
  for (const LocalObserver& observer : observers)
    EXPECT_TRUE(inverse_alpha_bounds(observer, network.A, state_groups(network.A), 6, 1.0).isZero(0.0));
}

using Groups = std::vector<std::vector<AgentId>>;

TEST(LeaderGroups, OfTheBeamAreItsSensors) {
  std::vector<Edge> edges = beam::edges();
  const auto ids = [](std::vector<std::uint32_t> values) {
    std::vector<AgentId> out;
    for (const std::uint32_t value : values) out.push_back(AgentId{value});
    return out;
  };
  EXPECT_EQ(leader_groups(Graph(6, edges)), (Groups{ids({1, 2, 3, 4})}));
  std::erase(edges, edge(4, 1));
  EXPECT_EQ(leader_groups(Graph(6, edges)), (Groups{ids({1, 2, 3})}));
  std::erase(edges, edge(3, 5));
  EXPECT_EQ(leader_groups(Graph(6, edges)), (Groups{ids({1, 2, 3}), ids({5})}));
}

TEST(LeaderGroups, AreOneThatIsEverybodyExactlyInStronglyConnectedGraphs) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"leader groups"});
    const std::size_t n = 1 + stream.below(8);
    const Graph graph = random_graph(stream, n, 0.3);
    const auto groups = leader_groups(graph);
    ASSERT_EQ(groups.size() == 1, has_spanning_tree(graph));
    ASSERT_EQ(groups.size() == 1 && groups[0].size() == n, strongly_connected(graph));
    if (groups.size() != 1) continue;
    const Vector w = left_null_vector(graph);
    for (std::size_t i = 0; i < n; ++i)
      ASSERT_EQ(w[static_cast<Eigen::Index>(i)] > 1e-12, std::count(groups[0].begin(), groups[0].end(), agent_at(i)) == 1);
  }
}

TEST(GammaBounds, OfARingAndAFollowerAreTheAnalyticOnes) {
  // Directed 3-ring: w = 1/3, W L + L'W = (2 I - cyclic neighbours) / 3, eigenvalue 1. lambda_max(A + A') = 2: bound (1/3) 2 / 1.
  // One follower: L~ + G~ = 1, theta = 1: bound 2 / 2.
  const Graph graph(4, std::vector<Edge>{edge(1, 2), edge(2, 3), edge(3, 1), edge(3, 4)});
  const GammaBounds bounds = gamma_bounds(Matrix{{1.0}}, graph, leader_groups(graph).at(0));
  EXPECT_NEAR(bounds.leaders, 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(bounds.followers, 1.0, 1e-12);
  EXPECT_NEAR(bounds.balance, 1.0, 1e-12);
  const GammaBounds damped = gamma_bounds(Matrix{{-1.0}}, graph, leader_groups(graph).at(0));
  EXPECT_EQ(damped.leaders, 0.0);
  EXPECT_EQ(damped.followers, 0.0);
}

TEST(SensorTuning, TakesAGammaAboveTheBoundOfEveryStronglyConnectedGraph) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"worst gamma"});
    const std::size_t n = 2 + stream.below(7);
    std::vector<WeightedEdge> edges = directed_ring(n).edges();
    for (const WeightedEdge& more : random_graph(stream, n, 0.2).edges()) edges.push_back({more.edge, 1.0});
    const Graph graph(n, edges);
    const Matrix A = random_matrix(stream, 3, 3);
    const GammaBounds bounds = gamma_bounds(A, graph, leader_groups(graph).at(0));
    Values given;
    given.set("balance", bounds.balance * 0.999);
    ASSERT_GT(sensor_tuning(AgentId{1}, given, A, 1, n).gamma, bounds.leaders);
  }
}

TEST(ConsensusStep, IsTheSeriesOfTheExponential) {
  const Matrix F{{2, .5, 0}, {.5, 1, .2}, {0, .2, 0.3}};
  const double d = 1.7, h = 0.3;
  const Matrix expected = (Matrix::Identity(3, 3) - matrix_exponential(-d * F, h)) / d;
  EXPECT_LT((consensus_step(F, d, h) - expected).norm(), 1e-14);
  EXPECT_LT((consensus_step(1e-12 * F, d, h) - 1e-12 * h * F).norm(), 1e-24) << "no cancellation for a weak gain";
}

TEST(DiscreteLyapunov, SolvesItsEquationAndRefusesAnUnstableStep) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"discrete lyapunov"});
    const Eigen::Index n = random_size(stream, 8);
    Matrix A = random_matrix(stream, n, n);
    A *= stream.uniform(0.05, 0.99) / spectral_radius(A);
    const Matrix Q = random_semidefinite(stream, n, n);
    const Matrix X = discrete_lyapunov(A, Q);
    ASSERT_LT((A * X * A.transpose() + Q - X).norm(), 1e-12 * X.norm());
  }
  EXPECT_EQ(complaint([] { discrete_lyapunov(Matrix{{1.5}}, Matrix{{1.0}}); }),
            "the network of observers has no stationary covariance: the spectral radius of a step is 1.5");
}

TEST(SensorNetwork, CovarianceOfTwoScalarObserversIsTheOneByHand) {
  // Agent 1 sees x' = -x + w, agent 2 hears 1: e1' = -(1 + g) e1 + g xi - w, e2' = -e2 + f (e1 - e2) - w.
  SensorNetwork network;
  network.A = Matrix{{-1.0}};
  network.Omega = Matrix{{2.0}};
  network.C = {Matrix{{1.0}}, Matrix(0, 1)};
  network.Xi = {Matrix{{0.5}}, Matrix(0, 0)};
  network.G = {Matrix{{3.0}}, Matrix(1, 0)};
  network.F = {Matrix{{7.0}}, Matrix{{5.0}}};
  network.graph = Graph(2, std::vector<Edge>{edge(1, 2)});
  const Matrix P = error_covariance(network);
  const double p11 = (2.0 + 9.0 * 0.5) / 8.0, p12 = (2.0 + 5.0 * p11) / 10.0, p22 = (2.0 + 10.0 * p12) / 12.0;
  EXPECT_NEAR(P(0, 0), p11, 1e-14);
  EXPECT_NEAR(P(0, 1), p12, 1e-14);
  EXPECT_NEAR(P(1, 1), p22, 1e-14);
}

TEST(SensorNetwork, SampledCovarianceApproachesTheContinuousOne) {
  const SensorNetwork network = beam::designed().network;
  const Matrix P = error_covariance(network);
  const double coarse = relative_error(sampled_error_covariance(network, 2e-5), P),
               fine = relative_error(sampled_error_covariance(network, 1e-5), P);
  EXPECT_LT(fine, 1e-3);
  EXPECT_NEAR(coarse / fine, 2.0, 0.2) << "first order in h";
}

TEST(SensorNetwork, IsRefusedACovarianceIfItIsNotStable) {
  SensorNetwork network = beam::designed().network;
  network.A(1, 1) = 10.0;
  for (Matrix& G : network.G) G.setZero();
  EXPECT_EQ(complaint([&] { error_covariance(network); }).substr(0, 68),
            "the network of observers has no stationary covariance: the largest r");
}

}  // namespace
}  // namespace consort
