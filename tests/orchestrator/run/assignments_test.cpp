/// What the processes of a run are told, from the experiment and its placement alone.

#include "orchestrator/run/assignments.hpp"

#include "orchestrator/script/script.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

constexpr const char* kRing = "topology: ring\n";

/// The assignments of one job, with what they are made of.
struct Case {
  explicit Case(const std::string& more, std::size_t agents = 5)
      : experiment(parse_experiment("experiment: e\nrounds: 100\nagents: {count: " + std::to_string(agents) +
                                        ", protocol: local_voting, initial: {x: {linspace: [0, 1]}}}\n" + more,
                                    "e.yaml", ".")),
        placement(place(experiment)),
        assignments(experiment, placement, {0, 0, Seed{9}}, 4) {}
  [[nodiscard]] std::vector<Assignment> all(Round now = 0, std::vector<AgentId> gone = {}) const {
    return assignments.agents([](std::size_t) { return true; }, now, gone);
  }
  [[nodiscard]] MemberTask member(std::uint32_t agent, Round now = 0) const { return all(now).at(0).members.at(agent - 1); }
  Experiment experiment;
  Placement placement;
  Assignments assignments;
};

TEST(Assignments, SayWhatAllHaveInCommonAndWhatEachHasOfItsOwn) {
  const Case ring(kRing);
  const auto parts = ring.all();
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].epoch, 4u);
  EXPECT_EQ(parts[0].seed.value, 9u);
  EXPECT_EQ(parts[0].protocol, "local_voting");
  EXPECT_EQ(parts[0].rounds, 100u);
  ASSERT_EQ(parts[0].members.size(), 5u);
  const MemberTask& third = parts[0].members[2];
  EXPECT_EQ(third.agent, AgentId{3});
  EXPECT_EQ(third.process, 3u);
  EXPECT_EQ(third.initial.vector("x")[0], 0.5);
  EXPECT_EQ(third.in_neighbours, (std::vector{AgentId{2}, AgentId{4}}));
  EXPECT_EQ(third.remote_readers, 2u);
  EXPECT_TRUE(third.late_readers.empty());
}

TEST(Assignments, AreInPartsOfBoundedSizeForTheProcessesThatAreMeant) {
  const Case many(std::string(kRing) + "placement: {agents_per_process: 50}\n", 450);
  const auto parts = many.all();
  ASSERT_EQ(parts.size(), 3u);
  std::size_t members = 0;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    EXPECT_EQ(parts[p].part, p);
    EXPECT_EQ(parts[p].parts, 3u);
    members += parts[p].members.size();
  }
  EXPECT_EQ(members, 450u);
  const auto meant = many.assignments.agents([](std::size_t process) { return process == 1; });
  ASSERT_EQ(meant.size(), 1u);
  EXPECT_EQ(meant[0].members.size(), 50u);
  EXPECT_EQ(meant[0].members.front().agent, AgentId{51});
  EXPECT_EQ(meant[0].members.front().process, 51u);
}

TEST(Assignments, WhoIsNotThereIsToldWithItsRoundAndWhoIsGoneWithNone) {
  const Case late(std::string(kRing) + "events: [{round: 30, join: 4}]\n");
  EXPECT_EQ(late.all()[0].joining, (std::map<AgentId, Round>{{AgentId{4}, 30}}));
  EXPECT_EQ(late.all(30)[0].joining, (std::map<AgentId, Round>{}));
  EXPECT_EQ(late.all(30, {AgentId{2}})[0].joining, (std::map<AgentId, Round>{{AgentId{2}, kNever}}));
  EXPECT_EQ(late.member(3).remote_readers, 1u);
  EXPECT_EQ(late.member(3).late_readers, std::vector<Round>{30}) << "agent 4 reads it from then on";
  EXPECT_EQ(late.member(4).presence.from, 30u);
}

TEST(Assignments, WhoIsKilledDoesNotKnowTheHourAndWhoComesBackIsToldOfItsNextStay) {
  const Case struck(std::string(kRing) + "events: [{round: 20, kill: 2}, {round: 40, restart: 2}, {round: 60, leave: 5}]\n");
  EXPECT_EQ(struck.member(2).presence, (Attendance{0, kNever}));
  EXPECT_EQ(struck.member(2, 40).presence, (Attendance{40, kNever}));
  EXPECT_EQ(struck.member(5).presence, (Attendance{0, 60}));
}

TEST(Assignments, LinksAreToldWithEachReportWhereAProcessMayBeGoneBeforeItsLastWordsOrTheyAreFew) {
  EXPECT_TRUE(Case(kRing).all()[0].tells_links);
  const auto large = [](const std::string& more) {
    std::string text = kRing + more;
    text.replace(text.find("ring"), 4, "complete");
    return Case(text, 150).all()[0].tells_links;
  };
  EXPECT_FALSE(large(""));
  EXPECT_TRUE(large("on_agent_loss: continue\n"));
  EXPECT_TRUE(large("mode: realtime\ndt: 0.1\n"));
}

TEST(Assignments, ThePlantIsToldOfEveryAgentAndWhoHostsIt) {
  const Case loop(std::string(kRing) + "plant: {model: integrator, initial: {position: 0}}\nplacement: {agents_per_process: 100}\n", 250);
  const auto parts = loop.assignments.plant();
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].agents.size() + parts[1].agents.size(), 250u);
  EXPECT_EQ(parts[1].part, 1u);
  EXPECT_EQ(parts[1].parts, 2u);
  EXPECT_EQ(parts[1].process_of.front(), 201u);
  EXPECT_EQ(parts[0].task.parts.size(), 200u);
  EXPECT_TRUE(parts[0].steered);
  EXPECT_TRUE(loop.all()[0].plant && loop.all()[0].steers);
  EXPECT_EQ(loop.assignments.outline().state_layout.size(), 1u);
}

}  // namespace
}  // namespace consort
