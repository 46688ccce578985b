// What validate says of a network of observers.

#include "protocols/theory.hpp"
#include "orchestrator/script/script.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

using Verdict = Rating;

#define EXPECT_SAYS(text, where) EXPECT_PRED_FORMAT2(testing::IsSubstring, text, where)

constexpr const char* kEdges = "1 -> 2, 2 -> 3, 3 -> 1, 3 -> 4, 4 -> 1, 3 -> 5, 2 -> 6";
constexpr const char* kSeen = "some agent sees every state group";
constexpr const char* kLeaders = "the graph has a spanning tree, and all sensing agents are its leaders";

std::string beam(const std::string& edges = kEdges, const std::string& plant = "{model: beam}", const std::string& more = "") {
  return "agents: {count: 6, protocol: {name: sensor_network_observer, Q: [6e-4, 10e-4, 10e-4, 6e-4, 18e-4, 14e-4, 8e-4, 8e-4], gamma: "
         "1e4, "
         "alpha: 1}, overrides: {1: {parameters: {R: 2e-6}}, 2: {parameters: {R: 5e-6}}, 3: {parameters: {R: 3e-6}}, 4: {parameters: {R: "
         "1e-7}}}}\nplant: " +
         plant + "\ndt: 0.001\ntopology: {edges: [" + edges + "]}\n" + more;
}

std::vector<Finding> findings(const std::string& text) {
  std::vector<Finding> out;
  for (const Finding& finding : examine(parse_experiment("experiment: t\nrounds: 100\n" + text, "t.yaml", ".")))
    if (finding.condition.starts_with("sensor_network_observer: ")) out.push_back(finding);
  return out;
}
/// The only finding whose condition begins so.
Finding only(const std::string& text, const std::string& condition) {
  std::vector<Finding> out;
  for (const Finding& finding : findings(text))
    if (finding.condition.starts_with("sensor_network_observer: " + condition)) out.push_back(finding);
  EXPECT_EQ(out.size(), 1U) << condition;
  return out.empty() ? Finding{} : out.front();
}

TEST(TheorySensorNetwork, FindsNothingWrongWithTheBeam) {
  for (const Finding& finding : findings(beam())) {
    EXPECT_NE(finding.verdict, Verdict::fails) << finding.condition << ": " << finding.evidence;
    EXPECT_NE(finding.verdict, Verdict::refused) << finding.condition << ": " << finding.evidence;
  }
  EXPECT_SAYS("mode4: agents 1, 3", only(beam(), kSeen).evidence);
  EXPECT_SAYS("the leaders are agents 1, 2, 3, 4", only(beam(), kLeaders).evidence);
  EXPECT_SAYS("any gamma", only(beam(), "gamma is above the bounds").consequence);
  EXPECT_SAYS("no state group grows", only(beam(), "alpha is within the bound").consequence);
  EXPECT_SAYS("-0.792994", only(beam(), "the error matrix of the whole network is stable").evidence);
  const Finding covariance = only(beam(), "stationary covariance of the errors");
  EXPECT_SAYS("trace P = 0.016053, with steps of dt 0.016087", covariance.evidence);
  EXPECT_SAYS("sees itself 0.0064663, by its own filter alone (3.29) 0.010598", covariance.evidence);
  const Finding five = only(beam(), "variances of agent 5");
  EXPECT_SAYS("mode2 0.0002546", five.evidence);
  EXPECT_EQ(five.consequence, "no sensor");
}

TEST(TheorySensorNetwork, RefusesAPlantThatNobodyObservesWholeNamingTheGroup) {
  const Finding blind = only(beam(kEdges, "{model: beam, overrides: {1: {parameters: {sensor: 0}}, 3: {parameters: {sensor: 0}}}}"), kSeen);
  EXPECT_EQ(blind.verdict, Verdict::refused);
  EXPECT_EQ(blind.evidence, "nobody sees mode4");
}

TEST(TheorySensorNetwork, RefusesTwoGroupsThatDoNotHearEachOther) {
  const Finding split = only(beam("1 -> 2, 2 -> 3, 3 -> 1, 3 -> 4, 4 -> 1, 2 -> 6"), kLeaders);
  EXPECT_EQ(split.verdict, Verdict::refused);
  EXPECT_SAYS("two groups hear nobody outside: agents 1, 2, 3, 4; agent 5", split.evidence);
}

TEST(TheorySensorNetwork, RefusesLeadersWhoNeverHearOfAGroup) {
  // Agents 2 and 4 lead and see no mode 4; agents 1 and 3, who see it, only listen.
  const Finding deaf = only(beam("2 <-> 4, 4 -> 1, 4 -> 3, 3 -> 5, 2 -> 6"), kLeaders);
  EXPECT_EQ(deaf.verdict, Verdict::refused);
  EXPECT_SAYS("agents 1, 3: not heard by the leaders, agents 2, 4, who do not see mode4", deaf.evidence);
}

TEST(TheorySensorNetwork, WarnsOfASensorThatTheLeadersDoNotHear) {
  const Finding alone = only(beam("1 -> 2, 2 -> 3, 3 -> 1, 3 -> 4, 3 -> 5, 2 -> 6"), kLeaders);
  EXPECT_EQ(alone.verdict, Verdict::fails);
  EXPECT_SAYS("agent 4: not heard by the leaders, agents 1, 2, 3", alone.evidence);
}

TEST(TheorySensorNetwork, OnlyWarnsOfWhatPasses) {
  const Finding passing =
      only(beam(kEdges, "{model: beam}", "events: [{round: 10, cut: [3 -> 5]}, {round: 20, heal: [3 -> 5]}]\n"), kLeaders);
  EXPECT_EQ(passing.verdict, Verdict::fails);
  EXPECT_SAYS("first in round 10: two groups hear nobody outside: agents 1, 2, 3, 4; agent 5", passing.evidence);
}

TEST(TheorySensorNetwork, MeasuresGammaAndAlphaOfAGrowingPlantAgainstTheirBounds) {
  const auto growing = [](const std::string& tuning) {
    return "agents: {count: 4, protocol: {name: sensor_network_observer" + tuning +
           "}}\nplant: {model: {name: shared_linear, A: [[0.5]]}, overrides: {1: {parameters: {C: [[1]]}}}}\n"
           "dt: 0.01\ntopology: {edges: [1 -> 2, 2 -> 3, 3 -> 1, 3 -> 4]}\n";
  };
  // lambda_max(A + A') = 1; (3.83): (1/3) 1 / 1; (3.84): 1 / 2.
  const Finding weak = only(growing(", gamma: 0.4, alpha: 1"), "gamma is above the bounds");
  EXPECT_EQ(weak.verdict, Verdict::fails);
  EXPECT_SAYS("gamma = 0.4; leaders 0.333333, followers 0.5", weak.evidence);
  EXPECT_EQ(only(growing(", gamma: 0.6, alpha: 1"), "gamma is above the bounds").verdict, Verdict::holds);
  EXPECT_EQ(only(growing(""), "gamma is above the bounds").verdict, Verdict::holds) << "the rule's own gamma";
  // M^-1 = .5 + sqrt(1.25), M Q M = .381966; alpha_max = .381966 / (2 * 1) with three leaders, / 3 by the agreed four agents.
  const Finding large = only(growing(", gamma: 5, alpha: 1"), "alpha is within the bound");
  EXPECT_EQ(large.verdict, Verdict::fails);
  EXPECT_SAYS("the smallest bound is 0.190983 times the alpha used", large.consequence);
  const Finding found = only(growing(", gamma: 5"), "alpha is within the bound");
  EXPECT_EQ(found.verdict, Verdict::holds);
  EXPECT_SAYS("alpha = 0.127322 by Algorithm 3.2; w_min / w_max = 1", found.evidence);
  EXPECT_SAYS("the smallest bound is 1.5 times the alpha used", found.consequence);
}

TEST(TheorySensorNetwork, FindsTheLargestStableStep) {
  // One agent that sees x' = -x + w: G = sqrt 2 - 1, e+ = exp(-h) (1 - h G) e, stable below the root of |1 - h G| = exp(h): none.
  const std::string calm =
      "agents: {count: 1, protocol: sensor_network_observer}\nplant: {model: {name: shared_linear, A: [[-1]], C: [[1]]}}\ndt: 0.01\n"
      "topology: {edges: []}\n";
  const Finding calm_step = only(calm, "dt is short enough");
  EXPECT_EQ(calm_step.verdict, Verdict::holds);
  EXPECT_SAYS("no step", calm_step.evidence);
  // x' = w: G = 1, e+ = (1 - h) e, stable below 2.
  const auto still = [](const std::string& dt) {
    return "agents: {count: 1, protocol: sensor_network_observer}\nplant: {model: {name: shared_linear, A: [[0]], C: [[1]]}}\ndt: " + dt +
           "\ntopology: {edges: []}\n";
  };
  EXPECT_SAYS("stable below 2 s", only(still("1.9"), "dt is short enough").evidence);
  EXPECT_EQ(only(still("1.9"), "dt is short enough").verdict, Verdict::holds);
  EXPECT_EQ(only(still("2.1"), "dt is short enough").verdict, Verdict::fails);
}

TEST(TheorySensorNetwork, RefusesAPlantThatIsNotShared) {
  const Finding own = only(
      "agents: {count: 2, protocol: sensor_network_observer}\nplant: {model: {name: linear, A: [[-1]]}}\ndt: 0.1\ntopology: {edges: [1 -> "
      "2]}\n",
      "one linear plant that all agents share");
  EXPECT_EQ(own.verdict, Verdict::refused);
}

}  // namespace
}  // namespace consort
