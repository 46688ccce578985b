/// Sensing, couplings, what an agent's death does, and what ends a run of estimators: what they become, and how mistakes are answered.

#include "core/errors.hpp"
#include "orchestrator/script/script.hpp"

#include <gtest/gtest.h>

#include <string>

namespace consort {
namespace {

const std::string kAgents =
    "experiment: e\nrounds: 9\nagents: {count: 4, protocol: {name: kalman_consensus, Q: 0.1, Omega: 0.1}, initial: {x: 0, P: 1}}\n"
    "topology: ring\n";

Experiment parsed(const std::string& rest) { return parse_experiment(kAgents + rest, "e.yaml", "."); }

void expect_mistake(const std::string& expected, const std::string& rest) {
  std::string found = "none";
  try {
    parsed(rest);
  } catch (const ConfigError& error) {
    found = error.what();
  }
  EXPECT_NE(found.find(expected), std::string::npos) << "found: " << found << "\nexpected: " << expected;
}

const std::string kPairs = R"(
plant:
  model: {name: linear, A: [[0, 1], [-1, 0]], B: [[0], [1]], C: [[1, 0]]}
  overrides: {2: {parameters: {A: 1.03, B: 1, C: 1}}}
  couplings: [{edge: 1 -> 2, A: [[0.8, 1]], C: [[0.8, 1.2]]}, {edge: 3 -> 1, C: [[1, 0]]}]
  sensing: {relative: {1: [4, 3], 3: [4]}, absolute: [4]}
on_agent_loss: continue
)";

TEST(ScriptSensing, RelativeMeasurementsAndCouplingsBecomeWhatTheySay) {
  const Experiment e = parsed(kPairs);
  const PlantSpec& plant = *e.plant;
  EXPECT_EQ(plant.sensing, PlantSpec::Sensing::relative);
  EXPECT_EQ(plant.relative.at(AgentId{1}), (std::vector<AgentId>{AgentId{3}, AgentId{4}}));
  EXPECT_EQ(plant.absolute, std::vector<AgentId>{AgentId{4}});
  EXPECT_EQ(e.sensed_by(AgentId{2}, Graph()), std::vector<AgentId>{});
  const Values second = plant.parameters_of(AgentId{2});
  EXPECT_EQ(*second.find("A_1"), (Matrix(1, 2) << 0.8, 1.0).finished());
  EXPECT_EQ(*second.find("C_1"), (Matrix(1, 2) << 0.8, 1.2).finished());
  EXPECT_EQ(second.scalar("A"), 1.03);
  EXPECT_FALSE(plant.parameters_of(AgentId{1}).has("A_3"));
  EXPECT_TRUE(plant.parameters_of(AgentId{1}).has("C_3"));
  EXPECT_EQ(e.on_agent_loss, AgentLoss::go_on);
  EXPECT_EQ(parsed("").on_agent_loss, AgentLoss::abort);
}

std::string filters(const std::string& more) {
  return "experiment: e\nrounds: 9\ndt: 0.01\nagents: {count: 3, protocol: {name: kalman_bucy, Q: 0.1, R: 1}}\ntopology: complete\n"
         "plant: {model: {name: shared_linear, A: [[0, 1], [-1, 0]], C: [[1, 0]]}}\n" +
         more;
}

TEST(ScriptSensing, CriteriaOnWhatOnlySeveralRunsHaveAreRefusedWithTheRemedy) {
  for (const std::string name : {"nees_low", "nees_high", "rmse.std", "error.share"}) {
    SCOPED_TRACE(name);
    const std::string text = filters("metrics: [rmse]\ncriteria: [\"nees < 9\", \"1 < " + name + "\"]\n");
    try {
      parse_experiment(text, "e.yaml", ".");
      ADD_FAILURE() << "a single run has it";
    } catch (const ConfigError& error) {
      const std::string what = error.what();
      EXPECT_NE(what.find("e.yaml:8:24: criteria[1]: criterion: found '" + name + "' (column 5) in '1 < " + name +
                          "', which a single run does not have; allowed: with several runs, such as 'runs: 20' or --runs 20"),
                std::string::npos)
          << what;
    }
    ScriptOverrides two;
    two.runs = 2;
    EXPECT_NO_THROW(parse_experiment(text, "e.yaml", ".", two));
  }
}

TEST(ScriptSensing, CriteriaBringTheMetricsThatTheyName) {
  const Experiment e =
      parse_experiment(filters("runs: 2\nmetrics: [rmse]\ncriteria: [\"nees < nees_high\", \"error.2 < 9\", \"rmse.1.share == 1\"]\n"
                               "stop: {converged: {error: 0.1}}\n"),
                       "e.yaml", ".");
  EXPECT_EQ(e.metrics, (std::vector<std::string>{"rmse", "nees", "error"}));
  EXPECT_EQ(e.convergence->within, 0.1);
}

TEST(ScriptSensing, ResolvesToATextThatGivesTheSameExperimentAgain) {
  const Experiment e = parsed(kPairs);
  EXPECT_EQ(parse_experiment(e.resolved_text, "resolved", ".").resolved_text, e.resolved_text);
}

std::string plant(const std::string& more) { return "plant: {model: {name: linear, A: 0}, " + more + "}\n"; }

TEST(ScriptSensing, RefusesMistakesNamingPlaceAndRemedy) {
  expect_mistake("plant.sensing.relative: found 5; allowed: an agent from 1 to 4", plant("sensing: {relative: {5: [1]}}"));
  expect_mistake("plant.sensing.relative.1[0]: found 9; allowed: an agent from 1 to 4", plant("sensing: {relative: {1: [9]}}"));
  expect_mistake("plant.sensing.relative.2: found the agent itself; allowed: other agents", plant("sensing: {relative: {2: [1, 2]}}"));
  expect_mistake("plant.sensing: found the unknown key 'absolut'", plant("sensing: {absolut: [1]}"));
  expect_mistake("plant.couplings[0]: found the unknown name 'D'; allowed: edge, A, C", plant("couplings: [{edge: 1 -> 2, D: 1}]"));
  expect_mistake("plant.couplings[1]: found the edge 1 -> 2 a second time", plant("couplings: [{edge: 1 -> 2, A: 1}, {edge: 1 -> 2}]"));
  expect_mistake("plant.couplings[0].edge: found several edges; allowed: one", plant("couplings: [{edge: 1 <-> 2, A: 1}]"));
  expect_mistake("coupling 1 -> 2: A is 2 x 1; allowed: 1 x 1", plant("couplings: [{edge: 1 -> 2, A: [1, 2]}]"));
  expect_mistake("plant.couplings: the parts of model integrator do not act on each other; allowed: model linear",
                 "plant: {model: integrator, couplings: [{edge: 1 -> 2, A: 1}]}\n");
  expect_mistake("on_agent_loss: found text 'ignore'; allowed: abort, continue", "on_agent_loss: ignore\n");
  expect_mistake("stop.converged.error: these agents agree with each other; allowed: disagreement", "stop: {converged: {error: 0.1}}\n");
}

}  // namespace
}  // namespace consort
