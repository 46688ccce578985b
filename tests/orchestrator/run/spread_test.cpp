/// Which host each process of a run is on, what its command is, and what a person enters.

#include "orchestrator/run/spread.hpp"

#include "core/errors.hpp"
#include "orchestrator/run/commands.hpp"
#include "orchestrator/run/wiring.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace consort {
namespace {

Experiment experiment_on(Graph graph, std::size_t agents_per_process = 1, bool plant = false) {
  Experiment experiment;
  experiment.agents = graph.agents();
  experiment.rounds = 10;
  experiment.agents_per_process = agents_per_process;
  experiment.topology = FixedSchedule{{{std::make_shared<const Graph>(std::move(graph)), 1}}, false};
  if (plant) experiment.plant.emplace();
  return experiment;
}

std::vector<std::size_t> spread_of(const Experiment& experiment, const std::vector<Host>& hosts) {
  return spread(experiment, place(experiment), hosts);
}

std::string refusal(const Experiment& experiment, const std::vector<Host>& hosts) {
  try {
    spread_of(experiment, hosts);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

using Hosts = std::vector<std::size_t>;

TEST(Spread, FillsHostsBySlotsWithNeighboursTogether) {
  EXPECT_EQ(spread_of(experiment_on(ring(6)), {{.name = "a", .slots = 2}, {.name = "b", .slots = 3}, {.name = "c", .slots = 9}}),
            (Hosts{0, 0, 1, 1, 1, 2}));
  // Two rings of three, whose agents are numbered alternately: 1-3-5 and 2-4-6.
  Matrix weights = Matrix::Zero(6, 6);
  for (const auto& [i, j] : {std::pair(0, 2), std::pair(2, 4), std::pair(4, 0), std::pair(1, 3), std::pair(3, 5), std::pair(5, 1)})
    weights(i, j) = weights(j, i) = 1.0;
  EXPECT_EQ(spread_of(experiment_on(from_adjacency(weights)), {{.name = "a"}, {.name = "b"}}), (Hosts{0, 1, 0, 1, 0, 1}));
}

TEST(Spread, WithoutHostsOrNumbersOfSlotsEverybodyIsHereOrSharedEvenly) {
  EXPECT_EQ(spread_of(experiment_on(ring(3), 1, true), {}), (Hosts{kHere, kHere, kHere, kHere}));
  EXPECT_EQ(spread_of(experiment_on(ring(7)), {{.name = "a"}, {.name = "b", .slots = 1}, {.name = "c"}}), (Hosts{0, 0, 0, 1, 2, 2, 2}));
}

TEST(Spread, NamedAgentsAreWhereTheyAreNamedAndTheOthersWhereIsRoom) {
  const std::vector<Host> hosts{{.name = "a", .agents = {0, 5}}, {.name = "b"}};
  EXPECT_EQ(spread_of(experiment_on(ring(5), 1, true), hosts), (Hosts{1, 1, 1, 1, 0, 0})) << "0 is the plant";
  EXPECT_EQ(spread_of(experiment_on(ring(5), 1, true), {{.name = "b"}}).back(), kHere) << "a plant that nobody names";
  EXPECT_EQ(spread_of(experiment_on(ring(6), 3), {{.name = "a"}, {.name = "b", .agents = {1, 2, 3}}}), (Hosts{1, 0}));
}

TEST(Spread, HostsThatDoNotSufficeAreRefusedWithTheRemedy) {
  const auto expect = [](const std::string& said, const std::string& expected) {
    EXPECT_NE(said.find(expected), std::string::npos) << said;
  };
  expect(refusal(experiment_on(ring(6)), {{.name = "a", .slots = 2}, {.name = "b", .slots = 3}}),
         "found slots for 5 of 6 processes; allowed: more slots");
  expect(refusal(experiment_on(ring(6)), {{.name = "a", .agents = {7}}}), "found agent 7 on a; allowed: 1 to 6");
  expect(refusal(experiment_on(ring(6)), {{.name = "a", .agents = {0}}}), "the experiment has no plant");
  expect(refusal(experiment_on(ring(6), 2), {{.name = "a", .agents = {1}}, {.name = "b"}}), "found a part of agents 1-2 on a");
  expect(refusal(experiment_on(ring(6)), {{.name = "a", .agents = {1}}}), "found slots for 0 of 5 processes");
}

TEST(Spread, EveryProcessIsOnAHostAndNoHostHasMoreThanItsSlots) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    const Experiment experiment = experiment_on(erdos_renyi(12, 0.02 * static_cast<double>(seed % 40), false, Seed{seed}), 1 + seed % 3);
    const std::vector<Host> hosts{{.name = "a", .slots = 1 + seed % 5}, {.name = "b", .slots = 3}, {.name = "c"}};
    const auto at = spread_of(experiment, hosts);
    for (const std::size_t host : at) ASSERT_LT(host, hosts.size());
    for (std::size_t h = 0; h < 2; ++h) ASSERT_LE(std::count(at.begin(), at.end(), h), static_cast<std::ptrdiff_t>(*hosts[h].slots));
  }
}

// --- commands -------------------------------------------------------------------------------------------------------------

struct Planned {
  Experiment experiment;
  RunOptions options;
  Placement placement;
  Wiring wiring;

  Planned(Experiment of, std::vector<Host> hosts, std::vector<std::string> addresses) : experiment(std::move(of)) {
    options.run_name = "demo";
    options.domain = 7;
    options.interface = addresses.empty() ? "lo" : "10.0.0.9";
    options.hosts = std::move(hosts);
    options.host_addresses = std::move(addresses);
    placement = place_for(experiment, options);
    wiring = Wiring::of(experiment, options, placement);
    wiring.first_port = 20'000;
  }
};

TEST(Commands, NameTheAddressesOfWhomAProcessMeetsAndNoKey) {
  const Planned run(experiment_on(ring(4), 1, true),
                    {{.name = "a", .address = "a.lab", .slots = 2},
                     {.name = "b", .address = "b.lab", .launcher = Launcher::manual, .slots = 2, .consort = "/opt/bin/consort"}},
                    {"10.0.0.1", "fe80::2"});
  EXPECT_EQ(run.wiring.ports(), 4u * (1 + 5)) << "one end of the orchestrator's, four agents and the plant";
  EXPECT_EQ(all_commands(run.options, run.placement, run.wiring),
            "# this host\n"
            "consort-plant --run demo --domain 7 --interface 10.0.0.9 --discovery neighbours --port 20020 --neighbour-ports "
            "'10.0.0.9:20000,10.0.0.1:20004,10.0.0.1:20008,[fe80::2]:20012,[fe80::2]:20016'\n"
            "# a, over ssh -T -oBatchMode=yes -oConnectTimeout=10 -oClearAllForwardings=yes a.lab 'exec consort lend'\n"
            "consort-agent --ids 1 --run demo --domain 7 --interface 10.0.0.1 --discovery neighbours --port 20004 --neighbour-ports "
            "'10.0.0.9:20000,10.0.0.1:20008,[fe80::2]:20016,10.0.0.9:20020'\n"
            "consort-agent --ids 2 --run demo --domain 7 --interface 10.0.0.1 --discovery neighbours --port 20008 --neighbour-ports "
            "'10.0.0.9:20000,10.0.0.1:20004,[fe80::2]:20012,10.0.0.9:20020'\n"
            "# b, by hand\n"
            "CONSORT_KEY=\"$CONSORT_KEY\" /opt/bin/consort-agent --ids 3 --run demo --domain 7 --interface fe80::2 --discovery neighbours "
            "--port 20012 --neighbour-ports '10.0.0.9:20000,10.0.0.1:20008,[fe80::2]:20016,10.0.0.9:20020' --wait 60\n"
            "CONSORT_KEY=\"$CONSORT_KEY\" /opt/bin/consort-agent --ids 4 --run demo --domain 7 --interface fe80::2 --discovery neighbours "
            "--port 20016 --neighbour-ports '10.0.0.9:20000,10.0.0.1:20004,[fe80::2]:20012,10.0.0.9:20020' --wait 60\n");
}

TEST(Commands, OfARunOnOneHostAreThoseItStarts) {
  Planned run(experiment_on(complete(3), 2), {}, {});
  EXPECT_EQ(all_commands(run.options, run.placement, run.wiring),
            "# this host\nconsort-agent --ids 1-2 --run demo --domain 7 --interface lo --port 20000\n"
            "consort-agent --ids 3 --run demo --domain 7 --interface lo --port 20000\n");
}

TEST(Commands, OfAnOpenRunUseTheDomainsPortsAndNoTag) {
  Planned run(experiment_on(ring(100), 1), {}, {});
  EXPECT_TRUE(run.wiring.neighbours);
  run.options.open_domain = true;
  run.placement = place_for(run.experiment, run.options);
  run.wiring = Wiring::of(run.experiment, run.options, run.placement);
  EXPECT_EQ(run.wiring.ports(), 0U);
  EXPECT_TRUE(all_commands(run.options, run.placement, run.wiring)
                  .starts_with("# this host\nconsort-agent --ids 1 --run demo --domain 7 --interface lo --open-domain --tuned\n"));
}

TEST(Commands, AreWordsOfAShellsLine) {
  EXPECT_EQ(shell_line({"a b", "", "it's", "--x=1"}), "'a b' '' 'it'\\''s' --x=1");
  EXPECT_EQ(connection_to({.name = "a", .address = "me@a", .consort = "~/my bin/consort"}).back(), "exec ~/'my bin/consort' lend");
}

}  // namespace
}  // namespace consort
