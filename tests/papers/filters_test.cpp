// Knotek, thesis, section 3.1: the estimators of the literature in whole runs, with noise.

#include "protocols/filters/estimator_network.hpp"
#include "protocols/metrics.hpp"
#include "rounds/simulate.hpp"
#include "tests/support/experiments.hpp"
#include "tests/support/oscillator.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace consort {
namespace {

/// The oscillator of the shipped experiments, with noises of the intensities the filters are told (or none).
Experiment oscillator_run(const std::string& protocol, const Graph& graph, bool noisy, Seconds dt = 0.01, double seconds = 100) {
  Experiment e;
  e.name = protocol;
  e.agents = 4;
  e.dt = dt;
  e.rounds = static_cast<Round>(std::lround(seconds / dt));
  e.report_every = std::max<Round>(1, e.rounds / 2000);
  const bool discrete = protocol == "dkf_iterative";
  Values parameters;
  parameters.set("Q", discrete ? 0.1 * dt : 0.1);
  if (protocol == "dkf_olfati_saber" || protocol == "dkf_kim") parameters.set("gamma", 5.0);
  if (protocol == "dkf_kim") parameters.set("k", 2.0);
  e.protocols = {{protocol, parameters}};
  e.topology = for_ever(graph);
  e.plant.emplace();
  e.plant->model = "shared_linear";
  e.plant->parameters.set("A", oscillator::A());
  e.plant->initial = {{"x", same(Matrix(Vector(Vector::Unit(2, 0))))}};
  if (noisy) e.plant->disturbances.push_back({Disturbance::On::state, Disturbance::Gaussian{Matrix::Constant(1, 1, 0.1), true}, 1, {}});
  for (std::uint32_t i = 1; i <= 4; ++i) {
    e.overrides[AgentId{i}].parameters.set("R", oscillator::R()[i - 1]);
    if (protocol == "dkf_kim" && i == 4) continue;  // no sensor
    e.plant->overrides[AgentId{i}].parameters.set("C", oscillator::C()[i - 1]);
    if (noisy)
      e.plant->disturbances.push_back({Disturbance::On::measurement,
                                       Disturbance::Gaussian{Matrix::Constant(1, 1, oscillator::R()[i - 1]), !discrete},
                                       1,
                                       {AgentId{i}}});
  }
  return e;
}
Metrics metrics_of(const Experiment& e, std::uint64_t seed = 1) {
  return compute_metrics(e, Seed{seed}, e.protocols[0], simulate(e, e.protocols[0], Seed{seed}));
}

/// Means over runs.
struct Means {
  double nees = 0.0, rmse = 0.0;
};
Means means(const Experiment& e, int runs) {
  Means out;
  for (int run = 1; run <= runs; ++run) {
    const Metrics metrics = metrics_of(e, static_cast<std::uint64_t>(run));
    out.nees += metrics.at("nees") / runs;
    out.rmse += metrics.at("rmse") / runs;
  }
  return out;
}

TEST(PaperFilters, TheCentralisedFiltersCovarianceIsHonest) {
  // One run's NEES over 50 s deviates by about .33, its rmse by about .033.
  const Means found = means(oscillator_run("kalman_bucy", complete(4), true), 40);
  EXPECT_NEAR(found.nees, 2.0, 3 * 0.33 / std::sqrt(40.0));
  const double expected = std::sqrt(0.5 * stationary_covariance(oscillator::A(), oscillator::seen_by_all(), oscillator::Q()).trace());
  EXPECT_NEAR(expected, std::sqrt(0.5 * (.134208 + .176480)), 1e-6);
  EXPECT_NEAR(found.rmse, expected, 3 * 0.033 / std::sqrt(40.0));
}

TEST(PaperFilters, SoIsThatOfAnAgentThatHearsTwoNeighboursAndOfOneThatHearsNobody) {
  for (const Graph& graph : {ring(4), Graph(4, std::span<const Edge>())})
    EXPECT_NEAR(means(oscillator_run("kalman_bucy", graph, true), 40).nees, 2.0, 3 * 0.35 / std::sqrt(40.0));
}

TEST(PaperFilters, DistributedFiltersAreBetterThanTheySayAndWorseThanTheCentralisedOne) {
  const double centralised = means(oscillator_run("kalman_bucy", complete(4), true), 10).rmse;
  const double alone = means(oscillator_run("kalman_bucy", Graph(4, std::span<const Edge>()), true), 10).rmse;
  for (const std::string protocol : {"dkf_olfati_saber", "dkf_kim"}) {
    SCOPED_TRACE(protocol);
    const Means found = means(oscillator_run(protocol, ring(4), true), 10);
    EXPECT_LT(found.nees, 1.6);
    EXPECT_GT(found.nees, 0.8);
    EXPECT_GT(found.rmse, centralised);
    EXPECT_LT(found.rmse, alone);
  }
  const Means iterative = means(oscillator_run("dkf_iterative", ring(4), true, 0.1, 1000), 20);
  EXPECT_NEAR(iterative.nees, 1.88, 0.1) << "P_i leaves out the coupling alone";
}

TEST(PaperFilters, WithoutNoiseEverybodyEndsOnTheState) {
  for (const std::string protocol : {"kalman_bucy", "dkf_olfati_saber", "dkf_kim"}) {
    SCOPED_TRACE(protocol);
    EXPECT_LT(metrics_of(oscillator_run(protocol, ring(4), false)).at("error"), 1e-8);
  }
  EXPECT_LT(metrics_of(oscillator_run("dkf_iterative", ring(4), false, 0.1, 20)).at("error"), 1e-6) << "after 200 rounds";
}

TEST(PaperFilters, LostAndLateMessagesDelayTheErrorsEndOnly) {
  for (const std::string protocol : {"dkf_olfati_saber", "dkf_kim", "dkf_iterative"}) {
    SCOPED_TRACE(protocol);
    Experiment e = oscillator_run(protocol, ring(4), false, protocol == "dkf_iterative" ? 0.1 : 0.01, 200);
    e.links.standard.delay_rounds = 3;
    EXPECT_LT(metrics_of(e).at("error"), 1e-8);
  }
}

}  // namespace
}  // namespace consort
