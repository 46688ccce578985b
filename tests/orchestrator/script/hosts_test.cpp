/// The hosts of a run, as files list them: YAML, an experiment's own, a host file of OpenMPI.

#include "orchestrator/script/hosts.hpp"

#include "core/errors.hpp"
#include "orchestrator/script/script.hpp"
#include "tests/support/program.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

constexpr const char* kExperiment =
    "experiment: e\nagents: {count: 6, protocol: local_voting, initial: {x: 0}}\ntopology: ring\nrounds: 5\n";

std::vector<Host> of_experiment(const std::string& more, const std::filesystem::path& directory = ".",
                                const ScriptOverrides& overrides = {}) {
  std::vector<Host> hosts;
  parse_experiment(kExperiment + more, "e.yaml", directory, overrides, &hosts);
  return hosts;
}

std::string refusal(const std::function<void()>& read) {
  try {
    read();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(Hosts, AreAListWithWhatGoesWithoutSaying) {
  const auto hosts = parse_hosts(
      "- {name: a, slots: 4}\n- {address: me@b.lab, interface: eth1, consort: ~/bin/consort}\n"
      "- {name: here, address: localhost, agents: '0,1-2'}\n- {name: c, launcher: manual, agents: 5}\n",
      "hosts.yaml");
  ASSERT_EQ(hosts.size(), 4u);
  EXPECT_EQ(hosts[0], (Host{.name = "a", .address = "a", .slots = 4}));
  EXPECT_EQ(hosts[1], (Host{.name = "b.lab", .address = "me@b.lab", .interface = "eth1", .consort = "~/bin/consort"}));
  EXPECT_EQ(hosts[2], (Host{.name = "here", .address = "localhost", .launcher = Launcher::local, .agents = {0, 1, 2}}));
  EXPECT_EQ(hosts[3], (Host{.name = "c", .address = "c", .launcher = Launcher::manual, .agents = {5}}));
  EXPECT_EQ(parse_hosts("hosts: [{name: a, slots: 4}]\n", "hosts.yaml").at(0), hosts[0]);
}

TEST(Hosts, AreReadFromAHostFileOfOpenMpi) {
  const auto hosts =
      parse_hosts("# two nodes\nnode1 slots=4 max_slots=3\nnode2\nme.lab user=me slots=2 # mine\nnode2\n\nlocalhost slots=1\n", "hostfile");
  ASSERT_EQ(hosts.size(), 4u);
  EXPECT_EQ(hosts[0], (Host{.name = "node1", .address = "node1", .slots = 3}));
  EXPECT_EQ(hosts[1], (Host{.name = "node2", .address = "node2", .slots = 2})) << "a name that comes again is another slot";
  EXPECT_EQ(hosts[2].address, "me@me.lab");
  EXPECT_EQ(hosts[3].launcher, Launcher::local);
  const std::string wrong = refusal([] { parse_hosts("node1 slots=4\nnode2 slots=some\n", "hostfile"); });
  EXPECT_NE(wrong.find("hostfile:2:1: found 'slots=some'; allowed: slots=N, max_slots=N, user=NAME"), std::string::npos) << wrong;
}

TEST(Hosts, OfAnExperimentStandInItOrInAFileItNames) {
  const Folder folder;
  folder.write("nodes", "node1 slots=3\nnode2\n");
  const auto named = of_experiment("hosts: nodes\n", folder.path()),
             listed = of_experiment("hosts: [{name: node1, slots: 3}, {name: node2}]\n");
  EXPECT_EQ(named, listed);
  EXPECT_TRUE(of_experiment("").empty());
  const ScriptOverrides line{.hosts = parse_hosts("- {name: other}\n", "h")};
  EXPECT_EQ(of_experiment("hosts: nodes\n", folder.path(), line).at(0).name, "other") << "the command line wins";
}

TEST(Hosts, APlacementSaysWhichAgentsAreOnWhichHost) {
  const auto hosts = of_experiment("hosts: [{name: a, slots: 1}, {name: b}]\nplacement: {hosts: {a: 0-4, b: '5,6'}}\n");
  EXPECT_EQ(hosts[0].agents, (std::vector<std::uint32_t>{0, 1, 2, 3, 4}));
  EXPECT_FALSE(hosts[0].slots);
  EXPECT_EQ(hosts[1].agents, (std::vector<std::uint32_t>{5, 6}));
}

TEST(Hosts, AreKeptWithTheResolvedExperiment) {
  std::vector<Host> before, after;
  const std::string more = "hosts: [{name: a, slots: 2}, {name: b, address: x@b, agents: '3-5', interface: eth0, launcher: manual}]\n";
  const Experiment experiment = parse_experiment(kExperiment + more, "e.yaml", ".", {}, &before);
  parse_experiment(experiment.resolved_text, "r.yaml", ".", {}, &after);
  EXPECT_EQ(before, after);
  EXPECT_EQ(experiment.resolved_text.find("hosts: nodes"), std::string::npos);
}

TEST(Hosts, WhatIsWrongIsNamedWithItsPlace) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"hosts: 3\n", "hosts: "},
      {"hosts: []\n", "hosts: found an empty list; allowed: a list of hosts"},
      {"hosts: [{slots: 2}]\n", "hosts[1]: found neither 'name' nor 'address'"},
      {"hosts: [{name: a, slots: 0}]\n", "hosts[1].slots"},
      {"hosts: [{name: a, slots: 2, agents: 1-2}]\n", "hosts[1]: found both 'agents' and 'slots'"},
      {"hosts: [{name: a, agents: 2-1}]\n", "hosts[1].agents 2-1: found the range 2-1"},
      {"hosts: [{name: a, agents: [1, 2]}]\n", "hosts[1].agents: found a list of 2; allowed: ids"},
      {"hosts: [{name: a, lancher: ssh}]\n", "did you mean 'launcher'"},
      {"hosts: [{name: a, launcher: rsh}]\n", "allowed: local, ssh, manual, slurm"},
      {"hosts: [{name: -oProxyCommand=x}]\n", "allowed: a word without '/' that begins with no '-'"},
      {"hosts: [{name: ../a}]\n", "hosts[1].name: found '../a'; allowed: a word without '/'"},
      {"hosts: [{name: a}, {name: a}]\n", "hosts: found 'a' twice"},
      {"hosts: [{name: a, agents: 1-3}, {name: b, agents: 3-4}]\n", "hosts: found agent 3 on a and on b"},
      {"hosts: [{name: node1}]\nplacement: {hosts: {node2: 1}}\n", "placement.hosts: found 'node2'; allowed: node1"},
      {"hosts: nowhere.yaml\n", "e.yaml:5:8: hosts: ./nowhere.yaml: "}};
  for (const auto& [text, expected] : cases) {
    const std::string said = refusal([&more = text] { of_experiment(more); });
    EXPECT_NE(said.find(expected), std::string::npos) << text << said;
    EXPECT_TRUE(said.starts_with("e.yaml:")) << said;
  }
}

}  // namespace
}  // namespace consort
