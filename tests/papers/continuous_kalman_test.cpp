// Ren, Beard, Kingston, "Multi-agent Kalman consensus with relative uncertainty", ACC 2005: the continuous-time law (1)-(3).

#include "rounds/simulate.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/seeds_data.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace consort {
namespace {

using namespace seeds;

constexpr double kMatchingUnit = 0.1;  // s that one round of the dinner's matchings lasts

/// Equations (1)-(3) for all agents at once with plain numbers, nothing held: what continuous time really does.
struct DumbContinuousKalman {
  std::vector<double> x, P;
  bool self_term;

  DumbContinuousKalman slope(const Graph& graph) const {
    DumbContinuousKalman out{std::vector<double>(x.size()), std::vector<double>(x.size()), self_term};
    for (std::size_t i = 0; i < x.size(); ++i) {
      double certainty = 0.0, pull = 0.0;
      for (std::size_t j = 0; j < x.size(); ++j) {
        const bool hears = (i == j && self_term) || (i != j && graph.has({agent_at(j), agent_at(i)}));
        if (!hears) continue;
        certainty += 1.0 / (P[j] + dinner::kOmega);
        pull += (x[j] - x[i]) / (P[j] + dinner::kOmega);
      }
      out.P[i] = -P[i] * P[i] * certainty + dinner::kQ;
      out.x[i] = P[i] * pull;
    }
    return out;
  }
  DumbContinuousKalman plus(const DumbContinuousKalman& slope, double h) const {
    DumbContinuousKalman out = *this;
    for (std::size_t i = 0; i < x.size(); ++i) {
      out.x[i] += h * slope.x[i];
      out.P[i] += h * slope.P[i];
    }
    return out;
  }
  void step(const Graph& graph, double h) {
    const auto k1 = slope(graph), k2 = plus(k1, h / 2).slope(graph), k3 = plus(k2, h / 2).slope(graph), k4 = plus(k3, h).slope(graph);
    *this = plus(k1, h / 6).plus(k2, h / 3).plus(k3, h / 3).plus(k4, h / 6);
  }
};

struct Limit {
  double x, P, seconds;  // seconds until the spread stays below 1e-3, looked at whenever partners may change
};
Limit reference(bool leader, bool self_term) {
  constexpr int kSteps = 20;
  DumbContinuousKalman dumb{dinner::x(), dinner::P(leader), self_term};
  const Schedule schedule(dinner::kAgents, dinner::matchings(), {}, Seed{1});
  Limit limit{0, 0, 0};
  for (Round k = 0; k < dinner::kRounds; ++k) {
    for (int step = 0; step < kSteps; ++step) dumb.step(*schedule.at(k), kMatchingUnit / kSteps);
    if (spread(dumb.x) >= 1e-3) limit.seconds = kMatchingUnit * (k + 2);
  }
  return {mean(dumb.x), mean(dumb.P), limit.seconds};
}

/// The dinner in continuous time, with `rounds` rounds per unit of the matchings.
Experiment continuous_dinner(bool leader, bool self_term, Round rounds) {
  Experiment e = dinner::experiment(leader, self_term);
  FixedSchedule matchings = dinner::matchings();
  for (auto& interval : matchings.intervals) interval.rounds *= rounds;
  e.topology = matchings;
  e.protocols[0].name = "continuous_kalman_consensus";
  e.rounds = dinner::kRounds * rounds;
  e.report_every = e.rounds;
  e.dt = kMatchingUnit / rounds;
  return e;
}
double value_of(const Experiment& e) { return mean(finals(simulate(e, e.protocols[0], e.seed))); }

TEST(ContinuousKalmanFixture, IsTheOneStated) {
  const Limit limit = reference(false, false);
  EXPECT_NEAR(limit.x, 5.926430, 1e-6);
  EXPECT_NEAR(limit.P, 0.161803, 1e-6);
  EXPECT_NEAR(limit.seconds, 12.6, 1e-9);
}

TEST(ContinuousKalmanConsensus, ApproachesTheContinuousLawAsTheRoundsShorten) {
  for (const bool leader : {false, true}) {
    for (const bool self_term : {false, true}) {
      SCOPED_TRACE(testing::Message() << "leader " << leader << ", self term " << self_term);
      const double exact = reference(leader, self_term).x;
      const double coarse = std::abs(value_of(continuous_dinner(leader, self_term, 10)) - exact);
      const double fine = std::abs(value_of(continuous_dinner(leader, self_term, 100)) - exact);
      EXPECT_LT(coarse, 5e-3);
      EXPECT_LT(fine, 5e-4);
      EXPECT_NEAR(coarse / fine, 10.0, 2.0) << "holding what is heard is an error of first order";
    }
  }
}

TEST(ContinuousKalmanConsensus, EulerGivesTheStatedErrorsWithALeader) {
  const double exact = reference(true, true).x;
  EXPECT_NEAR(exact, 6.2080, 1e-4);
  const auto euler = [](Round rounds) {
    Experiment e = continuous_dinner(true, true, rounds);
    e.protocols[0].parameters.set("method", 1.0);
    return value_of(e);
  };
  EXPECT_NEAR(euler(1), 6.2844, 1e-4);
  EXPECT_NEAR(euler(10), 6.2106, 1e-4);
}

TEST(ContinuousKalmanConsensus, CovarianceTendsToTheRootsStated) {
  // One partner who is alike, P_i = P_j = P: P^2 = Q (P + Omega), or with the self term 2 P^2 = Q (P + Omega).
  for (const bool self_term : {false, true}) {
    Values initial, parameters;
    initial.set("x", 1.0);
    initial.set("P", 1.0);
    parameters.set("Q", 0.1);
    parameters.set("Omega", 0.1);
    parameters.set("self_term", self_term ? 1.0 : 0.0);
    const auto agent = find_protocol("continuous_kalman_consensus").make(parameters, consort::Setup{AgentId{1}, 2, 0.1, initial});
    const Sense sense{.k = 0, .dt = 0.1, .in_neighbours = {}, .out_degree = 1, .y = {}, .self = AgentId{1}};
    std::vector<double> own(agent->message_layout().size());
    for (int k = 0; k < 1000; ++k) {
      agent->emit(sense, own);
      agent->absorb(sense, std::array{Received{AgentId{2}, 0, 1.0, own}});
    }
    EXPECT_NEAR(own[1], self_term ? 0.1 : 0.161803, 1e-6);
    EXPECT_NEAR(reference(false, self_term).P, own[1], 1e-6);
  }
}

TEST(ContinuousKalmanConsensus, VectorsWithADiagonalCovarianceAreScalarsSideBySide) {
  Experiment e = continuous_dinner(true, true, 2), both = e;
  both.initial.clear();
  PerAgent::List x, P;
  const auto xs = dinner::x(), Ps = dinner::P(true);
  for (std::size_t i = 0; i < xs.size(); ++i) {
    x.values.push_back((Matrix(2, 1) << xs[i], -xs[i]).finished());
    P.values.push_back(Matrix::Constant(2, 1, Ps[i]));
  }
  both.initial = {{"x", {x}}, {"P", {P}}};
  const auto scalar = finals(simulate(e, e.protocols[0], e.seed)), vector = finals(simulate(both, both.protocols[0], both.seed));
  for (std::size_t i = 0; i < xs.size(); ++i) {
    EXPECT_NEAR(vector[2 * i], scalar[i], 1e-12);
    EXPECT_NEAR(vector[2 * i + 1], -scalar[i], 1e-12);
  }
}

TEST(ContinuousKalmanConsensus, FullCovariancesTurnWithTheCoordinates) {
  // P = T diag(p) T', x = T z in turned coordinates must end at T times what the straight ones end at.
  const double angle = 0.7;
  Matrix T(2, 2);
  T << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  Experiment straight = continuous_dinner(false, true, 2), turned = straight;
  PerAgent::List x, P, tx, tP;
  for (std::size_t i = 0; i < straight.agents; ++i) {
    const double s = static_cast<double>(i);
    const Matrix xi = (Matrix(2, 1) << 5 + s, 3 - 2 * s).finished(),
                 Pi = Vector((Vector(2) << 0.5 + 0.1 * s, 2 - 0.1 * s).finished()).asDiagonal();
    x.values.push_back(xi);
    P.values.push_back(Pi);
    tx.values.push_back(T * xi);
    tP.values.push_back(T * Pi * T.transpose());
  }
  straight.initial = {{"x", {x}}, {"P", {P}}};
  turned.initial = {{"x", {tx}}, {"P", {tP}}};
  const Trace a = simulate(straight, straight.protocols[0], straight.seed), b = simulate(turned, turned.protocols[0], turned.seed);
  for (std::size_t i = 0; i < straight.agents; ++i) {
    const auto xa = a.final_estimate(agent_at(i)), xb = b.final_estimate(agent_at(i));
    const Vector expected = T * Eigen::Map<const Vector>(xa.data(), 2);
    EXPECT_NEAR(xb[0], expected[0], 1e-10);
    EXPECT_NEAR(xb[1], expected[1], 1e-10);
  }
}

TEST(ContinuousKalmanConsensus, WithoutAnyMessageTheEstimateStaysAndTheCovarianceGrowsAtQ) {
  const auto protocol = [] {
    static Values initial, parameters;
    initial.set("x", 3.0);
    initial.set("P", 0.5);
    parameters.set("Q", 0.1);
    return find_protocol("continuous_kalman_consensus").make(parameters, consort::Setup{AgentId{1}, 2, 0.1, initial});
  }();
  const Neighbour neighbour{AgentId{2}, 1.0};
  const Sense sense{.k = 0, .dt = 0.1, .in_neighbours = {&neighbour, 1}, .out_degree = 1, .y = {}, .self = AgentId{1}};
  for (int k = 0; k < 20; ++k) protocol->absorb(sense, {});  // every message is lost
  std::vector<double> payload(protocol->message_layout().size());
  protocol->emit(sense, payload);
  EXPECT_EQ(payload[0], 3.0);
  EXPECT_NEAR(payload[1], 0.5 + 0.1 * 2.0, 1e-14);
}

TEST(ContinuousKalmanConsensus, RefusesAStepThatBreaksTheCovariance) {
  Experiment e = continuous_dinner(true, false, 1);
  e.dt = 50.0;
  e.protocols[0].parameters.set("method", 1.0);
  EXPECT_THROW(static_cast<void>(simulate(e, e.protocols[0], e.seed)), RunError);
  e.protocols[0].parameters.set("method", 0.0);
  e.protocols[0].parameters.set("steps", 2000.0);  // they mend it: everybody goes to what it hears, and never beyond
  for (const double x : finals(simulate(e, e.protocols[0], e.seed))) {
    EXPECT_GE(x, 5.0);
    EXPECT_LE(x, 7.0);
  }
}

TEST(ContinuousKalmanConsensus, RefusesValuesThatMakeNoSense) {
  for (const auto& [name, value] :
       std::vector<std::pair<const char*, double>>{{"steps", 0.0}, {"steps", 1.5}, {"method", 2.0}, {"self_term", 0.5}}) {
    Experiment e = continuous_dinner(false, false, 1);
    e.protocols[0].parameters.set(name, value);
    EXPECT_THROW(static_cast<void>(simulate(e, e.protocols[0], e.seed)), ConfigError) << name;
  }
}

}  // namespace
}  // namespace consort
