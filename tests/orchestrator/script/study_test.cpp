#include "orchestrator/script/study.hpp"

#include "core/errors.hpp"
#include "orchestrator/script/script.hpp"
#include "orchestrator/script/study_criteria.hpp"

#include <gtest/gtest.h>

#include <functional>

namespace consort {
namespace {

const std::string kRing = R"(experiment: ring
rounds: 40
dt: 0.1
agents: {count: 4, protocol: local_voting, initial: {x: {linspace: [0, 3]}}}
topology: ring
links: {delay_rounds: 1}
)";

Study study(const std::string& more, std::vector<std::string> sets = {}, bool zipped = false) {
  return study_of(kRing + more, "e.yaml", sets, zipped);
}

std::vector<std::string> labels(const Study& study) {
  std::vector<std::string> out;
  for (const Cell& cell : study.cells) out.push_back(cell.label());
  return out;
}

Experiment cell(const std::string& more, const Study& study, std::size_t number) {
  ScriptOverrides overrides;
  overrides.settings = study.fixed;
  overrides.cell = study.cells.at(number);
  return parse_experiment(kRing + more, "e.yaml", ".", overrides);
}

void expect_told(const std::function<void()>& done, const std::string& part) {
  try {
    done();
    ADD_FAILURE() << "nothing was said of: " << part;
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what() << "\nlacks: " << part;
  }
}

TEST(Study, IsEachValueWithEachOfAnyKey) {
  const std::string sweep = "sweep:\n  agents.count: [4, 6]\n  topology: {ring: ring, all: complete}\n  dt: linspace(0.1, 0.3, 3)\n";
  const Study grid = study(sweep);
  EXPECT_FALSE(grid.within_a_run);
  ASSERT_EQ(grid.cells.size(), 12U);
  EXPECT_EQ(grid.cells[0].label(), "count_4.ring.dt_0.1");
  EXPECT_EQ(grid.cells[11].label(), "count_6.all.dt_0.3");
  const Experiment last = cell(sweep, grid, 11);
  EXPECT_EQ(last.agents, 6U);
  EXPECT_EQ(last.dt, 0.3);
  EXPECT_EQ(last.protocols.front().title(), "local_voting.count_6.all.dt_0.3");
  EXPECT_EQ(last.links_of(last.protocols.front()).standard.delay_rounds, 1U);
  EXPECT_NE(cell(sweep, grid, 1).resolved_text, cell(sweep, grid, 2).resolved_text);
  EXPECT_EQ(parse_experiment(kRing + sweep, "e.yaml", ".").resolved_text, cell(sweep, grid, 0).resolved_text)
      << "without a cell: the first";
}

TEST(Study, IsWithinARunWhereTheFileSweepsTheLinksAlone) {
  EXPECT_TRUE(study("").within_a_run);
  EXPECT_TRUE(study("sweep: {links.loss: [0, 0.5]}\n").within_a_run);
  EXPECT_FALSE(study("sweep: {links.loss: [0, 0.5]}\n", {"dt=0.1,0.2"}).within_a_run);
  EXPECT_EQ(study("sweep: {links.loss: [0, 0.5]}\n").cells.size(), 2U) << "for whoever wants cells of it";
  ScriptOverrides overrides;
  overrides.settings = study("sweep: {links.loss: [0, 0.5]}\n", {"links.loss=0.25"}).fixed;
  const Experiment set = parse_experiment(kRing + "sweep: {links.loss: [0, 0.5]}\n", "e.yaml", ".", overrides);
  EXPECT_EQ(set.links.standard.loss_probability, 0.25);
  EXPECT_EQ(set.protocols.size(), 1U) << "what the command line sets, the file does not sweep";
}

TEST(Study, TakesValuesTogetherWhereTheyAreZipped) {
  EXPECT_EQ(labels(study("sweep: {zip: {dt: [0.1, 0.2], rounds: [20, 10]}, seed: [1, 2]}\n")),
            (std::vector<std::string>{"dt_0.1.rounds_20.seed_1", "dt_0.1.rounds_20.seed_2", "dt_0.2.rounds_10.seed_1",
                                      "dt_0.2.rounds_10.seed_2"}));
  EXPECT_EQ(labels(study("", {"dt=0.1,0.2", "rounds=20,10"}, true)), (std::vector<std::string>{"dt_0.1.rounds_20", "dt_0.2.rounds_10"}));
  EXPECT_EQ(study("", {"dt=0.1,0.2", "rounds=20,10"}).cells.size(), 4U);
  EXPECT_EQ(labels(study("sweep: {zip: {topology: [ring, ring], dt: [0.1, 0.2]}}\n")),
            (std::vector<std::string>{"topology_ring.dt_0.1", "topology_ring.dt_0.2"}));
  expect_told([] { study("sweep: {zip: {topology: [ring, ring], dt: [0.1, 0.1]}}\n"); }, "found topology_ring.dt_0.1 a second time");
  expect_told([] { study("", {"dt=0.1,0.2", "rounds=1,2,3"}, true); }, "--zip: found unequal numbers of values: dt has 2, rounds has 3");
  expect_told([] { study("sweep: {zip: {dt: [1, 2], seed: [1, 2, 3]}}\n"); }, "e.yaml:7:14: sweep.zip: found unequal numbers");
}

TEST(Study, SpacesNumbersEvenlyOrInTheSameRatio) {
  EXPECT_EQ(labels(study("", {"links.loss=linspace(0, 0.4, 5)"})),
            (std::vector<std::string>{"loss_0", "loss_0.1", "loss_0.2", "loss_0.3", "loss_0.4"}));
  EXPECT_EQ(labels(study("sweep: {agents.count: {logspace: [10, 1000, 3]}}\n")),
            (std::vector<std::string>{"count_10", "count_100", "count_1000"}));
  expect_told([] { study("", {"dt=logspace(0, 1, 3)"}); },
              "allowed: logspace(first, last, how many), two to 1000 numbers, first and last above 0");
  expect_told([] { study("sweep: {dt: {linspace: [0, 1]}}\n"); }, "e.yaml:7:13: sweep.dt: found a mapping; allowed: linspace(");
}

TEST(Study, SetsWhatMayStandInTheFile) {
  const Study one =
      study("", {"agents.protocol=robust_information_consensus", "links.loss={bernoulli: 0.5}", "agents.initial.x=[[1, 2, 3, 4]]"});
  EXPECT_TRUE(one.within_a_run);
  ScriptOverrides overrides;
  overrides.settings = one.fixed;
  const Experiment e = parse_experiment(kRing, "e.yaml", ".", overrides);
  EXPECT_EQ(e.protocols.front().title(), "robust_information_consensus");
  EXPECT_EQ(e.links.standard.loss_probability, 0.5);
  EXPECT_EQ(e.links.standard.delay_rounds, 1U) << "what was not set stays";
  const Study protocols = study("", {"agents.protocol=local_voting,{name: kalman_consensus, Q: 1, Omega: 1}"});
  EXPECT_EQ(labels(protocols), (std::vector<std::string>{"protocol_local_voting", "protocol_2"}));
  const std::string two = "x-rest: 1\n";
  const Study duration = study(two, {"duration=2 s"});
  overrides.settings = duration.fixed;
  EXPECT_EQ(parse_experiment(kRing + two, "e.yaml", ".", overrides).rounds, 20U) << "instead of rounds";
}

TEST(Study, ReachesEntriesOfListsAndParametersOfAProtocolThatIsItsNameAlone) {
  Setting setting{"agents.protocols.2.Q", "2", "", {}, -1, -1};
  const YAML::Node document = YAML::Load("agents: {protocols: [local_voting, {name: kalman_consensus, Q: 1}]}");
  EXPECT_EQ(script::with_setting(document, setting)["agents"]["protocols"][1]["Q"].as<int>(), 2);
  EXPECT_EQ(document["agents"]["protocols"][1]["Q"].as<int>(), 1) << "the document is as it was";
  setting.key = "agents.protocols.3.Q";
  expect_told([&] { script::with_setting(document, setting); }, "agents.protocols.3.Q: found entry '3' of a list of 2; allowed: 1 to 2");
  setting.key = "agents.protocol.Q";
  const YAML::Node named = script::with_setting(YAML::Load("agents: {protocol: kalman_consensus}"), setting);
  EXPECT_EQ(named["agents"]["protocol"]["name"].Scalar(), "kalman_consensus");
  EXPECT_EQ(named["agents"]["protocol"]["Q"].as<int>(), 2);
  const YAML::Node shared = script::with_setting(YAML::Load("a: &a {x: 1}\nb: *a"), {"a.x", "2", "", {}, -1, -1});
  EXPECT_EQ(shared["b"]["x"].as<int>(), 1) << "an alias is not what is set";
}

TEST(Study, NamesThePlaceOfAValueThatDoesNotFit) {
  const std::string sweep = "sweep:\n  dt: [0.1, 0.2]\n  links.loss: [0, 1.5]\n";
  expect_told([&] { cell(sweep, study(sweep), 1); }, "e.yaml:9:19: links.loss: found 1.5; allowed: a number from 0 to 1");
  const std::string unknown = "sweep:\n  agents.cuont: [3, 4]\n";
  expect_told([&] { cell(unknown, study(unknown), 0); }, "e.yaml:8:18: agents: found the unknown key 'cuont'");
  expect_told([] { cell("", study("", {"links.loss=0,1.5"}), 1); }, "--set: links.loss: found 1.5");
  const std::string deep = std::string(300, '.');
  expect_told([&] { cell("", study("", {deep + "=1,2"}), 0); }, "allowed: one of this file, with dots, of up to 200 characters");
  expect_told([] { study("", {"dt"}); }, "--set: found 'dt'; allowed: KEY=VALUES");
  expect_told([] { study("", {"dt=[1, 2"}); }, "--set dt:1:");
  expect_told([] { study("", {"dt=1,1"}); }, "found the name 'dt_1' a second time");
  expect_told([] { study("sweep: {dt: [1, 2], zip: {dt: [1, 2], seed: [1, 2]}}\n"); }, "e.yaml:7:8: sweep: found dt a second time");
  expect_told([] { study("", {"seed=linspace(1, 1000, 1000)", "dt=linspace(1, 2, 1000)"}); }, "found 1000000 cells; allowed: up to 100000");
}

TEST(Study, JudgesMetricsOfItsCells) {
  const std::string sweep =
      "sweep: {dt: [0.1, 0.15]}\nmetrics: [spread]\ncriteria: ['local_voting.dt_0.15.bias < local_voting.dt_0.1.bias']\n";
  const Study two = study(sweep);
  const std::map<std::string, std::size_t> cells{{"local_voting.dt_0.1", 0}, {"local_voting.dt_0.15", 1}};
  const auto read = [&](std::size_t number) { return cell(sweep, two, number); };
  check_study_criteria(two, "e.yaml", cells, read);
  Study every = two;
  every.criteria = {{"disagreement < 1 and bias < 1", 8, 11}};
  check_study_criteria(every, "e.yaml", cells, read);
  EXPECT_TRUE(names_a_cell(two.criteria[0].text, cells));
  EXPECT_FALSE(names_a_cell(every.criteria[0].text, cells)) << "it is of every cell";
  EXPECT_EQ(read(0).metrics, (std::vector<std::string>{"spread", "bias"})) << "what a criterion names is computed";
  EXPECT_TRUE(read(0).criteria.empty()) << "they are over all cells";
  Study wrong = two;
  wrong.criteria = {{"local_voting.dt_0.2.bias < 1", 8, 11}};
  expect_told([&] { check_study_criteria(wrong, "e.yaml", cells, read); },
              "e.yaml:9:12: criteria[0]: criterion: found the unknown metric 'local_voting.dt_0.2.bias'");
  wrong.criteria = {{"local_voting.dt_0.1.bais < local_voting.dt_0.3.bias", 8, 11}};
  expect_told([&] { check_study_criteria(wrong, "e.yaml", cells, read); }, "found 'local_voting.dt_0.3.bias', which is of no cell");
  wrong.criteria = {{"local_voting.dt_0.1.bais < 1", 8, 11}};
  expect_told([&] { check_study_criteria(wrong, "e.yaml", cells, read); }, "did you mean 'local_voting.dt_0.1.bias'?");
  wrong.criteria = {{"local_voting.dt_0.1.bias.std < 1", 8, 11}};
  expect_told([&] { check_study_criteria(wrong, "e.yaml", cells, read); }, "which a single run does not have");
}

}  // namespace
}  // namespace consort
