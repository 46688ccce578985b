#include "orchestrator/run/ending.hpp"

#include "orchestrator/report/results.hpp"
#include "orchestrator/report/table.hpp"
#include "orchestrator/run/collector.hpp"
#include "orchestrator/script/criteria.hpp"
#include "orchestrator/script/script.hpp"
#include "tests/orchestrator/folder.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace consort {
namespace {

using Absence = AgentEnd::Absence;

AgentEnd end_of(std::uint32_t agent, Round reached, Round asked, Absence absence = Absence::none) {
  return {AgentId{agent}, reached, asked, absence};
}

TEST(Completeness, ARunThatCameToItsEndIsCompleteWhoeverWasAbsent) {
  for (const Ending ending : {Ending::last_round, Ending::stop_rule, Ending::nobody_left}) {
    const Completeness result = completeness({ending, {end_of(1, 40, 600)}, 40}, 40, 600);
    EXPECT_TRUE(result.complete) << name_of(ending);
    EXPECT_TRUE(result.missing.empty() && result.words.empty());
  }
}

TEST(Completeness, WhoDidNotReportTheLastRoundIsNamedWithItsRounds) {
  const RunEnd end{Ending::out_of_time, {end_of(1, 600, 600), end_of(2, 146, 600), end_of(3, 146, 600), end_of(4, 0, 600)}, 600};
  const Completeness result = completeness(end, 600, 600);
  EXPECT_FALSE(result.complete);
  EXPECT_EQ(result.missing, (std::vector<std::uint32_t>{2, 3, 4}));
  EXPECT_NE(result.words.find("agents 2-3 reached round 146 of 600, agent 4 reached round 0 of 600"), std::string::npos) << result.words;
}

TEST(Completeness, DeadlineSignalAndFailureAreIncompleteToo) {
  for (const Ending ending : {Ending::deadline, Ending::signal, Ending::failure})
    EXPECT_FALSE(completeness({ending, {}}, 40, 600).complete) << name_of(ending);
}

TEST(Completeness, WhoWasAbsentByPlanOrGivenUpIsNoCulprit) {
  const RunEnd end{Ending::out_of_time,
                   {end_of(1, 0, 0, Absence::awaited), end_of(2, 50, 60, Absence::killed), end_of(3, 80, 600, Absence::given_up),
                    end_of(4, 60, 60, Absence::left), end_of(5, 20, 60, Absence::left), end_of(6, 500, 600)}};
  EXPECT_EQ(completeness(end, 20, 600).missing, (std::vector<std::uint32_t>{5, 6})) << "agent 5 fell silent before it was to leave";
}

TEST(Completeness, APlantThatFellSilentIsNamed) {
  const Completeness result = completeness({Ending::out_of_time, {end_of(1, 600, 600)}, 30}, 30, 600);
  EXPECT_EQ(result.missing, std::vector<std::uint32_t>{0});
  EXPECT_NE(result.words.find("the plant reached round 30 of 600"), std::string::npos) << result.words;
}

Experiment with_presence() {
  return parse_experiment(R"(
experiment: comings
rounds: 100
agents: {count: 6, protocol: local_voting, initial: {x: [0, 1, 2, 3, 4, 5]}}
topology: complete
events: [{round: 30, leave: 2}, {round: 30, kill: 3}, {round: 60, join: 4}, {round: 20, leave: 5}, {round: 50, join: 5},
         {round: 40, kill: 6}, {round: 80, restart: 6}]
)",
                          "comings.yaml", ".");
}

TEST(AgentsByPlan, SayWhoWasToReachWhat) {
  const auto ends = agents_by_plan(with_presence(), 100);
  const auto is = [&](std::uint32_t agent, Round reached, Round asked, Absence absence) {
    const AgentEnd& end = ends.at(agent - 1);
    EXPECT_TRUE(end.reached == reached && end.asked == asked && end.absence == absence)
        << "agent " << agent << " reached " << end.reached << " of " << end.asked << ", " << name_of(end.absence);
  };
  is(1, 100, 100, Absence::none);
  is(2, 30, 30, Absence::left);
  is(3, 30, 30, Absence::killed);
  is(4, 100, 100, Absence::none);
  is(5, 100, 100, Absence::none);
  is(6, 100, 100, Absence::none);
}

TEST(AgentsByPlan, OfARunThatEndedEarlierKnowWhoWasStillToCome) {
  const auto ends = agents_by_plan(with_presence(), 45);
  EXPECT_EQ(ends[3].absence, Absence::awaited);
  EXPECT_EQ(ends[3].reached, 0u);
  EXPECT_EQ(ends[4].absence, Absence::awaited) << "it left, and was to come back";
  EXPECT_EQ(ends[4].reached, 20u);
  EXPECT_EQ(ends[4].asked, 100u);
}

TEST(AgentsByPlan, AreToldInGroups) {
  const auto lines = told({end_of(1, 30, 30, Absence::left),
                           end_of(2, 30, 30, Absence::left),
                           {AgentId{3}, 100, 100, Absence::none, 12},
                           end_of(4, 81, 100, Absence::given_up),
                           end_of(5, 100, 100)});
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0], "agents 1-2: left in round 30, as planned");
  EXPECT_EQ(lines[1], "agent 3: slept through 12 rounds");
  EXPECT_EQ(lines[2], "agent 4: died and was given up after round 81");
}

TEST(AgentsByPlan, OfSeveralRunsTheWorstCounts) {
  std::vector<AgentEnd> all;
  merge(all, {{AgentId{1}, 100, 100, Absence::none, 3}});
  merge(all, {{AgentId{1}, 40, 100, Absence::given_up, 4}});
  EXPECT_EQ(all.at(0).reached, 40u);
  EXPECT_EQ(all.at(0).slept, 7u);
  EXPECT_EQ(all.at(0).absence, Absence::given_up);
}

/// As a real-time run whose agent 2 has a clock half a minute behind leaves it: it told of its first estimate, and then of nothing.
TEST(Completeness, AProcessWhoseClockIsBehindMakesARealTimeRunIncomplete) {
  const Experiment experiment = parse_experiment(R"(
experiment: late
mode: realtime
rounds: 100
agents: {count: 2, protocol: local_voting, initial: {x: [0, 1]}}
topology: complete
criteria: ["disagreement < 10", "rounds < 1000"]
)",
                                                 "late.yaml", ".");
  Collector collector(2, 1, 100, 50);
  collector.add({AgentId{1}, {0, 50, 100}, {0.0, 1.0, 2.0}, {1, 2, 3}, {{}, {}, {}}});
  collector.add({AgentId{2}, {0}, {1.0}, {1}, {{}}});
  JobOutcome outcome{{0, 0, Seed{1}}, {}, 1.0};
  outcome.trace.agents = 2;
  outcome.trace.dimension = 1;
  outcome.trace.estimate_layout = {{{"x", 1, 1}}, 0, 0};
  collector.hand_on([&](const RoundReport& report) {
    outcome.trace.add(report);
    return true;
  });
  EXPECT_EQ(outcome.trace.last_round, 0u) << "what all have reported";
  outcome.end = {Ending::out_of_time, agents_by_plan(experiment, 100)};
  for (AgentEnd& agent : outcome.end.agents) agent.reached = collector.reached(agent.agent);

  Results results(experiment, "out");
  results.add(outcome);
  const Summary summary = results.summary({}, Exit::ok, "");
  EXPECT_EQ(summary.exit, Exit::run_failed);
  EXPECT_FALSE(summary.complete);
  EXPECT_FALSE(summary.passed());
  EXPECT_EQ(summary.missing, std::vector<std::uint32_t>{2});
  const auto json = nlohmann::json::parse(to_json(summary));
  EXPECT_EQ(json["complete"], false);
  EXPECT_EQ(json["ending"], "out_of_time");
  EXPECT_EQ(json["missing"], nlohmann::json::array({2}));
  EXPECT_EQ(json["agents"][1]["reached"], 0);
  EXPECT_EQ(json["agents"][1]["asked"], 100);
  ASSERT_EQ(json["criteria"].size(), 2u);
  EXPECT_EQ(json["criteria"][0]["value"], 1.0) << "shown";
  EXPECT_TRUE(json["criteria"][0]["met"].is_null()) << "but not passed";
  TextStyle plain;
  plain.unicode = false;
  const std::string table = render(summary, plain);
  EXPECT_NE(table.find("INCOMPLETE"), std::string::npos) << table;
  EXPECT_NE(table.find("agent 2 reached round 0 of 100"), std::string::npos) << table;
  EXPECT_EQ(table.find("PASSED"), std::string::npos) << table;
}

TEST(Completeness, RunsOfASessionThatNeverBeganMakeItIncomplete) {
  Experiment experiment = with_presence();
  experiment.runs = 3;
  Results results(experiment, "out");
  const Summary summary = results.summary({}, Exit::timed_out, "nobody came");
  EXPECT_FALSE(summary.complete);
  EXPECT_EQ(summary.exit, Exit::timed_out);
  ASSERT_EQ(summary.ends.size(), 6u);
  EXPECT_EQ(summary.ends[0].reached, 0u);
}

}  // namespace
}  // namespace consort
