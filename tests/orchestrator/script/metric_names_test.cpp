#include "orchestrator/script/script.hpp"
#include "protocols/metrics.hpp"
#include "rounds/simulate.hpp"
#include "tests/support/tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

namespace consort {
namespace {

constexpr Round kShort = 4;

/// What a run of a few rounds measures is called as was announced before it; whoever joins or leaves does so within them.
void expect_the_names_that_were_announced(Experiment e) {
  const Round planned = e.rounds;
  e.rounds = std::min(e.rounds, kShort);
  e.report_every = 1;
  e.convergence.reset();
  e.metrics.clear();
  for (auto& [agent, presence] : e.presence) {
    const auto sooner = [&](Round k) { return k > planned ? k : static_cast<Round>(std::uint64_t{k} * e.rounds / planned); };
    presence.from = sooner(presence.from);
    presence.until = std::max(sooner(presence.until), presence.from + 1);
    presence.again.clear();
  }
  for (const ProtocolChoice& choice : e.protocols) {
    SCOPED_TRACE(choice.title());
    MetricNames measured;
    for (const auto& [name, value] : compute_metrics(e, e.seed, choice, simulate(e, choice, e.seed))) measured.insert(name);
    EXPECT_EQ(names_of_metrics(e, choice, AgentMaker(e, choice, e.seed).empty_trace()), measured);
  }
}

TEST(MetricNames, AreAnnouncedOfEveryShippedExperimentAsItsRunsMeasureThem) {
  for (const auto& file : std::filesystem::directory_iterator(std::filesystem::path(kSourceDir) / "experiments")) {
    if (file.path().extension() != ".yaml") continue;
    SCOPED_TRACE(file.path().filename().string());
    expect_the_names_that_were_announced(load_experiment(file.path()));
  }
}

Experiment with(const std::string& text) { return parse_experiment("experiment: t\nrounds: 4\n" + text + "\n", "t.yaml", "."); }

TEST(MetricNames, FollowFromSizesAgentsAndRuns) {
  const Experiment e =
      with("runs: 2\nagents: {count: 2, protocol: kalman_consensus, initial: {x: [[1, 2], [3, 4]], P: 1}}\ntopology: ring");
  const MetricNames names = names_of_metrics(e, e.protocols[0], AgentMaker(e, e.protocols[0], e.seed).empty_trace());
  for (const char* name : {"bias[0]", "bias[1]", "P_trace", "rounds"}) EXPECT_TRUE(names.contains(name)) << name;
  for (const char* name : {"bias", "error", "gain_min", "predicted_value[0]"}) EXPECT_FALSE(names.contains(name)) << name;
}

TEST(MetricNames, AreThoseOfWhomIsThereInTheEnd) {
  const Experiment e = with(
      "dt: 0.1\nagents: {count: 3, protocol: {name: distributed_observer, F: 2, mu: 3}}\nplant: {model: {name: linear, A: [[0.3]]}}\n"
      "topology: ring\nevents: [{round: 1, leave: 3}]");
  const MetricNames names = names_of_metrics(e, e.protocols[0], AgentMaker(e, e.protocols[0], e.seed).empty_trace());
  EXPECT_TRUE(names.contains("error.2"));
  EXPECT_FALSE(names.contains("error.3"));
  expect_the_names_that_were_announced(e);
}

}  // namespace
}  // namespace consort
