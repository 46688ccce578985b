/// Who of a run's processes is there, ready, waiting, gone.

#include "orchestrator/run/processes.hpp"

#include "orchestrator/script/script.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

/// Agents 1-2 and 3-4 share processes, 4 leaves with its own; and a plant.
struct Case {
  explicit Case(const std::string& more = "")
      : experiment(parse_experiment("experiment: e\nrounds: 100\nagents: {count: 5, protocol: local_voting, initial: {x: 0}}\n"
                                    "topology: ring\nplant: {model: integrator, initial: {position: 0}}\n" +
                                        more,
                                    "e.yaml", ".")),
        placement(place(experiment)) {
    options.external = {AgentId{3}};
  }
  [[nodiscard]] Processes processes() const { return {experiment, placement, options}; }
  Experiment experiment;
  Placement placement;
  RunOptions options;
};

wire::Presence says(wire::State state, Round round = 0, std::uint32_t epoch = 1) {
  wire::Presence presence;
  presence.state = state;
  presence.round = round;
  presence.epoch = epoch;
  presence.pid = 12;
  presence.host = "here";
  return presence;
}

TEST(Processes, AreThoseOfThePlacementAndThePlant) {
  const Processes all = Case("placement: {agents_per_process: 2}\n").processes();
  ASSERT_EQ(all.size(), 4u);
  EXPECT_EQ(all.names([](const ProcessState&) { return true; }), "agent-1-2, agent-3-4, agent-5, plant");
  EXPECT_EQ(all.names([](const ProcessState& state) { return state.external; }), "agent-3-4");
  EXPECT_TRUE(all[3].is_plant());
  EXPECT_EQ(all[1].id(), 3u);
  EXPECT_EQ(all[3].id(), 0u);
}

TEST(Processes, OnlyWhoIsRunningCounts) {
  Processes all = Case().processes();
  EXPECT_EQ(all.running(), 0u);
  EXPECT_EQ(all.least({}), kNever);
  for (const std::size_t p : {0u, 2u, 5u}) all[p].started = true;
  EXPECT_EQ(all.running(), 3u);
  EXPECT_EQ(all.agents_running(), 2u) << "the plant hosts none";
  EXPECT_EQ(all.least({{1, 7}, {3, 9}, {0, 8}, {2, 1}}), 7u);
  EXPECT_EQ(all.least({{1, 7}, {3, 9}}), 0u) << "nothing is known of the plant";
  EXPECT_FALSE(all.all_among({1, 3}));
  EXPECT_TRUE(all.all_among({0, 1, 3}));
  all.is_gone(2);
  EXPECT_TRUE(all.all_among({0, 1}));
}

TEST(Processes, WhoIsReadyIsNotWhenSomebodyComesBack) {
  Processes all = Case("events: [{round: 10, kill: 2}, {round: 20, restart: 2}]\n").processes();
  all[0].started = true;
  all.hears(0, says(wire::State::ready, 500, 2));
  EXPECT_EQ(all[0].ready_epoch, 2u);
  EXPECT_EQ(all[0].ready_until, 500u);
  EXPECT_EQ(all[0].where, "pid 12 on here");
  EXPECT_TRUE(all.back_in(10).empty());
  EXPECT_EQ(all.back_in(20), std::vector{AgentId{2}});
  all.ready_at_most(20);
  EXPECT_EQ(all[0].ready_until, 20u);
}

TEST(Processes, LeavesByItselfWhoIsSentAwayButNotWhoIsKilled) {
  const Processes all = Case("events: [{round: 10, kill: 2}, {round: 20, leave: 4}]\n").processes();
  EXPECT_EQ(all.names([](const ProcessState& state) { return state.leaves; }), "agent-4");
}

TEST(Processes, WhoIsGivenUpIsSoForTheRestOfTheJob) {
  Processes all = Case("placement: {agents_per_process: 2}\n").processes();
  all.give_up(1);
  all.give_up(0);
  EXPECT_EQ(all.given_up(), (std::vector{AgentId{1}, AgentId{2}, AgentId{3}, AgentId{4}}));
  EXPECT_TRUE(all.is_given_up(0) && all.is_given_up(1));
  EXPECT_FALSE(all.is_given_up(2) || all.is_given_up(3));
  all.begin_job();
  EXPECT_FALSE(all.is_given_up(0));
}

TEST(Processes, SayWhoWaitsForWhomInOneSentence) {
  Processes all = Case().processes();
  EXPECT_EQ(all.who_waits(), "every process answers and none waits for a message");
  all[0].started = all[1].started = all[5].started = true;
  EXPECT_EQ(all.who_waits(), "no answer from agent-1, agent-2, plant");
  wire::Presence waits = says(wire::State::status, 4);
  waits.waiting_agent = AgentId{1};
  waits.waiting_for = {AgentId{2}, AgentId{5}};
  all.hears(0, std::move(waits));
  wire::Presence measures = says(wire::State::status, 4);
  measures.note = "waits for its measurement";
  all.hears(1, std::move(measures));
  EXPECT_EQ(all.who_waits(), "agent 1 waits in round 4 for 2 5; agent-2 waits for its measurement; no answer from plant");
  all.hears(5, says(wire::State::status));
  EXPECT_EQ(all.who_waits(), "agent 1 waits in round 4 for 2 5; agent-2 waits for its measurement") << "and nothing after it";
  all.forget_status();
  EXPECT_EQ(all.who_waits(), "no answer from agent-1, agent-2, plant");
}

TEST(Processes, AreNamedUpToADozen) {
  Case many;
  many.experiment.agents = 14;
  many.experiment.plant.reset();
  many.experiment.topology = FixedSchedule{{{std::make_shared<const Graph>(ring(14)), 1}}};
  many.placement = place(many.experiment);
  const std::string names = many.processes().names([](const ProcessState&) { return true; });
  EXPECT_TRUE(names.ends_with("agent-12 and 2 more")) << names;
}

}  // namespace
}  // namespace consort
