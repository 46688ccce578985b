/// Covariances fall, or information runs out, for ever: estimates stay what the recursion gives with numbers of unlimited range.

#include "protocols/consensus/continuous_kalman_consensus.hpp"
#include "protocols/consensus/kalman_consensus.hpp"
#include "protocols/consensus/robust_information_consensus.hpp"
#include "protocols/consensus/unbiased_information_consensus.hpp"
#include "protocols/consensus/unbiased_kalman_consensus.hpp"

#include "tests/support/direct.hpp"
#include "tests/support/sanitized.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace consort {
namespace {

#ifdef CONSORT_SANITIZED
constexpr Round kLongRun = 50'000;
#else
constexpr Round kLongRun = 1'000'000;
#endif

/// A long double with an exponent of 64 bits.
struct Wide {
  long double m = 0;
  long e = 0;

  Wide() = default;
  Wide(long double value, long exponent = 0) {
    int shift = 0;
    m = std::frexp(value, &shift);
    e = m == 0.0L ? 0 : exponent + shift;
  }
  friend Wide operator*(Wide a, Wide b) { return {a.m * b.m, a.e + b.e}; }
  friend Wide operator/(Wide a, Wide b) { return {a.m / b.m, a.e - b.e}; }
  friend Wide operator+(Wide a, Wide b) {
    if (a.m == 0.0L) return b;
    if (b.m == 0.0L) return a;
    if (a.e < b.e) std::swap(a, b);
    return {a.m + std::ldexp(b.m, static_cast<int>(std::max(b.e - a.e, -200L))), a.e};
  }
  friend Wide operator-(Wide a, Wide b) { return a + Wide{-b.m, b.e}; }
  [[nodiscard]] long double value() const { return std::ldexp(m, static_cast<int>(std::clamp(e, -20'000L, 20'000L))); }
};
struct WideState {
  Wide x, P;
};
using Law = std::function<WideState(const WideState& own, const std::vector<std::pair<WideState, double>>& heard)>;  // with mu_j

/// (4)-(5) of Ren et al., with mu_j before P_j if `unbiased` (Alighanbari, How).
Law discrete(double Q, double Omega, bool unbiased) {
  return [=](const WideState& own, const auto& heard) {
    Wide information = Wide(1) / (own.P + Wide(Q)), innovation;
    for (const auto& [j, mu] : heard) {
      const Wide certainty = Wide(1) / (Wide(unbiased ? mu : 1.0) * j.P + Wide(Omega));
      information = information + certainty;
      innovation = innovation + certainty * (j.x - own.x);
    }
    const Wide P = Wide(1) / information;
    return WideState{own.x + P * innovation, P};
  };
}

/// (1)-(3) of Ren et al. with Q = Omega = 0, one step of Euler's method of h seconds.
Law continuous(double h) {
  return [=](const WideState& own, const auto& heard) {
    WideState slope;
    for (const auto& [j, mu] : heard) {
      slope.P = slope.P - own.P * own.P / j.P;
      slope.x = slope.x + own.P / j.P * (j.x - own.x);
    }
    return WideState{own.x + Wide(h) * slope.x, own.P + Wide(h) * slope.P};
  };
}

class Reference {
 public:
  Reference(const std::vector<double>& x, const std::vector<double>& P) {
    for (std::size_t i = 0; i < x.size(); ++i) agents_.push_back({Wide(x[i]), Wide(P[i])});
  }
  void advance(const Graph& graph, const std::vector<Law>& laws) {
    std::vector<WideState> next;
    for (std::size_t i = 0; i < agents_.size(); ++i) {
      std::vector<std::pair<WideState, double>> heard;
      for (const Neighbour& j : graph.in_neighbours(agent_at(i)))
        heard.emplace_back(agents_[index_of(j.id)], static_cast<double>(graph.out_degree(j.id)));
      next.push_back(laws[i % laws.size()](agents_[i], heard));
    }
    agents_ = next;
  }
  [[nodiscard]] double x(std::size_t i) const { return static_cast<double>(agents_[i].x.value()); }
  [[nodiscard]] const Wide& P(std::size_t i) const { return agents_[i].P; }

 private:
  std::vector<WideState> agents_;
};

/// A protocol on a fixed graph, quickly: nothing is made anew from round to round.
template <class P>
class Agents {
 public:
  Agents(Graph graph, typename P::Params params, const std::vector<double>& x, const std::vector<double>& covariance, Seconds dt = 1.0)
      : graph_(std::move(graph)), params_(std::move(params)), dt_(dt), states(direct::states<P>(params_, x, covariance)) {
    for (std::size_t i = 0; i < x.size(); ++i) {
      inboxes_.emplace_back();
      for (const Neighbour& j : graph_.in_neighbours(agent_at(i))) inboxes_.back().push_back({j.id, 0, j.weight, {}});
    }
  }
  void advance() {
    const auto sense = [&](std::size_t i) {
      return Sense{k_, dt_, graph_.in_neighbours(agent_at(i)), graph_.out_degree(agent_at(i)), {}, agent_at(i)};
    };
    for (std::size_t i = 0; i < states.size(); ++i)
      for (auto& heard : inboxes_[i]) {
        heard.sent = k_;
        heard.message = P::message(params_, states[index_of(heard.from)], sense(index_of(heard.from)));
      }
    for (std::size_t i = 0; i < states.size(); ++i) {
      if constexpr (MovesItsState<P>)
        P::transition(params_, states[i], sense(i), inboxes_[i]);
      else
        states[i] = P::transition(params_, states[i], sense(i), inboxes_[i]);
    }
    ++k_;
  }

 private:
  Graph graph_;
  typename P::Params params_;
  Seconds dt_;
  Round k_ = 0;
  std::vector<std::vector<Heard<typename P::Message>>> inboxes_;

 public:
  std::vector<typename P::State> states;
};

using Scalar = Eigen::Matrix<double, 1, 1>;
const Scalar kNone(0.0);
const std::vector<double> kX{3.0, -1.0, 7.0}, kP{1.0, 0.25, 4.0};

double error_of(double x, double right) { return std::abs(x - right) / std::abs(right); }

template <class P>
double largest_error(const Agents<P>& agents, const Reference& reference) {
  double largest = 0.0;
  for (std::size_t i = 0; i < agents.states.size(); ++i)
    largest = std::max(largest, error_of(P::estimate(agents.states[i])[0], reference.x(i)));
  return largest;
}

/// Rounds in which everybody is compared; by the last of them they agree, and go on to agree.
template <class P>
void expect_right_for_ever(Agents<P> agents, const Law& law) {
  constexpr Round kCompared = 5'000;
  Reference reference(kX, kP);
  for (Round k = 0; k < kCompared; ++k) {
    agents.advance();
    reference.advance(ring(3), {law});
    ASSERT_LT(largest_error(agents, reference), 1e-12) << P::name << ", round " << k;
  }
  for (Round k = kCompared; k < kLongRun; ++k) agents.advance();
  EXPECT_LT(largest_error(agents, reference), 1e-12) << P::name;
}

TEST(FarCovariances, KalmanConsensusGoesOnAfterItHasConverged) {
  using P = KalmanConsensus<1>;
  expect_right_for_ever(Agents<P>(ring(3), {kNone, kNone, false}, kX, kP), discrete(0.0, 0.0, false));
}

TEST(FarCovariances, UnbiasedKalmanConsensusGoesOnAfterItHasConverged) {
  using P = UnbiasedKalmanConsensus<1>;
  expect_right_for_ever(Agents<P>(ring(3), {kNone, kNone}, kX, kP), discrete(0.0, 0.0, true));
}

TEST(FarCovariances, ContinuousKalmanConsensusGoesOnAfterItHasConverged) {
  using P = ContinuousKalmanConsensus<1>;
  expect_right_for_ever(Agents<P>(ring(3), {kNone, kNone, false, true, 1}, kX, kP, 0.02), continuous(0.02));
}

template <class P>
void expect_centralised_for_ever(const Graph& graph) {
  Agents<P> agents(graph, {}, kX, kP);
  Reference reference(kX, kP);
  for (Round k = 0; k < 1'000; ++k) reference.advance(graph, {discrete(0.0, 0.0, true)});
  for (Round k = 0; k < kLongRun; ++k) {
    agents.advance();
    if (k % 1'000 == 999) {
      ASSERT_LT(largest_error(agents, reference), 1e-12) << P::name << ", round " << k;
    }
  }
}

TEST(FarCovariances, InformationConsensusDoesNotDrift) {
  const Graph unbalanced(3, std::array{Edge{AgentId{1}, AgentId{2}}, Edge{AgentId{2}, AgentId{3}}, Edge{AgentId{3}, AgentId{1}},
                                       Edge{AgentId{3}, AgentId{2}}});
  for (const Graph& graph : {ring(3), unbalanced}) {
    expect_centralised_for_ever<UnbiasedInformationConsensus<1>>(graph);
    expect_centralised_for_ever<RobustInformationConsensus<1>>(graph);
  }
}

template <class P>
void expect_standing_alone(const typename P::Params& params) {
  Agents<P> agents(Graph(3, std::span<const Edge>{}), params, kX, kP);
  for (Round k = 0; k < kLongRun; ++k) agents.advance();
  for (std::size_t i = 0; i < kX.size(); ++i) EXPECT_LT(error_of(P::estimate(agents.states[i])[0], kX[i]), 1e-12) << P::name;
}

TEST(FarCovariances, WhoHearsNobodyKeepsItsEstimateForEver) {
  expect_standing_alone<KalmanConsensus<1>>({kNone, kNone, false});
  expect_standing_alone<UnbiasedKalmanConsensus<1>>({kNone, kNone});
  expect_standing_alone<ContinuousKalmanConsensus<1>>({kNone, kNone, false, false, 1});
  expect_standing_alone<UnbiasedInformationConsensus<1>>({});  // its information halves in every round
  expect_standing_alone<RobustInformationConsensus<1>>({});
}

TEST(FarCovariances, AgentsOfDifferentDepthWeighEachOtherRightly) {
  // Behind a leader a chain whose pairs get surer at different rates: 1 -> 2 <-> 3 -> 4 <-> 5, 4 <-> 6, 5 <-> 6, 3 -> 7.
  const std::vector<Edge> edges = [] {
    std::vector<Edge> out;
    for (const auto& [from, to] :
         {std::pair{1U, 2U}, {2U, 3U}, {3U, 2U}, {3U, 4U}, {4U, 5U}, {5U, 4U}, {4U, 6U}, {6U, 4U}, {5U, 6U}, {6U, 5U}, {3U, 7U}, {6U, 7U}})
      out.push_back({AgentId{from}, AgentId{to}});
    return out;
  }();
  const Graph graph(7, std::span<const Edge>(edges));
  const std::vector<double> x{3.0, -1.0, 7.0, 20.0, -30.0, 5.0, 100.0}, P{1e-30, 0.25, 4.0, 1e-9, 1e9, 2.0, 1e-250};
  using Kalman = KalmanConsensus<1>;
  for (const bool self_term : {false, true}) {
    Agents<Kalman> agents(graph, {kNone, kNone, self_term}, x, P);
    Reference reference(x, P);
    const Law law = [&](const WideState& own, const auto& heard) {
      auto all = heard;
      if (self_term) all.emplace_back(own, 1.0);
      return discrete(0.0, 0.0, false)(own, all);
    };
    for (Round k = 0; k < 4'000; ++k) {
      agents.advance();
      reference.advance(graph, {law});
      ASSERT_LT(largest_error(agents, reference), 1e-12) << "round " << k;
    }
    EXPECT_LT(reference.P(6).e, -1'100);
    if (!self_term) {
      EXPECT_GT(reference.P(0).e, -110) << "the leader learns nothing";
    }
  }
}

TEST(FarCovariances, ProcessNoiseCountsAgainWhereItIsNotNothing) {
  // Two agents shrink each other's covariance; then they hear nobody, and process noise is all there is.
  const Scalar Q(0.1);
  const Graph apart(3, std::span<const Edge>{});
  Agents<KalmanConsensus<1>> agents(ring(3), {Q, kNone, false}, kX, kP);
  Reference reference(kX, kP);
  for (Round k = 0; k < 3'000; ++k) {
    agents.advance();
    reference.advance(ring(3), {discrete(0.1, 0.0, false)});
  }
  EXPECT_LT(reference.P(0).e, -1'100) << "with two in-neighbours P falls whatever Q";
  EXPECT_LT(largest_error(agents, reference), 1e-12);
  auto alone = direct::advance<KalmanConsensus<1>>({Q, kNone, false}, agents.states, apart);
  for (const auto& state : alone) EXPECT_DOUBLE_EQ(covariance_of(state)(0, 0), 0.1);
  alone = direct::advance<KalmanConsensus<1>>({Q, kNone, false}, alone, apart);
  for (const auto& state : alone) EXPECT_DOUBLE_EQ(covariance_of(state)(0, 0), 0.2);
}

TEST(FarCovariances, ComponentsThatFallAtDifferentRatesAreScalarsSideBySide) {
  // Noise in the process of one component, in the communication of another: they part by hundreds of orders of magnitude.
  using P = KalmanConsensus<3>;
  const Eigen::Vector3d Q(0.1, 0.0, 0.0), Omega(0.0, 0.2, 0.0);
  const P::Params params{Q.asDiagonal(), Omega.asDiagonal(), false};
  std::vector<P::State> vectors;
  std::vector<std::vector<KalmanConsensus<1>::State>> scalars(3);
  for (std::size_t i = 0; i < 3; ++i) {
    Values initial;
    initial.set("x", Eigen::Vector3d(kX[i], kX[i] + 1.0, 2.0 - kX[i]));
    initial.set("P", kP[i]);
    vectors.push_back(P::init(params, consort::Setup{agent_at(i), 3, 1.0, initial}));
  }
  for (Eigen::Index c = 0; c < 3; ++c) {
    std::vector<double> x;
    for (const auto& state : vectors) x.push_back(state.x[c]);
    scalars[static_cast<std::size_t>(c)] = direct::states<KalmanConsensus<1>>({}, x, kP);
  }
  for (Round k = 0; k < 8'000; ++k) {
    vectors = direct::advance<P>(params, vectors, ring(3));
    for (Eigen::Index c = 0; c < 3; ++c) {
      auto& side = scalars[static_cast<std::size_t>(c)];
      side = direct::advance<KalmanConsensus<1>>({Scalar(Q[c]), Scalar(Omega[c]), false}, side, ring(3));
      for (std::size_t i = 0; i < 3; ++i) ASSERT_LT(error_of(vectors[i].x[c], side[i].x[0]), 1e-12) << "round " << k << ", component " << c;
    }
  }
  EXPECT_LT(vectors[0].e[2], 1.2 * vectors[0].e[0] - 1'000);
  EXPECT_EQ(vectors[0].e[1], 0.0);
}

TEST(FarCovariances, FullCovariancesKeepTheirEstimate) {
  Seed seed{5};
  Stream stream = seed.stream(Purpose("far covariances"), 0, 0);
  using P = UnbiasedKalmanConsensus<3>;
  const P::Params params{Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};
  std::vector<P::State> states;
  Matrix information = Matrix::Zero(3, 3);
  Vector weighted = Vector::Zero(3);
  for (std::size_t i = 0; i < 4; ++i) {
    const Matrix covariance = direct::random_spd(stream, 3);
    Values initial;
    initial.set("x", direct::random_vector(stream, 3));
    initial.set("P", covariance);
    states.push_back(P::init(params, consort::Setup{agent_at(i), 4, 1.0, initial}));
    information += covariance.inverse();
    weighted += covariance.inverse() * initial.vector("x");
  }
  const Vector right = information.inverse() * weighted;
  for (Round k = 0; k < 4'000; ++k) states = direct::advance<P>(params, states, directed_ring(4));
  for (const auto& state : states) EXPECT_LT((state.x - right).norm(), 1e-12 * right.norm());
}

TEST(FarCovariances, InformationThatLinksLoseIsAnAverageForEver) {
  // Agent 1 hears nobody for a while and loses nearly all it knows; then it hears the others again.
  using P = UnbiasedInformationConsensus<1>;
  Agents<P> apart(Graph(3, std::array{Edge{AgentId{1}, AgentId{2}}, Edge{AgentId{2}, AgentId{3}}, Edge{AgentId{3}, AgentId{2}}}), {}, kX,
                  kP);
  for (Round k = 0; k < 3'000; ++k) apart.advance();
  EXPECT_LT(apart.states[0].e, -2'900);
  EXPECT_LT(error_of(apart.states[0].x[0], kX[0]), 1e-12);
  const double others = apart.states[1].x[0];
  auto states = apart.states;
  for (Round k = 0; k < 100; ++k) states = direct::advance<P>({}, states, ring(3));
  for (const auto& state : states) EXPECT_LT(error_of(state.x[0], others), 1e-12);
}

}  // namespace
}  // namespace consort
