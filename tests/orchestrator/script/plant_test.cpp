/// The plant, durations, joins and leaves of an experiment file: what they become, and how mistakes are answered.

#include "core/errors.hpp"
#include "orchestrator/script/script.hpp"

#include <gtest/gtest.h>

#include <string>

namespace consort {
namespace {

const std::string kAgents = "experiment: e\nagents: {count: 5, protocol: local_voting, initial: {x: 0}}\ntopology: ring\ndt: 0.1\n";

Experiment parsed(const std::string& rest) { return parse_experiment(kAgents + rest, "e.yaml", "."); }

std::string mistakes_in(const std::string& rest) {
  try {
    parsed(rest);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "none";
}

void expect_mistake(const std::string& expected, const std::string& rest) {
  const std::string found = mistakes_in(rest);
  EXPECT_NE(found.find(expected), std::string::npos) << "found: " << found << "\nexpected: " << expected;
}

std::string plant(const std::string& more) {
  return "duration: 5 s\nplant: {model: integrator, initial: {position: {linspace: [0, 1]}}" + more + "}\n";
}

TEST(ScriptPlant, BecomesWhatItSays) {
  const Experiment e = parsed(R"(
duration: 5 s
plant:
  model: {name: integrator, dimension: 1}
  initial: {position: [1, 2, 3, 4, 5]}
  sensing: neighbours
  overrides: {2: {initial: {position: 9}}}
  disturbances:
    - {on: measurement, gaussian: {deviation: 0.1}, hold: 0.2 s, agents: [2, 1]}
    - {on: state, gaussian: {intensity: 4}}
    - {on: input, sinusoid: {amplitude: 0.1, frequency: 2, phase: {linspace: [1, 5]}}}
    - {on: state, uniform: {bound: 0.05}}
    - {on: input, constant: 0.2}
events: [{time: 1.5 s, join: 5}, {round: 20, leave: [3, 4]}, {time: 2 s, cut: [4 <-> 5]}]
)");
  EXPECT_EQ(e.rounds, 50u);
  ASSERT_TRUE(e.plant.has_value());
  EXPECT_EQ(e.plant->model, "integrator");
  EXPECT_EQ(e.plant->parameters.scalar("dimension"), 1.0);
  EXPECT_EQ(e.plant->initial_of(AgentId{2}, 5, e.seed).scalar("position"), 9.0);
  EXPECT_EQ(e.plant->initial_of(AgentId{4}, 5, e.seed).scalar("position"), 4.0);
  EXPECT_EQ(e.plant->sensing, PlantSpec::Sensing::neighbours);
  ASSERT_EQ(e.plant->disturbances.size(), 5u);
  const Disturbance& noise = e.plant->disturbances[0];
  EXPECT_EQ(noise.on, Disturbance::On::measurement);
  EXPECT_EQ(noise.hold_rounds, 2u);
  EXPECT_EQ(noise.agents, (std::vector<AgentId>{AgentId{1}, AgentId{2}}));
  EXPECT_NEAR(std::get<Disturbance::Gaussian>(noise.signal).covariance(0, 0), 0.01, 1e-15);
  EXPECT_TRUE(std::get<Disturbance::Gaussian>(e.plant->disturbances[1].signal).intensity);
  EXPECT_EQ(std::get<Disturbance::Sinusoid>(e.plant->disturbances[2].signal).frequency, 2.0);
  EXPECT_EQ(std::get<Disturbance::Uniform>(e.plant->disturbances[3].signal).bound(0, 0), 0.05);
  EXPECT_EQ(e.presence_of(AgentId{5}), (Attendance{15}));
  EXPECT_EQ(e.presence_of(AgentId{3}), (Attendance{0, 20}));
  EXPECT_EQ(e.presence_of(AgentId{1}), Attendance{});
  EXPECT_EQ(e.link_events.at(0).round, 20u);
}

TEST(ScriptPlant, ResolvesToATextThatGivesTheSameExperimentAgain) {
  const Experiment e = parsed(plant(R"(, disturbances: [{on: state, gaussian: {intensity: 4}}, {on: input, constant: {uniform: [0, 1]}},
    {on: input, sinusoid: {amplitude: [1, 2, 3, 4, 5], frequency: 2}, hold: 0.3 s, agents: [3]},
    {on: measurement, uniform: {bound: 1}}])") +
                              "events: [{time: 1.5 s, join: 5}, {round: 20, leave: 3}]\n");
  EXPECT_EQ(parse_experiment(e.resolved_text, "resolved", ".").resolved_text, e.resolved_text);
}

TEST(ScriptPlant, RefusesMistakesNamingPlaceAndRemedy) {
  expect_mistake("e.yaml:6:16: plant.model: found text 'intergrator'; allowed: ", "duration: 5 s\nplant: {model: intergrator}\n");
  expect_mistake("did you mean 'integrator'?", "duration: 5 s\nplant: {model: intergrator}\n");
  expect_mistake("plant.model integrator: found the unknown name 'ordr'; allowed: name, order, dimension; did you mean 'order'?",
                 "plant: {model: {name: integrator, ordr: 2}}\n");
  expect_mistake("parameter 'order': found 2.5; allowed: a whole number from 1 to 10", "plant: {model: {name: integrator, order: 2.5}}\n");
  expect_mistake("plant.model: found a mapping without a name", "plant: {model: {order: 2}}\n");
  expect_mistake("plant.initial: found the unknown name 'x0'", "plant: {model: integrator, initial: {x0: 1}}\n");
  expect_mistake("plant.overrides: found 6; allowed: an agent from 1 to 5", plant(", overrides: {6: {initial: {position: 1}}}"));
  expect_mistake("plant.sensing: found text 'all'; allowed: own, neighbours", plant(", sensing: all"));
  expect_mistake("plant.disturbances[0].on: found text 'mesurement'; allowed: state, input, measurement; did you mean 'measurement'?",
                 plant(", disturbances: [{on: mesurement, constant: 1}]"));
  expect_mistake("plant.disturbances[0]: found uniform, constant; allowed: exactly one of gaussian, uniform, sinusoid, constant",
                 plant(", disturbances: [{on: state, uniform: {bound: 1}, constant: 1}]"));
  expect_mistake("gaussian: found nothing; allowed: exactly one of deviation, covariance, intensity",
                 plant(", disturbances: [{on: state, gaussian: {}}]"));
  expect_mistake("deviation: found -1; allowed: a standard deviation", plant(", disturbances: [{on: state, gaussian: {deviation: -1}}]"));
  expect_mistake("hold: found 0.01; allowed: at least a round, dt = 0.1 s",
                 plant(", disturbances: [{on: state, constant: 1, hold: 0.01}]"));
  expect_mistake("sinusoid: found no 'frequency'", plant(", disturbances: [{on: state, sinusoid: {amplitude: 1}}]"));
  expect_mistake("plant.disturbances[0], agent 1", plant(", disturbances: [{on: state, constant: {all: [1, 2]}}]"));
}

TEST(ScriptEvents, ActInTheFirstRoundThatBeginsAtTheirTimeOrAfter) {
  const auto round_of = [](const std::string& dt, const std::string& time) {
    const Experiment e =
        parse_experiment("experiment: e\nagents: {count: 5, protocol: local_voting, initial: {x: 0}}\ntopology: ring\ndt: " + dt +
                             "\nrounds: 1000000000\nevents: [{time: " + time + ", cut: [1 -> 2]}]\n",
                         "e.yaml", ".");
    return e.link_events.at(0).round;
  };
  EXPECT_EQ(round_of("0.3", "1.3 s"), 5u) << "not round 4, which begins at 1.2 s";
  EXPECT_EQ(round_of("0.3", "1.2 s"), 4u);
  EXPECT_EQ(round_of("0.3", "1200 ms"), 4u);
  EXPECT_EQ(round_of("0.3", "1.2000001"), 5u);
  EXPECT_EQ(round_of("0.3", "1.2000000001"), 4u) << "within a billionth of a round's beginning";
  EXPECT_EQ(round_of("0.3", "1.1999999999"), 4u);
  EXPECT_EQ(round_of("0.3", "0.01"), 1u);
  EXPECT_EQ(round_of("0.3", "0"), 0u);
  EXPECT_EQ(round_of("0.3", "1e-12"), 0u);
  EXPECT_EQ(round_of("0.1", "0.3"), 3u) << "0.3 / 0.1 is a little below 3 in double";
  EXPECT_EQ(round_of("0.001", "15 s"), 15'000u);
  for (const int k : {1, 7, 49, 9'999, 123'457}) EXPECT_EQ(round_of("0.01", std::to_string(k) + "0 ms"), static_cast<Round>(k));
}

TEST(ScriptEvents, AllKindsOfEventsTakeTheirTimesAlike) {
  const Experiment e = parsed(
      "duration: 5 s\nplant: {model: integrator, initial: {position: 0}}\nevents: [{time: 1.23 s, set_link: {loss: 0.5}}, "
      "{time: 1.23 s, degrade: {agent: 2, constant: 1}}, {time: 1.23 s, heal: all}, {time: 1.23 s, join: 5}, "
      "{time: 2.01 s, leave: 5}, {time: 1.23 s, kill: 3}, {time: 2.01 s, restart: 3}, {time: 1.23 s, stop: 4}, "
      "{time: 2.01 s, continue: 4}]\n");
  EXPECT_EQ(e.links.changes.at(0).since, 13u);
  EXPECT_EQ(e.plant->disturbances.at(0).first, 13u);
  EXPECT_EQ(e.link_events.at(0).round, 13u);
  EXPECT_EQ(e.presence_of(AgentId{5}).from, 13u);
  EXPECT_EQ(e.presence_of(AgentId{5}).until, 21u);
  for (const Fault& fault : e.faults)
    EXPECT_EQ(fault.round, fault.kind == Fault::Kind::kill || fault.kind == Fault::Kind::stop ? 13u : 21u);
}

TEST(ScriptPlant, RefusesTimesAndPresencesThatMakeNoSense) {
  expect_mistake("duration: found both 'rounds' and 'duration'", "rounds: 10\nduration: 5 s\n");
  expect_mistake("duration: found 0.01, 0 rounds of dt = 0.1 s", "duration: 0.01\n");
  expect_mistake("events[0].time: found text '22 s', which is round 220; allowed: within the run's 50 rounds",
                 "duration: 5 s\nevents: [{time: 22 s, join: 5}]\n");
  expect_mistake("events[0]: found both 'round' and 'time'", "duration: 5 s\nevents: [{time: 2 s, round: 3, join: 5}]\n");
  expect_mistake("events[0]: found join, leave; allowed: exactly one of", "duration: 5 s\nevents: [{time: 2 s, join: 5, leave: 2}]\n");
  expect_mistake("events[0].join: found 6; allowed: an agent from 1 to 5", "events: [{round: 2, join: 6}]\n");
  expect_mistake("found agent 5 in round 0", "events: [{round: 0, join: 5}]\n");
  for (const std::string event : {"{round: 9999, leave: 5}", "{time: 9999 s, kill: 5}", "{round: x, stop: 5}", "{leave: 5}"}) {
    const std::string mistakes = mistakes_in("events: [" + event + ", {round: 20, continue: 5}]\n");
    EXPECT_EQ(std::count(mistakes.begin(), mistakes.end(), '\n'), 0) << "one mistake is told once: " << mistakes;
  }
  expect_mistake("events: found 'join' of agent 5 in round 4; allowed: leave, kill or stop",
                 "events: [{round: 2, join: 5}, {round: 4, join: 5}]\n");
  expect_mistake("events: found 'join' of agent 5 in round 4; allowed: restart", "events: [{round: 4, join: 5}, {round: 2, kill: 5}]\n");
  expect_mistake("events: found 'restart' of agent 5 in round 4; allowed: join",
                 "events: [{round: 2, leave: 5}, {round: 4, restart: 5}]\n");
  expect_mistake("events: found 'leave' of agent 5 in round 4; allowed: continue", "events: [{round: 2, stop: 5}, {round: 4, leave: 5}]\n");
  expect_mistake("in round 4, where something else happens to it", "events: [{round: 4, kill: 5}, {round: 4, restart: 5}]\n");
  expect_mistake("agent 2 is stopped and never goes on", "events: [{round: 4, stop: 2}]\n");
  expect_mistake("found that every agent joins later", "events: [{round: 4, join: [1, 2, 3, 4, 5]}]\n");
}

TEST(ScriptPlant, ChoicesAreWords) {
  const std::string file = "experiment: e\ndt: 0.01\ntopology: ring\nplant: {model: {name: integrator, order: 2}}\n";
  const Experiment e =
      parse_experiment(file + "agents: {count: 4, protocol: {name: adaptive_consensus, reference: halving, window: 1}}\n", "e.yaml", ".");
  EXPECT_EQ(e.protocols[0].parameters.scalar("reference"), 1.0);
  EXPECT_NE(e.resolved_text.find("reference: halving"), std::string::npos) << e.resolved_text;
  try {
    parse_experiment(file + "agents: {count: 4, protocol: {name: adaptive_consensus, reference: halvin}}\n", "e.yaml", ".");
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("did you mean 'halving'?"), std::string::npos) << error.what();
  }
}

TEST(ScriptPlant, AProtocolThatNeedsOneSaysSo) {
  try {
    parse_experiment("experiment: e\nagents: {count: 3, protocol: adaptive_consensus}\ntopology: ring\n", "e.yaml", ".");
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("the experiment needs a 'plant' section"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace consort
