/// Who may take part in a run, and what is said to those who may not.

#include "orchestrator/run/roster.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

using Standing = Roster::Standing;
using Departure = Roster::Departure;

std::vector<AgentId> agents(std::uint32_t first, std::uint32_t last) {
  std::vector<AgentId> ids;
  for (std::uint32_t id = first; id <= last; ++id) ids.push_back(AgentId{id});
  return ids;
}

/// Agent 1 is launched, 2 and 3 together and the plant are not.
Roster roster() {
  Roster result({{"agent-1", agents(1, 1), false}, {"agent-2-3", agents(2, 3), true}, {"plant", {}, true}}, "here", "Consort 2");
  result.launched(0, 100);
  return result;
}

Newcomer newcomer(const std::string& id, std::vector<AgentId> hosted, std::uint64_t pid = 7, const std::string& host = "there") {
  return {id, std::move(hosted), host, pid, true, "Consort 2"};
}

void expect_refused(const Roster::Verdict& verdict, const std::vector<std::string>& words) {
  EXPECT_EQ(verdict.standing, Standing::refused);
  for (const std::string& word : words) EXPECT_NE(verdict.why.find(word), std::string::npos) << word << " in: " << verdict.why;
}

TEST(Roster, WhoComesFirstHoldsAPlaceThatIsNotLaunched) {
  Roster run = roster();
  const auto first = run.judge(newcomer("a", agents(2, 3)));
  EXPECT_EQ(first.standing, Standing::member);
  EXPECT_EQ(first.place, 1u);
  EXPECT_TRUE(first.first);
  EXPECT_EQ(run.judge(newcomer("p", {})).place, 2u) << "the plant";
  EXPECT_FALSE(run.judge(newcomer("a", agents(2, 3))).first);
  EXPECT_EQ(run.place_of("a"), 1u);
  EXPECT_EQ(run.place_of("x"), std::nullopt);
}

TEST(Roster, ASecondOneIsRefusedByNameAndStaysRefused) {
  Roster run = roster();
  run.judge(newcomer("a", agents(2, 3), 7, "there"));
  const auto second = run.judge(newcomer("b", agents(2, 3), 8, "elsewhere"));
  expect_refused(second, {"agents 2-3", "pid 7 on there", "other ids"});
  EXPECT_TRUE(second.first);
  EXPECT_FALSE(run.judge(newcomer("b", agents(2, 3), 8, "elsewhere")).first) << "it is told once";
  run.vacate(1, Departure::left);
  expect_refused(run.judge(newcomer("b", agents(2, 3), 8, "elsewhere")), {"pid 7"});
}

TEST(Roster, APlaceThatIsLaunchedIsForTheProcessThatWasLaunched) {
  Roster run = roster();
  expect_refused(run.judge(newcomer("x", agents(1, 1), 8, "here")), {"agent 1", "pid 100 on here", "--external 1"});
  expect_refused(run.judge(newcomer("y", agents(1, 1), 100, "there")), {"--external 1"});
  EXPECT_EQ(run.judge(newcomer("a", agents(1, 1), 100, "here")).standing, Standing::member);
}

TEST(Roster, ARestartedProcessTakesThePlaceOfTheOneThatWasKilled) {
  Roster run = roster();
  EXPECT_EQ(run.judge(newcomer("a", agents(1, 1), 100, "here")).standing, Standing::member);
  run.vacate(0, Departure::killed);
  EXPECT_EQ(run.judge(newcomer("a", agents(1, 1), 100, "here")).standing, Standing::former) << "its last words come late";
  expect_refused(run.judge(newcomer("x", agents(1, 1), 55, "here")), {"agent 1 was killed, as the experiment says"});
  run.launched(0, 101);
  EXPECT_EQ(run.judge(newcomer("b", agents(1, 1), 101, "here")).standing, Standing::member);
  EXPECT_EQ(run.judge(newcomer("a", agents(1, 1), 100, "here")).standing, Standing::former);
}

TEST(Roster, WhoLeftMayBeFollowedByAnotherUnlessItWasGivenUp) {
  Roster run = roster();
  run.judge(newcomer("a", agents(2, 3)));
  run.vacate(1, Departure::left);
  EXPECT_EQ(run.judge(newcomer("b", agents(2, 3))).standing, Standing::member);
  run.vacate(1, Departure::died);
  run.close(1);
  expect_refused(run.judge(newcomer("c", agents(2, 3))), {"died before"});
}

TEST(Roster, WhoWouldReplaceALaunchedProcessThatIsGoneIsToldHowItWent) {
  const std::vector<std::pair<Departure, std::string>> cases{
      {Departure::killed, "agent 1 was killed, as the experiment says: nobody can take that place by hand"},
      {Departure::left, "agent 1 left, as the experiment says"},
      {Departure::died, "agent 1 died, and the run goes on without it"}};
  for (const auto& [how, words] : cases) {
    Roster run = roster();
    run.judge(newcomer("a", agents(1, 1), 100, "here"));
    run.vacate(0, how);
    const auto verdict = run.judge(newcomer("x", agents(1, 1), 55, "here"));
    expect_refused(verdict, {words});
    EXPECT_EQ(verdict.why.find("--external"), std::string::npos) << "no remedy that does not help: " << verdict.why;
    EXPECT_EQ(verdict.why.find("pid 100"), std::string::npos) << "that one is dead: " << verdict.why;
  }
  Roster run({{"agent-1-2", agents(1, 2), false}}, "here", "Consort 2");
  run.launched(0, 100);
  run.vacate(0, Departure::killed);
  expect_refused(run.judge(newcomer("x", agents(1, 2))), {"agents 1-2 were killed", "lets them come back"});
}

TEST(Roster, AProcessTheRunDoesNotHaveIsToldWhichOnesItHas) {
  Roster run = roster();
  expect_refused(run.judge(newcomer("a", agents(1, 3))), {"agents 1-3 together", "--ids 1, --ids 2-3", "agents_per_process"});
  expect_refused(run.judge(newcomer("b", agents(3, 3))), {"agent 3 alone", "--ids 2-3"});
  expect_refused(run.judge(newcomer("c", agents(3, 9))), {"agents 1-3, not 3-9"});
  Roster without({{"agent-1", agents(1, 1), true}}, "here", "Consort 2");
  expect_refused(without.judge(newcomer("p", {})), {"no plant"});
}

TEST(Roster, AnotherBuildIsRefusedWithBothVersions) {
  Roster run = roster();
  Newcomer older = newcomer("a", agents(2, 3));
  older.fits = false;
  older.build = "Consort 1";
  expect_refused(run.judge(older), {"Consort 1", "Consort 2", "same build"});
  EXPECT_EQ(run.judge(newcomer("b", agents(2, 3))).standing, Standing::member) << "the place is still free";
}

}  // namespace
}  // namespace consort
