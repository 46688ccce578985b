#include "protocols/theory.hpp"

#include "orchestrator/script/script.hpp"
#include "protocols/everybody/observed_system.hpp"
#include "tests/support/tree.hpp"

#include <gtest/gtest.h>

#include <filesystem>

namespace consort {
namespace {

using Verdict = Rating;

#define EXPECT_SAYS(text, where) EXPECT_PRED_FORMAT2(testing::IsSubstring, text, where)

std::vector<Finding> about(const Experiment& experiment, const std::string& condition) {
  std::vector<Finding> out;
  for (const auto& finding : examine(experiment))
    if (finding.condition.starts_with(experiment.protocols[0].name + ": " + condition)) out.push_back(finding);
  return out;
}
/// The only finding whose condition, after the protocol's name, begins so.
Finding only(const Experiment& experiment, const std::string& condition) {
  const auto found = about(experiment, condition);
  EXPECT_EQ(found.size(), 1U) << condition;
  return found.empty() ? Finding{} : found.front();
}
Experiment shipped(const std::string& name) {
  return load_experiment(std::filesystem::path(kSourceDir) / "experiments" / (name + ".yaml"));
}
Experiment with(const std::string& text) { return parse_experiment("experiment: t\nrounds: 100\ndt: 0.01\n" + text + "\n", "t.yaml", "."); }
/// Three scalar agents; `more` goes into the plant section.
Experiment three(const std::string& parameters, const std::string& model, const std::string& more, const std::string& topology) {
  return with("agents: {count: 3, protocol: {name: distributed_observer, " + parameters + "}}\nplant: {model: {name: linear, " + model +
              "}" + more + "}\ntopology: " + topology);
}
const std::string kRing = "{edges: [1 -> 2, 2 -> 3, 3 -> 1]}";

TEST(TheoryObserver, FindsAllConditionsOf51True) {
  const Experiment e = shipped("observer_mas");
  for (const char* condition : {"strongly connected communication", "dynamics and sensing couplings", "every (A_ii, C_ii)",
                                "every A_ii - F_i C_ii", "dt is short enough"})
    EXPECT_EQ(only(e, condition).verdict, Verdict::holds) << condition;
  const Finding coupling = only(e, "mu > max Re lambda");
  EXPECT_EQ(coupling.verdict, Verdict::holds);
  EXPECT_SAYS("mu = 10, the bound is 4.8955", coupling.evidence);
  const Finding whole = only(e, "the whole error");
  EXPECT_EQ(whole.verdict, Verdict::holds);
  EXPECT_SAYS("spectral abscissa -1.25122 of 16 components", whole.evidence);
}

TEST(TheoryObserver, FindsTheLongestStep) {
  Experiment e = shipped("observer_mas");
  EXPECT_SAYS("second-order accurate", only(e, "dt is short enough").consequence);
  e.protocols[0].parameters.set("scheme", static_cast<double>(SampledScheme::first_order));
  e.dt = 0.1;
  EXPECT_SAYS("spectral radius 0.966", only(e, "dt is short enough").evidence);
  e.dt = 0.2;
  EXPECT_EQ(only(e, "dt is short enough").verdict, Verdict::fails);
}

TEST(TheoryObserver, RefusesAnAgentThatIsNotObservableByItself) {
  const Finding finding = only(three("F: 2", "A: [[0.3]]", ", overrides: {2: {parameters: {C: [[0]]}}}", kRing), "every (A_ii, C_ii)");
  EXPECT_EQ(finding.verdict, Verdict::refused);
  EXPECT_SAYS("not that of agent 2: C does not show the eigenvalue 0.3", finding.evidence);
}

TEST(TheoryObserver, RefusesCouplingsThatRunInACircleNamingIt) {
  const Finding finding = only(
      three("F: 2", "A: [[0.3]]", ", couplings: [{edge: 1 -> 2, A: [[1]]}, {edge: 2 -> 3, C: [[1]]}, {edge: 3 -> 1, C: [[1]]}]", kRing),
      "dynamics and sensing couplings");
  EXPECT_EQ(finding.verdict, Verdict::refused);
  EXPECT_SAYS("1 -> 2 -> 3 -> 1", finding.evidence);
}

TEST(TheoryObserver, RefusesCommunicationThatIsNotStronglyConnectedNamingTheAgents) {
  const Finding finding = only(three("F: 2", "A: [[0.3]]", "", "{edges: [1 -> 2, 2 -> 3, 3 -> 2]}"), "strongly connected communication");
  EXPECT_EQ(finding.verdict, Verdict::refused);
  EXPECT_SAYS("nothing that agent 2 says reaches agent 1", finding.evidence);
}

TEST(TheoryObserver, LooksAtThoseThatAreThere) {
  // Agent 2 leaves a ring of three, which leaves 3 -> 1 alone.
  Experiment e = three("F: 2", "A: [[0.3]]", "", kRing);
  e.presence[AgentId{2}].until = 50;
  const Finding finding = only(e, "strongly connected communication");
  EXPECT_EQ(finding.verdict, Verdict::refused);
  EXPECT_SAYS("from round 50 on, nothing that agent 1 says reaches agent 3", finding.evidence);
  EXPECT_EQ(only(shipped("observer_leave"), "strongly connected communication").verdict, Verdict::holds);
  EXPECT_EQ(about(shipped("observer_join"), "the whole error").size(), 2U) << "once without and once with the newcomer";
}

TEST(TheoryObserver, WarnsOfGainsThatAreTooSmallOrUnstable) {
  const Finding low = only(three("F: 2, mu: 1", "A: [[0.3]]", "", kRing), "mu > max Re lambda");
  EXPECT_EQ(low.verdict, Verdict::fails);
  EXPECT_SAYS("mu = 1, the bound is 1.22388", low.evidence);
  const Finding unstable = only(three("F: 0.1", "A: [[0.3]]", "", kRing), "every A_ii - F_i C_ii");
  EXPECT_EQ(unstable.verdict, Verdict::fails);
  EXPECT_SAYS("that of agent 1 has an eigenvalue with real part 0.2", unstable.evidence);
}

TEST(TheoryObserver, TellsTheAcyclicSensingGraphAndTheConditionsOfTheorem415) {
  const Experiment e = shipped("localization_single");
  const Finding dag = only(e, "the acyclic sensing graph");
  EXPECT_SAYS("layers 1 0 1 2 3 4", dag.evidence);
  EXPECT_SAYS("1 uses 2, 3 uses 2, 4 uses 3, 5 uses 4, 6 uses 5", dag.consequence);
  for (const char* condition : {"an absolute position is within reach", "every agent uses a measurement",
                                "strongly connected communication", "sensing edges are communication edges"})
    EXPECT_EQ(only(e, condition).verdict, Verdict::holds) << condition;
  EXPECT_SAYS("spectral abscissa -0.108693 of 84 components", only(e, "the whole error").evidence);
  EXPECT_SAYS("spectral abscissa -0.108002 of 168 components", only(shipped("localization_double"), "the whole error").evidence);
}

/// Six vehicles as in localization_single, with other sensing or topology.
Experiment vehicles(const std::string& protocol, const std::string& sensing, const std::string& topology) {
  return with("agents: {count: 6, protocol: " + protocol + "}\nplant: {model: {name: integrator, dimension: 2}, sensing: " + sensing +
              "}\ntopology: " + topology);
}
const std::string kLocalize = "{name: cooperative_localization, F: -1}";

TEST(TheoryObserver, RefusesATeamWithoutAnAbsolutePositionInReach) {
  const Finding finding =
      only(vehicles(kLocalize, "{relative: {1: [2], 4: [3], 5: [4], 6: [5]}, absolute: [2]}", "ring"), "an absolute position");
  EXPECT_EQ(finding.verdict, Verdict::refused);
  EXPECT_SAYS("agent 3 has none", finding.evidence);
}

TEST(TheoryObserver, RefusesSensingWithoutCommunicationNamingTheEdge) {
  for (const std::string& protocol : {kLocalize, std::string("acyclic_sensing")}) {
    const Finding finding =
        only(vehicles(protocol, "{relative: {1: [2], 2: [3], 3: [4], 4: [5], 5: [6], 6: [1]}, absolute: [2]}", "directed_ring"),
             "sensing edges are communication edges");
    EXPECT_EQ(finding.verdict, Verdict::refused);
    EXPECT_SAYS("agent 1 measures agent 2, but the edge 2 -> 1 is missing", finding.evidence);
  }
}

}  // namespace
}  // namespace consort
