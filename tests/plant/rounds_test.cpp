/// The plant's rounds without any transport; and the whole loop with every sample handed over in disorder: simulate()'s run, bit for bit.

#include "plant/rounds.hpp"

#include "core/errors.hpp"
#include "rounds/lockstep.hpp"
#include "rounds/simulate.hpp"
#include "tests/support/experiments.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <map>

namespace consort {
namespace {

Experiment loop_of(std::size_t agents, Round rounds) {
  Experiment e;
  e.name = "loop";
  e.agents = agents;
  e.rounds = rounds;
  e.dt = 0.05;
  e.seed = Seed{3};
  e.protocols = {{"local_voting", {}}};
  e.topology = RandomPairs{1, 4};
  e.links.standard.loss_probability = 0.1;
  std::vector<double> positions;
  for (std::size_t i = 0; i < agents; ++i) positions.push_back(static_cast<double>(i * i));
  e.plant = integrators(1, positions);
  e.plant->disturbances = {{Disturbance::On::measurement, Disturbance::Gaussian{Matrix::Constant(1, 1, 0.01), false}, 2, {}},
                           {Disturbance::On::state, Disturbance::Gaussian{Matrix::Constant(1, 1, 0.1), true}, 1, {}}};
  return e;
}

PlantAssignment assignment_of(const Experiment& e, std::size_t per_process) {
  PlantAssignment run;
  run.epoch = 1;
  run.rounds = e.rounds;
  run.report_interval = e.report_interval();
  run.steered = true;
  run.task = plant_task(e, e.seed);
  for (std::size_t i = 0; i < e.agents; ++i) {
    run.agents.push_back(agent_at(i));
    run.process_of.push_back(agent_at(i - i % per_process).value);
  }
  return run;
}

struct Sent {
  std::uint32_t process;
  Round round;
  std::vector<double> values;
};

TEST(PlantRounds, WaitForEveryProcessAndMoveOnce) {
  const Experiment e = loop_of(3, 10);
  std::vector<Sent> sent;
  PlantRounds plant(assignment_of(e, 1), [&](std::uint32_t process, Round round, std::span<const double> values) {
    sent.push_back({process, round, {values.begin(), values.end()}});
  });
  plant.advance();
  EXPECT_TRUE(sent.empty()) << "nothing is granted";
  plant.grant({1, 2, 2, {}});
  plant.advance();
  ASSERT_EQ(sent.size(), 3u);
  EXPECT_EQ(sent[1].process, 2u);
  EXPECT_EQ(sent[1].values.size(), 1u);
  const std::vector<double> control{1.0};
  plant.receive({1, 1, 0, control});
  plant.receive({1, 1, 0, control});  // twice
  plant.receive({1, 3, 0, control});
  plant.receive({1, 2, 1, control});  // of a round that has not begun
  plant.receive({1, 9, 0, control});  // of nobody
  plant.advance();
  EXPECT_EQ(plant.round(), 0u);
  EXPECT_EQ(plant.progress().agent, AgentId{2});
  EXPECT_EQ(plant.progress().missing, 1u);
  plant.receive({1, 2, 0, control});
  plant.advance();
  EXPECT_EQ(plant.round(), 1u);
  EXPECT_EQ(sent.size(), 6u);
  EXPECT_FALSE(plant.report_due());
  plant.grant({1, 1, 1, {}});
  EXPECT_FALSE(plant.report_due()) << "an older grant moves no report point";
}

TEST(PlantRounds, CountWhatTheyCanUseAndWhatCameOnceMoreAfterItWasAskedFor) {
  const Experiment e = loop_of(3, 10);
  PlantRounds plant(assignment_of(e, 1), [](std::uint32_t, Round, std::span<const double>) {});
  plant.grant({1, 2, 2, {}});
  plant.advance();
  const std::vector<double> control{1.0};
  const auto comes = [&](std::uint32_t process) {
    plant.receive({1, process, 0, control});
    plant.advance();
  };
  comes(1);
  comes(1);
  comes(2);
  EXPECT_EQ(plant.heard(), 2u);
  EXPECT_EQ(plant.came_twice(), 0u) << "nobody has asked";
  EXPECT_TRUE(plant.ask());  // for what 3 has sent
  comes(3);
  EXPECT_EQ(plant.round(), 1u);
  EXPECT_EQ(plant.came_twice(), 0u) << "that may have been the answer";
  comes(3);
  comes(2);
  EXPECT_EQ(plant.heard(), 3u);
  EXPECT_EQ(plant.came_twice(), 1u);
}

TEST(PlantRounds, RefuseControlsOfAnotherLength) {
  const Experiment e = loop_of(2, 10);
  PlantRounds plant(assignment_of(e, 1), [](std::uint32_t, Round, std::span<const double>) {});
  plant.grant({1, 1, 1, {}});
  plant.advance();
  const std::vector<double> two{1.0, 2.0};
  EXPECT_THROW(plant.receive({1, 2, 0, two}), RunError);
  EXPECT_THROW(plant.receive({1, 1, 0, {}}), RunError);
}

TEST(Lockstep, RefusesAMeasurementOfAnotherLength) {
  Assignment run;
  run.protocol = "local_voting";
  run.agents = 1;
  run.rounds = 5;
  run.plant = run.steers = true;
  MemberTask member;
  member.agent = AgentId{1};
  member.measurements = 1;
  Lockstep lockstep(
      run, std::span(&member, 1), [](std::size_t, Round, std::span<const double>) {}, [](Round, std::span<const double>) {});
  const std::vector<double> two{1.0, 2.0};
  EXPECT_THROW(lockstep.receive(Measurement{1, 0, two}), RunError);
}

/// Plant and agents' processes around a bag from which any sample may come next, twice now and then, or, with `loss`, never.
class Loop {
 public:
  Loop(const Experiment& e, std::size_t per_process, Seed order, double loss = 0.0)
      : e_(e),
        loss_(loss),
        draws_(order.stream(Purpose("shuffle"))),
        plant_(
            assignment_of(e, per_process),
            [this](std::uint32_t process, Round round, std::span<const double> values) {
              post([this, process, round, kept = std::vector<double>(values.begin(), values.end())] {
                agents_.at(process)->receive(Measurement{1, round, kept});
              });
            },
            [this](Standing&& standing) {
              post([this, standing] {
                for (const auto& [process, lockstep] : agents_) lockstep->answer(standing);
              });
            }) {
    const AgentMaker maker(e, e.protocols[0], e.seed);
    const auto support = e.schedule(e.seed).support(e.rounds);
    Assignment run;
    run.epoch = 1;
    run.seed = e.seed;
    run.protocol = e.protocols[0].name;
    run.agents = static_cast<std::uint32_t>(e.agents);
    run.dt = e.dt;
    run.rounds = e.rounds;
    run.report_interval = e.report_interval();
    run.window = 1000;
    run.standard_link = e.links.standard;
    run.plant = run.steers = true;
    for (std::size_t first = 0; first < e.agents; first += per_process) {
      std::vector<MemberTask> members;
      for (std::size_t i = first; i < std::min(e.agents, first + per_process); ++i) {
        MemberTask member;
        member.agent = agent_at(i);
        member.initial = e.initial_of(member.agent, e.seed);
        member.model = maker.physics()->knowledge(member.agent);
        member.measurements = static_cast<std::uint32_t>(maker.physics()->measurement_size(member.agent));
        for (const Neighbour& neighbour : support->in_neighbours(member.agent)) member.in_neighbours.push_back(neighbour.id);
        members.push_back(std::move(member));
      }
      const std::uint32_t name = members.front().agent.value;
      agents_.emplace(
          name, std::make_unique<Lockstep>(
                    run, members,
                    [this, first](std::size_t member, Round round, std::span<const double> payload) {
                      post([this, from = agent_at(first + member), round, kept = std::vector<double>(payload.begin(), payload.end())] {
                        for (const auto& [process, lockstep] : agents_) lockstep->receive(Information{1, from, round, kept});
                      });
                    },
                    [this, name](Round round, std::span<const double> controls) {
                      post([this, name, round, kept = std::vector<double>(controls.begin(), controls.end())] {
                        plant_.receive({1, name, round, kept});
                      });
                    },
                    [this, name](Standing&& standing) {
                      standing.process = name;
                      post([this, standing] {
                        plant_.answer(standing);
                        for (const auto& [process, lockstep] : agents_) lockstep->answer(standing);
                      });
                    }));
    }
  }

  /// History hashes at the end: of every agent, then of every part of the plant.
  std::vector<std::uint64_t> run() {
    const Schedule schedule = e_.schedule(e_.seed);
    Round granted = 0, stated = 0;
    std::uint32_t number = 0;
    Grant first;
    while (granted < e_.rounds) {
      granted = std::min<Round>(e_.rounds, granted + 1 + static_cast<Round>(draws_.below(20)));
      Grant grant{1, granted, granted, {}};
      while (stated < grant.until) {
        const auto segment = schedule.segment(stated);
        grant.segments.push_back({stated, number++ % 64, segment.graph->edges()});
        stated = segment.last >= e_.rounds ? e_.rounds : segment.last + 1;
      }
      if (first.until == 0) first = grant;
      plant_.grant(grant);
      plant_.grant(first);  // come again
      for (const auto& [process, lockstep] : agents_) lockstep->grant(grant);
      advance();
      do {
        while (!bag_.empty()) take_one();
      } while (ask());
    }
    std::map<AgentId, std::uint64_t> of_agents;
    for (const auto& [process, lockstep] : agents_)
      for (const MemberReport& report : lockstep->collect_reports()) of_agents[report.agent] = report.hashes.back();
    std::vector<std::uint64_t> hashes;
    for (const auto& [agent, hash] : of_agents) hashes.push_back(hash);
    for (const MemberReport& report : plant_.collect_reports()) hashes.push_back(report.hashes.back());
    return hashes;
  }

 private:
  void post(std::function<void()> delivery) { bag_.push_back(std::move(delivery)); }
  void advance() {
    plant_.advance();
    for (const auto& [process, lockstep] : agents_) lockstep->advance();
  }
  void take_one() {
    const std::size_t pick = draws_.below(bag_.size());
    const std::function<void()> delivery = bag_[pick];
    if (loss_ > 0.0 || draws_.below(4) != 0) {  // else it stays and comes again
      bag_[pick] = std::move(bag_.back());
      bag_.pop_back();
    }
    if (draws_.below(1000) < static_cast<std::uint64_t>(1000.0 * loss_)) return;
    delivery();
    advance();
  }
  bool ask() {
    bool asked = plant_.ask();
    for (const auto& [process, lockstep] : agents_) asked = lockstep->ask() || asked;
    return asked;
  }

  const Experiment& e_;
  double loss_;
  Stream draws_;
  std::vector<std::function<void()>> bag_;
  std::map<std::uint32_t, std::unique_ptr<Lockstep>> agents_;
  PlantRounds plant_;
};

/// Of the agents, then of their parts of the plant, at the end.
std::vector<std::uint64_t> simulated_hashes(const Experiment& e) {
  std::vector<std::uint64_t> hashes;
  simulate(e, e.protocols[0], e.seed, [&](const RoundReport& report) {
    hashes.assign(report.hashes.begin(), report.hashes.end());
    hashes.insert(hashes.end(), report.state_hashes.begin(), report.state_hashes.end());
    return true;
  });
  return hashes;
}

TEST(ClosedLoop, AnyOrderOfArrivalGivesTheSimulatedRun) {
  const Experiment e = loop_of(6, 60);
  const std::vector<std::uint64_t> simulated = simulated_hashes(e);
  for (std::uint64_t order = 0; order < 30; ++order) {
    SCOPED_TRACE(order);
    EXPECT_EQ(Loop(e, 1 + order % 3, Seed{order}).run(), simulated);
  }
}

TEST(ClosedLoop, WhatIsLostIsAskedForUntilTheRunIsTheSimulatedOne) {
  const Experiment e = loop_of(6, 60);
  const std::vector<std::uint64_t> simulated = simulated_hashes(e);
  for (const double loss : {0.02, 0.4})
    for (std::uint64_t order = 0; order < 6; ++order)
      EXPECT_EQ(Loop(e, 1 + order % 3, Seed{order}, loss).run(), simulated) << loss << ", " << order;
}

}  // namespace
}  // namespace consort
