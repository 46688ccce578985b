/// The agents' rounds without any transport: messages handed over in every possible disorder give simulate()'s run, bit for bit. Holds
/// rounds/hosted.hpp too, as do realtime_test.cpp and the loop in tests/plant/rounds_test.cpp.

#include "rounds/lockstep.hpp"

#include "core/errors.hpp"
#include "rounds/simulate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

namespace consort {
namespace {

Experiment experiment_of(std::size_t agents, Round rounds, const std::string& protocol) {
  Experiment experiment;
  experiment.name = "shuffled";
  experiment.agents = agents;
  experiment.rounds = rounds;
  experiment.dt = 0.1;
  experiment.seed = Seed{5};
  ProtocolChoice choice{protocol, {}};
  if (protocol != "local_voting") {
    choice.parameters.set("Q", 0.1);
    choice.parameters.set("Omega", 0.1);
  }
  experiment.protocols = {choice};
  experiment.initial = {{"x", {PerAgent::Uniform{5, 7, 2}}}};
  experiment.topology = RandomPairs{1, 4};
  experiment.report_every = 3;
  experiment.links.standard.loss_probability = 0.2;
  experiment.links.standard.noise_covariance = Matrix::Constant(1, 1, 0.1);
  LinkSpec late;
  late.delay_rounds = 3;
  experiment.links.overrides[{AgentId{1}, AgentId{2}}] = late;
  return experiment;
}

FixedSchedule always(const Graph& graph) { return {{{std::make_shared<const Graph>(graph), 1}}, false}; }

/// Several Lockstep objects that exchange messages through a bag from which any message may come next, twice now and then, or, with `loss`,
/// never; grants come again too. When nothing is on its way and somebody has not come to the end of the grant, whoever lacks something
/// asks.
class Shuffled {
 public:
  Shuffled(const Experiment& experiment, std::size_t per_process, Seed order, double loss = 0.0, Round ahead = kLargestHalfWindow)
      : experiment_(experiment), loss_(loss), draws_(order.stream(Purpose("shuffle"))) {
    const auto support = experiment.schedule(experiment.seed).support(experiment.rounds);
    Assignment run;
    run.epoch = 1;
    run.seed = experiment.seed;
    run.protocol = experiment.protocols[0].name;
    run.parameters = experiment.protocols[0].parameters;
    run.agents = static_cast<std::uint32_t>(experiment.agents);
    run.dt = experiment.dt;
    run.rounds = experiment.rounds;
    run.report_interval = experiment.report_interval();
    run.window = 1000;
    run.ahead = ahead;
    run.standard_link = experiment.links.standard;
    for (std::size_t first = 0; first < experiment.agents; first += per_process) {
      std::vector<MemberTask> members;
      for (std::size_t i = first; i < std::min(experiment.agents, first + per_process); ++i) {
        MemberTask member;
        member.agent = agent_at(i);
        member.initial = experiment.initial_of(member.agent, experiment.seed);
        for (const Neighbour& neighbour : support->in_neighbours(member.agent)) member.in_neighbours.push_back(neighbour.id);
        member.link_changes = experiment.links.changes_into(member.agent);
        members.push_back(std::move(member));
      }
      processes_.push_back(std::make_unique<Lockstep>(
          run, members,
          [this, first](std::size_t member, Round round, std::span<const double> payload) {
            const AgentId from = agent_at(first + member);
            note_begun(from, round);
            bag_.push_back([from, round, kept = std::vector<double>(payload.begin(), payload.end())](Lockstep& process) {
              process.receive(Information{1, from, round, kept});
            });
          },
          Act{},
          [this, first](Standing&& standing) {
            told_ += standing.gaps.empty() ? 1 : 0;
            standing.process = agent_at(first).value;
            bag_.push_back([standing](Lockstep& process) { process.answer(standing); });
          }));
    }
  }

  /// How many rounds somebody was beyond one of its listeners, at most.
  [[nodiscard]] Round furthest_ahead() const { return furthest_ahead_; }
  /// How often a process told only how far it is.
  [[nodiscard]] std::uint64_t told() const { return told_; }
  [[nodiscard]] std::uint64_t sent_again_bytes() const {
    std::uint64_t bytes = 0;
    for (const auto& process : processes_) bytes += process->sent_again_bytes();
    return bytes;
  }

  Trace run() {
    const Schedule schedule = experiment_.schedule(experiment_.seed);
    Round granted = 0;
    std::uint32_t number = 0;
    std::vector<Grant> grants;
    while (granted < experiment_.rounds) {
      Grant grant{1, std::min<Round>(experiment_.rounds, granted + 1 + static_cast<Round>(draws_.below(20))), 0, {}};
      grant.report_at = grant.until;
      while (stated_ < grant.until) {
        const auto segment = schedule.segment(stated_);
        grant.segments.push_back({stated_, number++ % 64, segment.graph->edges()});
        stated_ = segment.last >= experiment_.rounds ? experiment_.rounds : segment.last + 1;
      }
      granted = grant.until;
      grants.push_back(grant);
      for (const auto& process : processes_) {
        process->grant(grant);
        process->grant(grants[draws_.below(grants.size())]);  // an old one, come again
        process->advance();
      }
      empty_the_bag();
    }
    return trace();
  }

 private:
  using Delivery = std::function<void(Lockstep&)>;

  void note_begun(AgentId sender, Round round) {
    const auto graph = experiment_.schedule(experiment_.seed).segment(round).graph;
    for (const auto& process : processes_)
      for (std::size_t m = 0; m < process->hosted().size(); ++m) {
        const Member& member = process->hosted()[m];
        if (graph->has({sender, member.id()}) && round > member.round())
          furthest_ahead_ = std::max(furthest_ahead_, round - member.round());
      }
  }

  void empty_the_bag() {
    do {
      while (!bag_.empty()) take_one();
    } while (ask());
  }

  void take_one() {
    const std::size_t pick = draws_.below(bag_.size());
    const Delivery message = bag_[pick];
    if (loss_ > 0.0 || draws_.below(4) != 0) {  // else it stays and comes again
      bag_[pick] = std::move(bag_.back());
      bag_.pop_back();
    }
    for (const auto& process : processes_) {
      if (loss_ > 0.0 && draws_.below(1000) < static_cast<std::uint64_t>(1000.0 * loss_)) continue;
      message(*process);
      process->advance();
    }
  }

  bool ask() {
    bool asked = false;
    for (const auto& process : processes_) asked = process->ask() || asked;
    return asked;
  }

  Trace trace() {
    std::map<Round, std::map<AgentId, std::pair<std::vector<double>, std::uint64_t>>> rows;
    std::map<Round, std::map<AgentId, std::vector<double>>> beside;
    Trace trace;
    trace.agents = experiment_.agents;
    std::map<Round, std::vector<AgentCounters>> counters;
    for (const auto& process : processes_) {
      trace.dimension = process->hosted()[0].protocol().estimate_layout().size();
      trace.recorded_layout = process->hosted()[0].recorded_layout();
      trace.recorded_dimension = trace.recorded_layout.size();
      for (const MemberReport& report : process->collect_reports()) {
        for (std::size_t r = 0; r < report.rounds.size(); ++r) {
          const auto begin = report.estimates.begin() + static_cast<std::ptrdiff_t>(r * trace.dimension);
          rows[report.rounds[r]][report.agent] = {{begin, begin + static_cast<std::ptrdiff_t>(trace.dimension)}, report.hashes[r]};
          counters[report.rounds[r]].push_back(report.counters[r]);
          const auto first = report.recorded.begin() + static_cast<std::ptrdiff_t>(r * trace.recorded_dimension);
          beside[report.rounds[r]][report.agent] = {first, first + static_cast<std::ptrdiff_t>(trace.recorded_dimension)};
        }
      }
    }
    for (const auto& [round, row] : rows) {
      std::vector<double> estimates;
      std::vector<std::uint64_t> hashes;
      for (const auto& [agent, entry] : row) {
        estimates.insert(estimates.end(), entry.first.begin(), entry.first.end());
        hashes.push_back(entry.second);
      }
      std::vector<double> recorded;
      for (const auto& [agent, numbers] : beside[round]) recorded.insert(recorded.end(), numbers.begin(), numbers.end());
      trace.add({round, estimates, hashes, counters[round], {}, {}, recorded});
    }
    return trace;
  }

  const Experiment& experiment_;
  double loss_;
  Stream draws_;
  std::vector<std::unique_ptr<Lockstep>> processes_;
  std::vector<Delivery> bag_;
  Round stated_ = 0, furthest_ahead_ = 0;
  std::uint64_t told_ = 0;
};

TEST(Lockstep, AnyOrderOfArrivalGivesTheSimulatedRun) {
  for (const char* protocol : {"local_voting", "kalman_consensus", "unbiased_kalman_consensus", "unbiased_information_consensus"}) {
    Experiment experiment = experiment_of(7, 60, protocol);
    if (std::string_view(protocol) == "unbiased_information_consensus") experiment.protocols[0].parameters = {};
    const Trace simulated = simulate(experiment, experiment.protocols[0], experiment.seed);
    for (std::uint64_t order = 0; order < 20; ++order) {
      SCOPED_TRACE(std::string(protocol) + ", order " + std::to_string(order));
      const Trace shuffled = Shuffled(experiment, 1 + order % 3, Seed{order}).run();
      EXPECT_EQ(shuffled.hash, simulated.hash);
      EXPECT_EQ(shuffled.rounds, simulated.rounds);
      EXPECT_EQ(shuffled.estimates, simulated.estimates);
      EXPECT_EQ(shuffled.recorded_layout, simulated.recorded_layout);
      EXPECT_EQ(shuffled.recorded, simulated.recorded) << "what is recorded beside the estimates";
      EXPECT_EQ(simulated.recorded_dimension == 0, std::string_view(protocol) == "local_voting");
      EXPECT_EQ(shuffled.totals.delivered, simulated.totals.delivered);
      EXPECT_EQ(shuffled.totals.lost, simulated.totals.lost);
    }
  }
}

TEST(Lockstep, WhatIsLostIsAskedForUntilTheRunIsTheSimulatedOne) {
  for (const double loss : {0.01, 0.2, 0.6}) {
    for (const bool directed : {false, true}) {
      Experiment experiment = experiment_of(6, 80, "local_voting");
      if (directed) experiment.topology = always(directed_ring(6));
      const Trace simulated = simulate(experiment, experiment.protocols[0], experiment.seed);
      for (std::uint64_t order = 0; order < 6; ++order) {
        SCOPED_TRACE((directed ? "directed, loss " : "pairs, loss ") + std::to_string(loss) + ", order " + std::to_string(order));
        Shuffled shuffled(experiment, 1 + order % 3, Seed{order}, loss, 1 + static_cast<Round>(order));
        const Trace trace = shuffled.run();
        EXPECT_EQ(trace.hash, simulated.hash);
        EXPECT_EQ(trace.totals.delivered, simulated.totals.delivered);
        EXPECT_LE(shuffled.furthest_ahead(), 1 + order);
        EXPECT_TRUE(loss < 0.1 || shuffled.sent_again_bytes() > 0);
      }
    }
  }
}

TEST(Lockstep, ASenderIsHeldBackByListenersThatSayNothingElse) {
  // 1 -> 2 -> ... -> 6: nothing comes back, so the first could be at the end of the grant before the others have begun.
  Experiment experiment = experiment_of(6, 300, "local_voting");
  std::vector<WeightedEdge> chain;
  for (std::uint32_t i = 1; i < 6; ++i) chain.push_back({{AgentId{i}, AgentId{i + 1}}, 1.0});
  experiment.topology = always(Graph(6, chain));
  const Trace simulated = simulate(experiment, experiment.protocols[0], experiment.seed);
  for (const Round ahead : {Round{2}, Round{8}, Round{1000}}) {
    Shuffled shuffled(experiment, 1, Seed{ahead}, 0.0, ahead);
    EXPECT_EQ(shuffled.run().hash, simulated.hash);
    EXPECT_LE(shuffled.furthest_ahead(), ahead);
    EXPECT_LE(shuffled.told(), 5 * experiment.rounds / std::max<Round>(ahead / 2, 1)) << "once in half of what may be ahead";
  }
}

TEST(Lockstep, OnTwoWayLinksNothingIsToldWhereNothingIsLost) {
  Experiment experiment = experiment_of(6, 100, "local_voting");
  experiment.topology = always(ring(6));
  const Trace simulated = simulate(experiment, experiment.protocols[0], experiment.seed);
  Shuffled inorder(experiment, 2, Seed{1}, 0.0, 2);
  EXPECT_EQ(inorder.run().hash, simulated.hash);
  EXPECT_LE(inorder.furthest_ahead(), 1u);
}

/// Agent 1 of three that hear each other, in its first round of five.
std::unique_ptr<Lockstep> first_of_three() {
  Experiment experiment = experiment_of(3, 5, "local_voting");
  Assignment run;
  run.seed = experiment.seed;
  run.protocol = "local_voting";
  run.agents = 3;
  run.rounds = 5;
  run.window = 10;
  MemberTask member;
  member.agent = AgentId{1};
  member.initial = experiment.initial_of(AgentId{1}, experiment.seed);
  member.in_neighbours = {AgentId{2}, AgentId{3}};
  auto lockstep = std::make_unique<Lockstep>(run, std::span(&member, 1), [](std::size_t, Round, std::span<const double>) {});
  lockstep->grant({1, 5, 5, {{0, 0, complete(3).edges()}}});
  lockstep->advance();
  return lockstep;
}

TEST(Lockstep, CountsWhatItCanUseAndWhatCameOnceMoreAfterItWasAskedFor) {
  const auto process = first_of_three();
  Lockstep& lockstep = *process;
  const std::vector<double> x{1.0, 2.0};
  const auto comes = [&](std::uint32_t sender) {
    lockstep.receive(Information{1, AgentId{sender}, 0, x});
    lockstep.advance();
  };
  comes(2);
  comes(2);
  EXPECT_EQ(lockstep.heard(), 1u);
  EXPECT_EQ(lockstep.came_twice(), 0u) << "nobody has asked";
  EXPECT_TRUE(lockstep.ask());  // for what 3 has sent
  comes(3);
  EXPECT_EQ(lockstep.finished(), 1u);
  EXPECT_EQ(lockstep.heard(), 2u);
  EXPECT_EQ(lockstep.came_twice(), 0u) << "that may have been the answer";
  comes(3);
  comes(2);
  EXPECT_EQ(lockstep.heard(), 2u);
  EXPECT_EQ(lockstep.came_twice(), 1u);
}

TEST(Lockstep, AGrantThatNamesAnUnstatedGraphIsAnError) {
  Experiment experiment = experiment_of(2, 5, "local_voting");
  Assignment run;
  run.seed = experiment.seed;
  run.protocol = "local_voting";
  run.agents = 2;
  run.rounds = 5;
  MemberTask member;
  member.agent = AgentId{1};
  member.initial = experiment.initial_of(AgentId{1}, experiment.seed);
  member.in_neighbours = {AgentId{2}};
  Lockstep lockstep(run, std::span(&member, 1), [](std::size_t, Round, std::span<const double>) {});
  EXPECT_THROW(lockstep.grant({1, 5, 5, {{0, 3, {}}}}), RunError);
}

TEST(Lockstep, SaysWhomTheSlowestAgentWaitsFor) {
  const auto process = first_of_three();
  Lockstep& lockstep = *process;
  const std::vector<double> values{1.0, 2.0};
  EXPECT_TRUE(lockstep.receive({1, AgentId{2}, 0, values}));
  const auto slowest = lockstep.hosted().slowest();
  EXPECT_EQ(slowest.agent, AgentId{1});
  EXPECT_EQ(slowest.round, 0u);
  EXPECT_EQ(slowest.waiting_for, std::vector<AgentId>{AgentId{3}});
  EXPECT_FALSE(lockstep.receive({1, AgentId{9}, 0, values})) << "nobody hears an agent beyond the run's";
}

}  // namespace
}  // namespace consort
