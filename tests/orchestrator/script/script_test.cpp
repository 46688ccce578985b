#include "orchestrator/script/script.hpp"

#include "core/errors.hpp"
#include "orchestrator/script/topology.hpp"
#include "orchestrator/script/wording.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>

namespace consort {
namespace {

namespace fs = std::filesystem;

Experiment read(const std::string& text, const ScriptOverrides& overrides = {}) { return parse_experiment(text, "e.yaml", ".", overrides); }

// What the user is told; empty if the text is accepted.
std::string mistakes_in(const std::string& text) {
  try {
    read(text);
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

const std::string kPlain = R"(# Why?
#
# Because.
experiment: plain
agents:
  count: 3
  protocol: kalman_consensus
  initial: {x: [4, 5, 6]}
topology: ring
)";

// kPlain with one line replaced (or, for an empty `old_line`, one appended).
std::string with(const std::string& old_line, const std::string& new_line) {
  if (old_line.empty()) return kPlain + new_line + "\n";
  std::string text = kPlain;
  return text.replace(text.find(old_line), old_line.size(), new_line);
}

std::string with_protocol(const std::string& line) { return with("  protocol: kalman_consensus", line); }
std::string with_initial(const std::string& values) { return with("{x: [4, 5, 6]}", values); }

double initial(const Experiment& e, std::uint32_t agent, std::string_view name, Eigen::Index row = 0) {
  return (*e.initial_of(AgentId{agent}, e.seed).find(name))(row, 0);
}

std::vector<Edge> edges_at(const Experiment& e, Round k) {
  std::vector<Edge> out;
  for (const auto& [edge, weight] : e.schedule(e.seed).at(k)->edges()) out.push_back(edge);
  return out;
}

Edge edge(std::uint32_t from, std::uint32_t to) { return {AgentId{from}, AgentId{to}}; }

#define EXPECT_MISTAKE(expected, text) EXPECT_PRED_FORMAT2(testing::IsSubstring, expected, mistakes_in(text))

TEST(Script, FillsInDefaults) {
  const Experiment e = read(kPlain);
  EXPECT_EQ(e.name, "plain");
  EXPECT_EQ(e.description, "Why?\n\nBecause.");
  EXPECT_EQ(e.mode, Mode::lockstep);
  EXPECT_EQ(e.seed.value, 1u);
  EXPECT_EQ(e.runs, 1u);
  EXPECT_EQ(e.rounds, 100u);
  EXPECT_EQ(e.dt, 1.0);
  EXPECT_EQ(e.agents, 3u);
  EXPECT_EQ(e.agents_per_process, 1u);
  EXPECT_EQ(e.deadline, 300.0);
  EXPECT_FALSE(e.convergence);
  EXPECT_FALSE(e.report_every);
  EXPECT_TRUE(e.links.standard.ideal());
}

TEST(Script, ReadsEveryKey) {
  const Experiment e = read(R"(
experiment: all_keys
mode: simulate
seed: 18446744073709551615
runs: 4
rounds: 300
dt: 0.5
agents:
  count: 4
  protocols: [unbiased_kalman_consensus, {name: kalman_consensus, Q: [[2, 1], [1, 2]], Omega: 0.1, self_term: true}]
  initial:
    x: [[1, 2], [3, 4], [5, 6], [7, 8]]
    P: {all: [0.5, 0.25]}
  overrides: {4: {initial: {P: [[2, 1], [1, 2]]}, parameters: {Q: 0.3}}}
topology: {random_pairs: {dwell_rounds: [2, 5]}}
links:
  loss: {bernoulli: 0.1}
  delay_rounds: 1
  noise_covariance: [0.1, 0.2]
  overrides: [{edges: [3 -> 4, 1 <-> 2], loss: 1}, {edge: 2 -> 3, noise_covariance: 0}]
events: [{round: 150, cut: [1 <-> 2]}, {round: 200, heal: [1 -> 2]}]
placement: {agents_per_process: 2}
stop: {converged: {disagreement: 1.0e-3, for_rounds: 10}, deadline: 2 min}
telemetry: {every: 7}
discovery: neighbours
metrics: [bias]
criteria: ["unbiased_kalman_consensus.disagreement < 5", "abs(kalman_consensus.bias[1].std) < 9"]
)");
  EXPECT_EQ(e.mode, Mode::simulate);
  EXPECT_EQ(e.seed.value, 18446744073709551615u);
  EXPECT_EQ(e.runs, 4u);
  EXPECT_EQ(e.dt, 0.5);
  ASSERT_EQ(e.protocols.size(), 2u);
  EXPECT_EQ((*e.protocols[1].parameters.find("Q"))(0, 1), 1.0);
  EXPECT_EQ(e.protocols[1].parameters.scalar("self_term"), 1.0);
  EXPECT_EQ(initial(e, 3, "x", 1), 6.0);
  EXPECT_EQ(initial(e, 3, "P", 1), 0.25);
  EXPECT_EQ(e.overrides.at(AgentId{4}).initial.find("P")->cols(), 2);
  EXPECT_EQ(e.overrides.at(AgentId{4}).parameters.scalar("Q"), 0.3);
  EXPECT_EQ(std::get<RandomPairs>(e.topology).dwell_max, 5u);
  EXPECT_EQ(e.topology_text, "random_pairs(dwell 2..5)");
  EXPECT_EQ(e.links.standard.noise_covariance.rows(), 2);
  const LinkSpec& lossy = e.links.of(edge(2, 1));
  EXPECT_EQ(lossy.loss_probability, 1.0);
  EXPECT_EQ(lossy.delay_rounds, 1u);  // what an exception does not mention stays
  EXPECT_EQ(e.links.of(edge(2, 3)).loss_probability, 0.1);
  ASSERT_EQ(e.link_events.size(), 2u);
  EXPECT_EQ(e.link_events[0].edges, (std::vector{edge(1, 2), edge(2, 1)}));
  EXPECT_TRUE(e.link_events[1].heal);
  EXPECT_EQ(e.agents_per_process, 2u);
  EXPECT_EQ(e.convergence->for_rounds, 10u);
  EXPECT_EQ(e.deadline, 120.0);
  EXPECT_EQ(e.report_every, 7u);
  EXPECT_EQ(e.discovery, Discovery::neighbours);
  EXPECT_EQ(e.metrics, (std::vector<std::string>{"bias", "disagreement"}));  // a criterion's metric is measured too
}

TEST(Script, SaysWhatIsRecordedBesideTheEstimates) {
  EXPECT_FALSE(read(kPlain).recording.state);
  EXPECT_FALSE(read(kPlain).recording.graphs);
  const Experiment e = read(with("", "record: {state: true, graphs: false}"));
  EXPECT_EQ(e.recording.state, true);
  EXPECT_EQ(e.recording.graphs, false);
  const Experiment again = read(e.resolved_text);
  EXPECT_EQ(again.recording.state, true);
  EXPECT_EQ(again.recording.graphs, false);
  EXPECT_NE(mistakes_in(with("", "record: {state: all}")).find("e.yaml:10:17: record.state: found text 'all'; allowed: true or false"),
            std::string::npos)
      << mistakes_in(with("", "record: {state: all}"));
}

TEST(Script, FormatThatIsNewerIsRefusedBeforeAnythingElseIsRead) {
  EXPECT_EQ(mistakes_in(with("", "format: 1")), "");
  EXPECT_NE(read(kPlain).resolved_text.find("format: 1\n"), std::string::npos);
  const std::string newer = mistakes_in(with("", "format: 2\nsomething_new: 1"));
  EXPECT_EQ(newer, "e.yaml:10:9: format: found 2, a file for a newer consort; allowed: 1, the newest that this one reads");
  EXPECT_NE(mistakes_in(with("", "format: one")).find("format: found text 'one'; allowed: 1, or no such line"), std::string::npos);
  EXPECT_NE(mistakes_in(with("", "format: 0")).find("format: found"), std::string::npos);
}

TEST(Script, TakesOverridesOfTheCommandLine) {
  const Experiment e = read(with("", "events: [{round: 90, cut: [1 -> 2]}]"), {Mode::simulate, 5, 50, 3, 2});
  EXPECT_EQ(e.mode, Mode::simulate);
  EXPECT_EQ(e.seed.value, 5u);
  EXPECT_EQ(e.rounds, 50u);  // shorter than the last event: no mistake of the file
  EXPECT_EQ(e.runs, 3u);
  EXPECT_EQ(e.agents_per_process, 2u);
  EXPECT_THROW(read(kPlain, {.rounds = 0}), ConfigError);
  EXPECT_THROW(read(kPlain, {.agents_per_process = 4}), ConfigError);
}

TEST(Script, ReadsNumbersForEveryAgent) {
  EXPECT_EQ(initial(read(with_initial("{x: {linspace: [5, 7]}}")), 2, "x"), 6.0);
  EXPECT_EQ(initial(read(with_initial("{x: {linspace: [5, 7], dimension: 2}}")), 3, "x", 1), 7.0);
  EXPECT_EQ(initial(read(with_initial("{x: 2.5}")), 3, "x"), 2.5);
  const Experiment drawn = read(with_initial("{x: {uniform: [2, 3], dimension: 2}}"));
  for (std::uint32_t agent = 1; agent <= 3; ++agent) {
    EXPECT_GE(initial(drawn, agent, "x", 1), 2.0);
    EXPECT_LT(initial(drawn, agent, "x", 1), 3.0);
  }
  EXPECT_NE(initial(drawn, 1, "x"), initial(drawn, 2, "x"));
  EXPECT_EQ(initial(read(with_initial("{x: [010, 1e1, +.5]}")), 1, "x"), 10.0);  // decimal, never octal
}

TEST(Script, ReadsNumbersFromAFileAndPlacesItsMistakes) {
  const fs::path directory = fs::temp_directory_path() / ("consort_script_test_" + std::to_string(::getpid()));
  fs::create_directories(directory);
  const std::string text = with_initial("{x: {file: starts.csv}}");
  std::ofstream(directory / "starts.csv") << "# x, y\n1, 2\n\n3,4\n5, 6\n";
  const Experiment e = parse_experiment(text, "e.yaml", directory);
  EXPECT_EQ(initial(e, 3, "x", 1), 6.0);
  const auto told = [&](const std::string& content) {
    std::ofstream(directory / "starts.csv") << content;
    try {
      parse_experiment(text, "e.yaml", directory);
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "starts.csv:2:3: found 'two'; allowed: a finite number", told("1,2\n3,two\n5,6\n"));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "found 2 lines in 'starts.csv'; allowed: 3, one per agent", told("1\n2\n"));
  fs::remove_all(directory);
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "e.yaml:8:23: agents.initial.x.file: found 'starts.csv', which cannot be read",
                      mistakes_in(text));
}

TEST(Script, ReadsEveryTopology) {
  const auto topology = [](const std::string& t) { return read(with("topology: ring", "topology: " + t)); };
  EXPECT_EQ(edges_at(topology("directed_ring"), 0), (std::vector{edge(3, 1), edge(1, 2), edge(2, 3)}));
  EXPECT_EQ(edges_at(topology("complete"), 9).size(), 6u);
  EXPECT_EQ(edges_at(topology("star"), 0).size(), 4u);
  EXPECT_EQ(edges_at(topology("path"), 0).size(), 4u);
  EXPECT_EQ(edges_at(topology("{edges: [3 -> 1 -> 2, 2 <-> 3]}"), 0), (std::vector{edge(3, 1), edge(1, 2), edge(3, 2), edge(2, 3)}));
  const Experiment weighted = topology("{edges: [{edge: 1 -> 2, weight: 0.5}, 2 -> 1]}");
  EXPECT_EQ(weighted.schedule(weighted.seed).at(0)->in_neighbours(AgentId{2}).front().weight, 0.5);
  EXPECT_EQ(edges_at(topology("{adjacency: [[0, 0, 1], [1, 0, 0], [0, 1, 0]]}"), 0), edges_at(topology("directed_ring"), 0));
  EXPECT_EQ(edges_at(topology("{erdos_renyi: {p: 1}}"), 0).size(), 6u);
  EXPECT_EQ(edges_at(topology("{random_geometric: {radius: 2}}"), 0).size(), 6u);
  const Experiment intervals = topology("{intervals: [{rounds: 2, topology: directed_ring}, {rounds: 1, topology: complete}]}");
  EXPECT_EQ(edges_at(intervals, 1).size(), 3u);
  EXPECT_EQ(edges_at(intervals, 7).size(), 6u);
  const Experiment periodic = topology("{periodic: [{rounds: 2, topology: directed_ring}, {rounds: 1, topology: complete}]}");
  EXPECT_EQ(edges_at(periodic, 5).size(), 6u);
  EXPECT_EQ(edges_at(periodic, 6).size(), 3u);
  EXPECT_EQ(edges_at(topology("random_pairs"), 0).size(), 2u);
  EXPECT_EQ(edges_at(topology("{random_links: {base: complete, probability: 1}}"), 3).size(), 6u);
}

TEST(Script, GivesRandomGraphsTheSeedOfTheExperimentUnlessTheyNameOne) {
  const auto graph = [](const std::string& rule, std::uint64_t seed) {
    std::string text = with("topology: ring", "topology: {erdos_renyi: " + rule + "}");
    text.replace(text.find("count: 3"), 8, "count: 30").replace(text.find("[4, 5, 6]"), 9, "1");
    return edges_at(read(text, {.seed = seed}), 0);
  };
  EXPECT_NE(graph("{p: 0.5}", 1), graph("{p: 0.5}", 2));
  EXPECT_EQ(graph("{p: 0.5, seed: 1}", 2), graph("{p: 0.5}", 1));
}

TEST(Script, ReportsAllMistakesInOrderOfPlace) {
  const std::string told =
      mistakes_in("experiment: x\nmod: lockstep\nrounds: 0\nagents: {count: 3, protocol: local_votin}\ntopology: rng\n");
  std::istringstream lines(told);
  std::vector<std::string> starts;
  for (std::string line; std::getline(lines, line);) starts.push_back(line.substr(0, line.find(' ')));
  EXPECT_EQ(starts, (std::vector<std::string>{"e.yaml:2:1:", "e.yaml:3:9:", "e.yaml:4:30:", "e.yaml:5:11:"})) << told;
}

TEST(Script, SuggestsTheNearestWord) {
  EXPECT_MISTAKE("e.yaml:10:1: the experiment: found the unknown key 'runds'; allowed: experiment, mode", with("", "runds: 3"));
  EXPECT_MISTAKE("did you mean 'rounds'?", with("", "ronds: 3"));
  EXPECT_MISTAKE("e.yaml:9:11: topology: found text 'rnig'; allowed: directed_ring, ring", with("topology: ring", "topology: rnig"));
  EXPECT_MISTAKE("found text 'kalman_consenus'", with_protocol("  protocol: kalman_consenus"));
  EXPECT_MISTAKE("did you mean 'kalman_consensus'?", with_protocol("  protocol: kalman_consenus"));
  EXPECT_MISTAKE("found the unknown name 'q'; allowed: name, Q, Omega, self_term; did you mean 'Q'?",
                 with_protocol("  protocol: {name: kalman_consensus, q: 1}"));
  EXPECT_MISTAKE("found the unknown name 'p'; allowed: x, P; did you mean 'P'?", with_initial("{x: 1, p: 1}"));
  EXPECT_MISTAKE("found the unknown key 'linspaec'", with_initial("{x: {linspaec: [1, 2]}}"));
  EXPECT_MISTAKE("found text 'disagrement'", with("", "metrics: [disagrement]"));
  EXPECT_MISTAKE("e.yaml:10:12: criteria[0]: criterion: found the unknown metric 'disagrement'",
                 with("", "criteria: [\"disagrement < 1\"]"));
  EXPECT_MISTAKE("did you mean 'delay_rounds'?", with("", "links: {delay_round: 1}"));
}

TEST(Script, RefusesImpossibleValuesNamingWhatIsAllowed) {
  EXPECT_MISTAKE("e.yaml:6:10: agents.count: found 0; allowed: a whole number from 1", with("count: 3", "count: 0"));
  EXPECT_MISTAKE("agents.count: found -1;", with("count: 3", "count: -1"));
  EXPECT_MISTAKE("agents.count: found text '3';", with("count: 3", "count: \"3\""));
  EXPECT_MISTAKE("links.loss.bernoulli: found 1.5; allowed: a number from 0 to 1", with("", "links: {loss: {bernoulli: 1.5}}"));
  EXPECT_MISTAKE("links.loss: found -0.1; allowed: a number from 0 to 1", with("", "links: {loss: -0.1}"));
  EXPECT_MISTAKE("dt: found 0; allowed: a number above 0", with("", "dt: 0"));
  EXPECT_MISTAKE("dt: found text '.nan'", with("", "dt: .nan"));
  EXPECT_MISTAKE("links.noise_covariance: covariance 'noise_covariance' has the eigenvalue -1",
                 with("", "links: {noise_covariance: [[1, 2], [2, 1]]}"));
  EXPECT_MISTAKE("links: ", with("", "links: {noise_covariance: [1, 2]}"));  // two components, but x has one
  EXPECT_MISTAKE("e.yaml:8:16: agents.initial.x: found a list of 2; allowed: 3 entries, one per agent", with_initial("{x: [4, 5]}"));
  EXPECT_MISTAKE("found text '1 -> 11', and there is no agent 11", with("topology: ring", "topology: {edges: [1 -> 11]}"));
  EXPECT_MISTAKE("an edge from an agent to itself", with("topology: ring", "topology: {edges: [2 -> 2]}"));
  EXPECT_MISTAKE("found the edge 1 -> 2 a second time", with("topology: ring", "topology: {edges: [1 -> 2, 1 <-> 2]}"));
  EXPECT_MISTAKE("found a matrix 2 x 2; allowed: 3 x 3", with("topology: ring", "topology: {adjacency: [[0, 1], [1, 0]]}"));
  EXPECT_MISTAKE("found the schedule 'periodic' where one graph is needed",
                 with("topology: ring", "topology: {intervals: [{rounds: 1, topology: {periodic: [{rounds: 1, topology: ring}]}}]}"));
  EXPECT_MISTAKE("dwell_rounds: found a list of 2; allowed: [shortest, longest]",
                 with("topology: ring", "topology: {random_pairs: {dwell_rounds: [3, 1]}}"));
  EXPECT_MISTAKE("found 'erdos_renyi' without its parameters; allowed: {erdos_renyi: {p: 0.3",
                 with("topology: ring", "topology: erdos_renyi"));
  EXPECT_MISTAKE("events[0].round: found 100; allowed: a whole number from 0 to 99", with("", "events: [{round: 100, cut: [1 -> 2]}]"));
  EXPECT_MISTAKE("events[0]: found nothing; allowed: exactly one of cut, heal, set_link, degrade, join, leave",
                 with("", "events: [{round: 1}]"));
  EXPECT_MISTAKE("placement.agents_per_process: found 4; allowed: a whole number from 1 to 3",
                 with("", "placement: {agents_per_process: 4}"));
  EXPECT_MISTAKE("stop.deadline: found text '3 h'; allowed: a number of seconds above 0", with("", "stop: {deadline: 3 h}"));
  EXPECT_MISTAKE("agents.overrides: found 4; allowed: an agent from 1 to 3",
                 with("topology: ring", "  overrides: {4: {initial: {x: 1}}}\ntopology: ring"));
  EXPECT_MISTAKE("found a list of 1 as row 2; allowed: a matrix, rows of equal length (2 numbers as in row 1)",
                 with_protocol("  protocol: {name: kalman_consensus, Q: [[1, 2], [3]]}"));
  EXPECT_MISTAKE("found both 'protocol' and 'protocols'", with_protocol("  protocol: local_voting\n  protocols: [local_voting]"));
  EXPECT_MISTAKE("found 'local_voting' a second time", with_protocol("  protocols: [local_voting, local_voting]"));
  EXPECT_MISTAKE("agents.overrides.2.parameters: found the unknown name 'Q'; allowed: nothing",  // local_voting has no Q
                 with_protocol("  protocols: [local_voting, kalman_consensus]\n  overrides: {2: {parameters: {Q: 1}}}"));
  EXPECT_MISTAKE("experiment: found text 'a b'; allowed: a name of letters", with("experiment: plain", "experiment: a b"));
}

TEST(Script, HearsTheProtocolsObjectionsAtTheValuesPlace) {
  EXPECT_MISTAKE("e.yaml:8:34: agents: agent 1 with kalman_consensus: covariance 'P' is 3 x 1",
                 with_initial("{x: {all: [1, 2]}, P: {all: [1, 2, 3]}}"));
  EXPECT_MISTAKE("e.yaml:8:22: agents: agent 1 with kalman_consensus: covariance 'P'", with_initial("{x: 1, P: -1}"));
  EXPECT_MISTAKE("e.yaml:9:32: agents: agent 2 with kalman_consensus: covariance 'P'",
                 with("topology: ring", "  overrides: {2: {initial: {P: [[1, 2], [2, 1]]}}}\ntopology: ring"));
  EXPECT_MISTAKE("found 2 components at agent 3 and 1 at agent 1; allowed: the same for all agents", with_initial("{x: [1, 2, [3, 4]]}"));
  EXPECT_MISTAKE("e.yaml:7:41: agents: agent 1 with kalman_consensus: ", with_protocol("  protocol: {name: kalman_consensus, Q: [1, 2]}"));
  EXPECT_MISTAKE("has no initial x", with_initial("{P: 1}"));
}

TEST(Script, WhatTheRecordCannotHoldIsRefusedAtItsPlace) {
  const std::string voting = "experiment: e\ntopology: ring\nagents:\n  count: 3\n  protocol: local_voting\n";
  const auto of = [&](int dimension) { return "  initial: {x: {linspace: [0, 1], dimension: " + std::to_string(dimension) + "}}\n"; };
  EXPECT_EQ(mistakes_in(voting + of(1900)), "");
  EXPECT_EQ(mistakes_in(voting + of(1901)),
            "e.yaml:6:16: agents: found an initial x of 1901 components; allowed: up to 1900, as many as the record holds");
  // 44 estimated, 44 * 44 beside them, if all is asked for.
  const std::string kalman = "experiment: e\ntopology: ring\nagents:\n  count: 3\n  protocol: kalman_consensus\n";
  EXPECT_EQ(mistakes_in(kalman + of(44)), "");
  const std::string wide = mistakes_in(kalman + of(44) + "record: {state: true}\n");
  EXPECT_NE(wide.find("e.yaml:5:13: agents: agent 1 with kalman_consensus: found 1980 numbers of an agent to record (44 estimated, 1936 "
                      "beside); allowed: 1900, so fewer components, or `record: {state: false}`"),
            std::string::npos)
      << wide;
}

TEST(Script, SeedsOfLaterRunsAreHeardAtTheValuesPlaceToo) {
  const std::string text =
      "experiment: e\ntopology: ring\nruns: 300\nagents:\n  count: 3\n  protocol: kalman_consensus\n"
      "  initial:\n    x: 1\n    P: {uniform: [-0.02, 1]}\n";
  const std::string mistake = mistakes_in(text);
  EXPECT_EQ(mistake.find("e.yaml:9:8: agents: agent "), 0u) << mistake;
  EXPECT_NE(mistake.find(" with kalman_consensus in the run with seed "), std::string::npos) << mistake;
}

TEST(Script, RefusesWhatIsNotAnExperiment) {
  EXPECT_MISTAKE("e.yaml:1:13: found '[' that is not closed; allowed: a ']' for it", "experiment: [a\nagents: {");
  EXPECT_MISTAKE("e.yaml:1:1: found an empty file", "");
  EXPECT_MISTAKE("e.yaml:1:1: the experiment: found text 'hello'; allowed: a mapping", "hello");
  EXPECT_MISTAKE("e.yaml:10:1: found the key 'topology' a second time (first in line 9); allowed: each key once",
                 with("", "topology: star"));
  EXPECT_MISTAKE("found no 'agents'; allowed: it must be given", "experiment: x\ntopology: ring\n");
  EXPECT_THROW(load_experiment("/nowhere/e.yaml"), ConfigError);
  EXPECT_THROW(load_experiment("/"), ConfigError);
}

TEST(Script, ResolvesToATextThatGivesTheSameExperimentAgain) {
  std::vector<std::string> texts{kPlain};
  for (const char* t :
       {"{edges: [1 -> 2 -> 3, {edge: 3 -> 1, weight: 0.1}]}", "{adjacency: [[0, 0.3, 1], [1, 0, 0], [0, 1, 0]]}",
        "{random_geometric: {radius: 0.7}}", "{erdos_renyi: {p: 0.123456789012345678, directed: true}}",
        "{periodic: [{rounds: 2, topology: star}, {rounds: 1, topology: {erdos_renyi: {p: 0.5}}}]}",
        "{intervals: [{rounds: 2, topology: path}]}", "random_pairs", "{random_links: {base: {erdos_renyi: {p: 0.5}}, probability: 0.1}}"})
    texts.push_back(with("topology: ring", std::string("topology: ") + t));
  texts.push_back(with_initial("{x: {uniform: [0.1, 0.7], dimension: 3}, P: {all: [[1, 0.1, 0], [0.1, 1, 0], [0, 0, 1]]}}"));
  texts.push_back(with_initial("{x: [[1, 2], [3, 4], [5, 6]], P: {linspace: [1, 2]}}"));
  texts.push_back(with("",
                       "links: {loss: 0.1, overrides: [{edge: 1 -> 2, noise_covariance: 0.1}]}\nevents: [{round: 3, cut: [1 <-> 2]}, "
                       "{round: 5, heal: [2 -> 1]}]\n"
                       "stop: {converged: {disagreement: 1.0e-7}, deadline: 500 ms}\ntelemetry: {every: 3}\nmetrics: [bias]\ncriteria: "
                       "[\"abs(bias) < 3 && rounds > 1\"]"));
  for (const auto& text : texts) {
    SCOPED_TRACE(text);
    const Experiment first = read(text, {.seed = 42});
    const Experiment again = read(first.resolved_text);
    EXPECT_EQ(again.resolved_text, first.resolved_text);
    EXPECT_EQ(again.description, first.description);
    EXPECT_EQ(again.seed, first.seed);
    EXPECT_EQ(again.deadline, first.deadline);
    EXPECT_EQ(again.topology_text, first.topology_text);
    for (const Round k : {0u, 1u, 4u, 50u}) EXPECT_EQ(*again.schedule(again.seed).at(k), *first.schedule(first.seed).at(k));
    for (std::uint32_t agent = 1; agent <= 3; ++agent) {
      const Values before = first.initial_of(AgentId{agent}, first.seed), after = again.initial_of(AgentId{agent}, again.seed);
      for (const auto& entry : before.entries()) EXPECT_EQ(*after.find(entry.name), entry.value);
    }
  }
}

TEST(Schema, ExplainsEveryKey) {
  const auto schema = nlohmann::json::parse(experiment_schema());
  std::size_t keys = 0;
  const std::function<void(const nlohmann::json&, const std::string&)> visit = [&](const nlohmann::json& at, const std::string& path) {
    if (at.is_object() && at.contains("properties") && at["properties"].is_object()) {
      for (const auto& [key, value] : at["properties"].items()) {
        const auto& described =
            value.contains("$ref") ? schema.at(nlohmann::json::json_pointer(value["$ref"].get<std::string>().substr(1))) : value;
        for (const char* part : {"title", "description", "examples"})
          EXPECT_TRUE(described.contains(part)) << path << "." << key << " has no " << part;
        ++keys;
      }
    }
    if (at.is_structured())
      for (const auto& [key, value] : at.items()) visit(value, path + "/" + key);
  };
  visit(schema, "");
  EXPECT_GT(keys, 50u);
}

TEST(Schema, NamesTheSameTopologiesAsTheReader) {
  const auto schema = nlohmann::json::parse(experiment_schema());
  std::vector<std::string> known = schema["definitions"]["topology"]["oneOf"][0]["enum"];
  for (const auto& [key, value] : schema["definitions"]["topology_rule"]["properties"].items()) known.push_back(key);
  std::sort(known.begin(), known.end());
  known.erase(std::unique(known.begin(), known.end()), known.end());
  std::vector<std::string> listed;
  for (const auto& entry : topology_table()) listed.emplace_back(entry.name);
  std::sort(listed.begin(), listed.end());
  EXPECT_EQ(known, listed);
}

TEST(Wording, SwappedLettersAreOneMistake) {
  EXPECT_EQ(word_distance("ruonds", "rounds"), 1u);
  EXPECT_EQ(word_distance("", "abc"), 3u);
  EXPECT_EQ(word_distance("kitten", "sitting"), 3u);
  EXPECT_EQ(word_distance("ca", "abc"), 3u) << "no character moves twice";
}

TEST(Wording, ABeginningOfAWordOrOfAPartOfItIsNear) {
  const std::vector<std::string> protocols{"kim", "local_voting", "kalman_consensus", "unbiased_kalman_consensus"};
  EXPECT_EQ(did_you_mean("klman", protocols), "; did you mean 'kalman_consensus'?");
  EXPECT_EQ(did_you_mean("votign", protocols), "; did you mean 'local_voting'?");
  EXPECT_EQ(did_you_mean("unbiased", protocols), "; did you mean 'unbiased_kalman_consensus'?");
  EXPECT_EQ(did_you_mean("kin", protocols), "; did you mean 'kim'?");
}

TEST(Wording, SuggestsOnlyWhatIsClose) {
  const std::vector<std::string> words{"rounds", "runs", "Q"};
  EXPECT_EQ(did_you_mean("ruonds", words), "; did you mean 'rounds'?");
  EXPECT_EQ(did_you_mean("RUNS", words), "; did you mean 'runs'?");
  EXPECT_EQ(did_you_mean("q", words), "; did you mean 'Q'?");
  EXPECT_EQ(did_you_mean("z", words), "");
  EXPECT_EQ(did_you_mean("topology", words), "");
  EXPECT_EQ(did_you_mean("x", {}), "");
}

TEST(Script, TextThatIsNotUtf8IsRefusedWithItsPlace) {
  for (const char* broken : {"\x8d", "\xc3(", "\xe0\x80\x80", "\xed\xa0\x80", "\xf5\x80\x80\x80", "\xf0\x9f"}) {
    try {
      parse_experiment(std::string("experiment: e\ncriteria: [\"") + broken + "\"]\n", "e.yaml", ".");
      ADD_FAILURE() << "accepted";
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find("e.yaml:2:13: found a byte that is not UTF-8"), std::string::npos) << error.what();
    }
  }
}

TEST(Script, NobodyComesToTheEndOfARunThatTheCommandLineShortened) {
  const std::string text =
      "experiment: e\nrounds: 30\nagents: {count: 3, protocol: local_voting, initial: {x: 1}}\ntopology: ring\n"
      "events: [{round: 5, kill: 3}, {round: 20, restart: 3}, {round: 20, join: 2}]\n";
  for (const Round rounds : {10u, 19u, 20u}) {
    const Experiment e = read(text, {.rounds = rounds});
    for (Round k = 6; k <= rounds; ++k)
      for (const std::uint32_t agent : {2u, 3u}) EXPECT_FALSE(e.presence_of(AgentId{agent}).holds(k)) << agent << " in " << k;
  }
  EXPECT_TRUE(read(text, {.rounds = 21}).presence_of(AgentId{3}).holds(20));
}

}  // namespace
}  // namespace consort
