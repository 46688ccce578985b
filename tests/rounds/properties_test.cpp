// What must hold whatever the graph, the numbers and the dimension: 200 seeds each.

#include "core/math/decompositions.hpp"
#include "protocols/consensus/kalman_consensus.hpp"
#include "protocols/consensus/local_voting.hpp"
#include "protocols/consensus/unbiased_information_consensus.hpp"
#include "protocols/consensus/unbiased_kalman_consensus.hpp"
#include "rounds/simulate.hpp"
#include "tests/support/direct.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/seeds_data.hpp"

#include <gtest/gtest.h>

#include <numeric>

namespace consort {
namespace {

constexpr std::uint64_t kSeeds = 200;
constexpr int kDynamic = Eigen::Dynamic;

/// A random experiment: 2..8 agents, dimension 1..5, dense covariances, a random strongly connected digraph.
struct Case {
  explicit Case(std::uint64_t seed) : stream(Seed{seed}.stream(Purpose("property"))) {
    agents = 2 + stream.below(7);
    dimension = 1 + static_cast<Eigen::Index>(stream.below(5));
    graph = std::make_shared<const Graph>(direct::random_strong_graph(stream, agents));
    for (std::size_t i = 0; i < agents; ++i) {
      x.push_back(direct::random_vector(stream, dimension));
      P.push_back(direct::random_spd(stream, dimension));
    }
  }

  [[nodiscard]] Experiment experiment(const std::string& protocol, Round rounds) const {
    Experiment e;
    e.mode = Mode::simulate;
    e.agents = agents;
    e.rounds = rounds;
    e.report_every = 1;
    e.dt = 0.1;
    e.protocols = {{protocol, {}}};
    PerAgent::List states, covariances;
    for (const Vector& value : x) states.values.push_back(value);
    covariances.values = P;
    e.initial = {{"x", {states}}, {"P", {covariances}}};
    e.topology = seeds::always(graph);
    return e;
  }

  template <class Spec>
  [[nodiscard]] std::vector<typename Spec::State> states(const typename Spec::Params& params) const {
    std::vector<typename Spec::State> result;
    for (std::size_t i = 0; i < agents; ++i) {
      Values initial;
      initial.set("x", x[i]);
      initial.set("P", P[i]);
      result.push_back(Spec::init(params, Setup{agent_at(i), agents, 0.1, initial}));
    }
    return result;
  }

  Stream stream;
  std::size_t agents;
  Eigen::Index dimension;
  std::shared_ptr<const Graph> graph;
  std::vector<Vector> x;
  std::vector<Matrix> P;
};

double largest(const Matrix& m) { return m.cwiseAbs().maxCoeff(); }
double smallest_eigenvalue(const Matrix& m) { return symmetric_eigenvalues(m)[0]; }

TEST(UnbiasedInformationConsensus, KeepsTheSumsOfInformationAndOfWeightedEstimates) {
  using Spec = UnbiasedInformationConsensus<kDynamic>;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Case c(seed);
    auto states = c.states<Spec>({});
    const auto total = [&] {
      std::pair<Matrix, Vector> sums{Matrix::Zero(c.dimension, c.dimension), Vector::Zero(c.dimension)};
      for (const auto& s : states) {
        sums.first += s.Y;
        sums.second += s.Y * s.x;
      }
      return sums;
    };
    const auto [Y, y] = total();
    for (Round k = 0; k < 100; ++k) {
      states = direct::advance<Spec>({}, states, direct::random_strong_graph(c.stream, c.agents), {.k = k});
      const auto [Y_now, y_now] = total();
      ASSERT_LT(largest(Y_now - Y), 1e-11 * largest(Y)) << "round " << k;
      ASSERT_LT(largest(y_now - y), 1e-10 * largest(Y) * 10.0) << "round " << k;
    }
  }
}

TEST(UnbiasedConsensus, ReachesTheCentralisedEstimateWithFullCovariancesOnGraphsThatChange) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Case c(seed);
    FixedSchedule schedule{{}, true};
    for (int g = 0; g < 3; ++g)
      schedule.intervals.push_back({std::make_shared<const Graph>(direct::random_strong_graph(c.stream, c.agents)), 1});
    Matrix information = Matrix::Zero(c.dimension, c.dimension);
    Vector weighted = Vector::Zero(c.dimension);
    for (std::size_t i = 0; i < c.agents; ++i) {
      information += inverse(c.P[i], "P_i");
      weighted += inverse(c.P[i], "P_i") * c.x[i];
    }
    const Vector expected = inverse(information, "information") * weighted;
    for (const char* protocol : {"unbiased_kalman_consensus", "unbiased_information_consensus"}) {
      Experiment e = c.experiment(protocol, 600);
      e.topology = schedule;
      const Trace trace = simulate(e, e.protocols[0], e.seed);
      for (std::size_t i = 0; i < c.agents; ++i) {
        const auto x = trace.final_estimate(agent_at(i));
        for (std::size_t component = 0; component < x.size(); ++component)
          ASSERT_NEAR(x[component], expected[static_cast<Eigen::Index>(component)], 1e-9) << protocol;
      }
    }
  }
}

template <class Spec>
void expect_covariances_stay_positive(const typename Spec::Params& params, const Case& c, Round rounds) {
  auto states = c.states<Spec>(params);
  for (Round k = 0; k < rounds; ++k) states = direct::advance<Spec>(params, states, *c.graph, {.k = k});
  for (const auto& s : states) {
    EXPECT_EQ(s.P, s.P.transpose());
    EXPECT_GT(smallest_eigenvalue(s.P), 0.0);
    EXPECT_TRUE(s.x.allFinite());
  }
}

TEST(KalmanConsensus, CovariancesStaySymmetricAndPositiveDefinite) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Case c(seed);
    const Matrix Q = 0.1 * direct::random_spd(c.stream, c.dimension), Omega = 0.1 * direct::random_spd(c.stream, c.dimension);
    expect_covariances_stay_positive<KalmanConsensus<kDynamic>>({Q, Omega, seed % 2 == 0}, c, 200);
    expect_covariances_stay_positive<UnbiasedKalmanConsensus<kDynamic>>({Q, Omega}, c, 200);
  }
}

TEST(KalmanConsensus, CovariancesSurviveFiveThousandRounds) {
  const Case c(7);
  const Matrix I = Matrix::Identity(c.dimension, c.dimension), zero = 0.0 * I;
  expect_covariances_stay_positive<KalmanConsensus<kDynamic>>({0.1 * I, 0.1 * I, false}, c, 5000);
  expect_covariances_stay_positive<KalmanConsensus<kDynamic>>({zero, 0.1 * I, false}, c, 5000);
  expect_covariances_stay_positive<KalmanConsensus<kDynamic>>({1e-9 * I, 1e-6 * I, false}, c, 5000);
  expect_covariances_stay_positive<UnbiasedKalmanConsensus<kDynamic>>({zero, 0.1 * I}, c, 5000);
}

TEST(KalmanConsensus, OnTheCompleteGraphOneRoundIsTheCentralisedFilter) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Case c(seed);
    c.graph = std::make_shared<const Graph>(complete(c.agents));
    Matrix information = Matrix::Zero(c.dimension, c.dimension);
    Vector weighted = Vector::Zero(c.dimension);
    for (std::size_t i = 0; i < c.agents; ++i) {
      information += inverse(c.P[i], "P_i");
      weighted += inverse(c.P[i], "P_i") * c.x[i];
    }
    using Spec = KalmanConsensus<kDynamic>;
    const Matrix zero = Matrix::Zero(c.dimension, c.dimension);
    const Spec::Params params{zero, zero, false};
    for (const auto& s : direct::advance<Spec>(params, c.states<Spec>(params), *c.graph)) {
      EXPECT_LT(largest(s.P - inverse(information, "information")), 1e-12);
      EXPECT_LT(largest(s.x - inverse(information, "information") * weighted), 1e-10);
    }
  }
}

TEST(LocalVoting, StaysInTheConvexHullAndReachesTheLeftNullVectorsMean) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Case c(seed);
    const Experiment e = c.experiment("local_voting", 1500);  // dt 0.1, in-degree at most 7
    const Trace trace = simulate(e, e.protocols[0], e.seed);
    const Vector w = left_null_vector(*c.graph);
    for (Eigen::Index component = 0; component < c.dimension; ++component) {
      double low = c.x[0][component], high = low, expected = 0.0;
      for (std::size_t i = 0; i < c.agents; ++i) {
        low = std::min(low, c.x[i][component]);
        high = std::max(high, c.x[i][component]);
        expected += w[static_cast<Eigen::Index>(i)] * c.x[i][component];
      }
      for (std::size_t report = 0; report < trace.rounds.size(); report += 10)
        for (std::size_t i = 0; i < c.agents; ++i) {
          const double value = trace.at(report, agent_at(i))[static_cast<std::size_t>(component)];
          ASSERT_GE(value, low - 1e-12);
          ASSERT_LE(value, high + 1e-12);
        }
      for (std::size_t i = 0; i < c.agents; ++i)
        EXPECT_NEAR(trace.final_estimate(agent_at(i))[static_cast<std::size_t>(component)], expected, 1e-9);
    }
  }
}

TEST(LocalVoting, MatchesTheMatrixPowerOfTheLaplacian) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Case c(seed);
    std::vector<WeightedEdge> edges = c.graph->edges();
    for (WeightedEdge& edge : edges) edge.weight = c.stream.uniform(0.1, 1.0);
    c.graph = std::make_shared<const Graph>(c.agents, std::span<const WeightedEdge>(edges));
    const Experiment e = c.experiment("local_voting", 30);
    const Trace trace = simulate(e, e.protocols[0], e.seed);
    Matrix x(static_cast<Eigen::Index>(c.agents), c.dimension);
    for (std::size_t i = 0; i < c.agents; ++i) x.row(static_cast<Eigen::Index>(i)) = c.x[i];
    for (int k = 0; k < 30; ++k) x -= e.dt * laplacian(*c.graph) * x;
    for (std::size_t i = 0; i < c.agents; ++i)
      for (Eigen::Index component = 0; component < c.dimension; ++component)
        ASSERT_NEAR(trace.final_estimate(agent_at(i))[static_cast<std::size_t>(component)], x(static_cast<Eigen::Index>(i), component),
                    1e-12);
  }
}

TEST(Protocols, RelabellingTheAgentsChangesNothingUpToRounding) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Case c(seed);
    std::vector<std::size_t> to(c.agents);  // agent at index i becomes the agent at index to[i]
    std::iota(to.begin(), to.end(), std::size_t{0});
    for (std::size_t k = c.agents - 1; k >= 1; --k) std::swap(to[k], to[c.stream.below(k + 1)]);
    Case relabelled = c;
    std::vector<WeightedEdge> edges = c.graph->edges();
    for (WeightedEdge& e : edges) e.edge = {agent_at(to[index_of(e.edge.from)]), agent_at(to[index_of(e.edge.to)])};
    relabelled.graph = std::make_shared<const Graph>(c.agents, std::span<const WeightedEdge>(edges));
    for (std::size_t i = 0; i < c.agents; ++i) {
      relabelled.x[to[i]] = c.x[i];
      relabelled.P[to[i]] = c.P[i];
    }
    for (const char* protocol : {"local_voting", "kalman_consensus", "unbiased_kalman_consensus", "unbiased_information_consensus"}) {
      const Experiment a = c.experiment(protocol, 50), b = relabelled.experiment(protocol, 50);
      const Trace one = simulate(a, a.protocols[0], a.seed), other = simulate(b, b.protocols[0], b.seed);
      for (std::size_t report = 0; report < one.rounds.size(); ++report)
        for (std::size_t i = 0; i < c.agents; ++i)
          for (std::size_t component = 0; component < one.dimension; ++component)
            ASSERT_NEAR(one.at(report, agent_at(i))[component], other.at(report, agent_at(to[i]))[component], 1e-9) << protocol;
    }
  }
}

}  // namespace
}  // namespace consort
