/// Runs over several hosts: real ssh, real agents, the trace of simulate; whatever dies, nothing is left.

#include "tests/hosts/network.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <map>
#include <regex>
#include <string>

namespace consort::hosts {
namespace {

constexpr const char* kKey = "a-key-of-the-tests-own";

class Hosts : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(network_.missing(), "");
    setenv("CONSORT_KEY", kKey, 1);
  }
  void TearDown() override {
    EXPECT_TRUE(eventually([&] { return lent().empty(); })) << "left: " << lent().size();
  }

  /// Of `consort run`, whose experiment has that many agents; `more` goes on top.
  static std::string experiment(int agents, const std::string& more, int rounds = 200) {
    return fmt::format(
        "experiment: far\nseed: 3\nrounds: {}\nagents: {{count: {}, protocol: local_voting, initial: {{x: {{linspace: [0, 9]}}}}}}\n"
        "topology: ring\nlinks: {{loss: 0.1}}\n{}",
        rounds, agents, more);
  }
  std::unique_ptr<Program> run(const std::string& text, const std::string& options) {
    const auto file = folder_.write("far.yaml", text);
    return network_.on(
        0, fmt::format("cd {} && exec consort run {} --quiet --json --no-report {}", folder_.path().string(), file.string(), options));
  }
  static std::string hash(const Program& program) {
    const auto summary = nlohmann::json::parse(program.out(), nullptr, false);
    return summary.is_object() ? summary.value("trace_hash", "none") : program.out() + program.err();
  }
  std::string simulated() {
    const auto program = run(text_of(folder_.path() / "far.yaml"), "--mode simulate --output sim");
    EXPECT_EQ(program->wait(), 0) << program->err();
    return hash(*program);
  }

  struct Process {
    pid_t pid;
    std::string command, environment;
  };
  /// What runs on behalf of this test's runs: agents, plants, and the far ends of connections.
  [[nodiscard]] static std::vector<Process> lent(const std::string& which = "consort-agent|consort-plant|consort.lend") {
    std::vector<Process> found;
    const std::regex wanted(which);
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
      const std::string name = entry.path().filename();
      if (name.find_first_not_of("0123456789") != std::string::npos) continue;
      std::string command = text_of(entry.path() / "cmdline");
      std::replace(command.begin(), command.end(), '\0', ' ');
      if (network_of_test(entry.path()) && std::regex_search(command, wanted))
        found.push_back({std::stoi(name), std::move(command), text_of(entry.path() / "environ")});
    }
    return found;
  }
  /// Others on this machine may run the same programs.
  static bool network_of_test(const std::filesystem::path& process) { return Network::instance().has((process / "ns/net").string()); }

  Network& network_ = Network::instance();
  Folder folder_;
};

/// Of node1 to node4, so many processes on each.
std::string four_hosts(std::size_t slots) {
  std::string text;
  for (int h = 1; h <= Network::kHosts; ++h) text += fmt::format("- {{name: node{}, slots: {}, consort: {}/consort}}\n", h, slots, kBinDir);
  return text;
}

/// A shipped list; its programs lie where the test has them.
std::string shipped(const char* name) {
  const std::string text = text_of(std::filesystem::path(kSourceDir) / "deploy/examples" / name);
  return std::regex_replace(text, std::regex(R"(\{name: node)"), fmt::format("{{consort: {}/consort, name: node", kBinDir));
}

TEST_F(Hosts, TenAgentsOnEachOfFourGiveTheHashOfSimulateWhateverTheFileDoesToThem) {
  folder_.write("hosts.yaml", shipped("hosts-ssh.yaml"));
  const auto program = run(experiment(40,
                                      "plant: {model: integrator, initial: {position: {linspace: [0, 1]}}}\n"
                                      "events: [{round: 50, kill: 7}, {round: 90, restart: 7}, {round: 120, stop: 33}, "
                                      "{round: 130, continue: 33}]\n"),
                           "--hosts hosts.yaml --ports 21000 --output out");
  EXPECT_TRUE(eventually([&] { return program->over() || lent("consort-agent").size() >= 40; }));
  for (const Process& process : lent("consort-agent|consort.lend")) {
    EXPECT_EQ(process.command.find(kKey), std::string::npos);
    EXPECT_EQ(process.environment.find(kKey), std::string::npos) << process.command;
  }
  EXPECT_EQ(program->wait(), 0) << program->err();
  EXPECT_EQ(hash(*program), simulated());
  EXPECT_NE(text_of(folder_.path() / "out/logs/agent-17.log").find("epoch 1"), std::string::npos) << "logs come back";
}

TEST_F(Hosts, OneOfEachKindTakesPartInARun) {
  folder_.write("hosts.yaml", shipped("hosts-by-hand.yaml"));
  const auto program = run(experiment(6, ""), "--hosts hosts.yaml --output out");
  std::vector<std::unique_ptr<Program>> by_hand;
  for (const int agent : {5, 6}) {
    const std::string beginning = fmt::format("waiting for agent {} on bench: ", agent);
    ASSERT_TRUE(eventually([&] { return program->over() || program->err().find(beginning) != std::string::npos; }));
    const std::string said = program->err();
    const auto at = said.find(beginning);
    ASSERT_NE(at, std::string::npos) << said;
    by_hand.push_back(network_.on(3, said.substr(at + beginning.size(), said.find('\n', at) - at - beginning.size())));
  }
  EXPECT_EQ(program->wait(), 0) << program->err();
  for (const auto& agent : by_hand) EXPECT_EQ(agent->wait(), 0) << agent->err();
  EXPECT_EQ(hash(*program), simulated());
}

TEST_F(Hosts, AHostFileOfOpenMpiSaysWhereEveryCommandGoes) {
  folder_.write("hostfile", shipped("hostfile"));
  const auto program = run(experiment(40, ""), "--hosts hostfile --dry-run --name demo --ports 20000");
  EXPECT_EQ(program->wait(), 0) << program->err();
  const std::string out = program->out();
  EXPECT_EQ(std::count(out.begin(), out.end(), '\n'), 3 + 40) << out;
  EXPECT_NE(
      out.find("# this host\nconsort-agent --ids 1 --run demo --domain 0 --interface 10.77.0.254 --discovery neighbours --port 20008 "),
      std::string::npos)
      << out;
  EXPECT_NE(out.find("# node2, over ssh -T "), std::string::npos) << out;
  EXPECT_NE(out.find("10.77.0.2:20164"), std::string::npos) << out;
  EXPECT_TRUE(lent().empty());
}

TEST_F(Hosts, WhoeverIsKilledNothingIsLeftAndTheCulpritIsNamed) {
  folder_.write("hosts.yaml", four_hosts(2));
  const std::string endless = experiment(8, "stop: {deadline: 600 s}\n", 1'000'000'000);
  const auto begins = [&](Program& program) { return eventually([&] { return program.over() || lent("consort-agent").size() >= 8; }); };
  {  // the orchestrator
    const auto program = run(endless, "--hosts hosts.yaml --output killed");
    ASSERT_TRUE(begins(*program)) << program->err();
    program->signal(SIGKILL);
    EXPECT_TRUE(eventually([&] { return lent().empty(); }));
  }
  const auto end_of = [&](const std::string& which, const char* output) {
    const auto program = run(endless, std::string("--hosts hosts.yaml --output ") + output);
    EXPECT_TRUE(begins(*program)) << program->err();
    for (const Process& process : lent(which)) kill(process.pid, SIGKILL);
    EXPECT_EQ(program->wait(), 3) << program->err();
    return program->err();
  };
  const std::string agent = end_of("--ids.5", "agent");
  EXPECT_TRUE(std::regex_search(agent, std::regex(R"(agent-5 \(pid \d+ on node3\) was killed by signal 9)"))) << agent;
  const std::string far_end = end_of("consort.lend", "lend");
  EXPECT_NE(far_end.find("is out of reach: the connection to node"), std::string::npos) << far_end;
}

TEST_F(Hosts, ACutShorterThanTheSilenceIsGoneThroughAndALongerOneNamesWhoWasCut) {
  folder_.write("hosts.yaml",
                fmt::format("- {{name: here, launcher: local, slots: 3}}\n- {{name: bench, address: {}, launcher: manual, agents: 4}}\n",
                            address(3)));
  const auto by_hand = [&](Program& program) {
    const std::string beginning = "waiting for agent 4 on bench: ";
    EXPECT_TRUE(eventually([&] { return program.over() || program.err().find(beginning) != std::string::npos; }));
    const std::string said = program.err();
    const std::size_t at = std::min(said.find(beginning), said.size() - beginning.size());
    return network_.on(3, said.substr(at + beginning.size(), said.find('\n', at) - at - beginning.size()));
  };
  const auto rounds = [&](const char* output) {
    return network_
               .on(0, fmt::format("cd {} && test $(python3 -c \"import sqlite3; print(sqlite3.connect('{}/record.sqlite')"
                                  ".execute('select count(*) from estimates').fetchone()[0])\") -gt 100",
                                  folder_.path().string(), output))
               ->wait() == 0;
  };
  const auto link = [&](const char* state) { EXPECT_EQ(network_.on(0, fmt::format("ip link set v3 {}", state))->wait(), 0); };
  {
    const auto program =
        run(experiment(4, "dt: 0.1\ntelemetry: {every: 10}\ntransport: {silence: 60 s}\n", 30'000), "--hosts hosts.yaml --output short");
    const auto agent = by_hand(*program);
    EXPECT_TRUE(eventually([&] { return program->over() || rounds("short"); })) << program->err();
    link("down");
    poll(nullptr, 0, 3000);
    link("up");
    EXPECT_EQ(program->wait(), 0) << program->err();
    EXPECT_EQ(agent->wait(), 0) << agent->err();
    EXPECT_EQ(hash(*program), simulated());
  }
  const auto program =
      run(experiment(4, "dt: 0.1\ntelemetry: {every: 10}\ntransport: {silence: 2 s}\nstop: {deadline: 600 s}\n", 1'000'000'000),
          "--hosts hosts.yaml --output long");
  const auto agent = by_hand(*program);
  EXPECT_TRUE(eventually([&] { return program->over() || rounds("long"); })) << program->err();
  link("down");
  EXPECT_EQ(program->wait(), 3) << program->err();
  EXPECT_TRUE(std::regex_search(program->err(), std::regex(R"(agent-4 \(pid .*has given no sign of life for 2 s)"))) << program->err();
  EXPECT_EQ(agent->wait(), 3) << agent->err();
  EXPECT_NE(agent->err().find("the orchestrator disappeared"), std::string::npos) << agent->err();
  link("up");
}

TEST_F(Hosts, WhoCannotTakePartIsNamedWithTheRemedyAndNothingStarts) {
  const auto other = folder_.write(
      "other", "#!/bin/sh\necho '{\"lends\": \"0.0.1/abc/0.10.2/\", \"host\": \"old\", \"pid\": 1, \"arithmetic\": \"\"}'\ncat\n");
  chmod(other.c_str(), 0755);
  folder_.write("hosts.yaml",
                fmt::format("- {{name: node1, slots: 1, consort: {}/consort}}\n- {{name: node2, slots: 1, consort: {}}}\n"
                            "- {{name: node3, slots: 1, consort: /nowhere/consort}}\n- {{name: gone, address: 10.77.0.99, slots: 1}}\n",
                            kBinDir, other.string()));
  const auto program = run(experiment(4, ""), "--hosts hosts.yaml --output out");
  EXPECT_EQ(program->wait(), 3);
  const std::string said = program->err();
  for (const char* expected : {"host node2: ", "0.0.1", "install the same build on both",
                               "the connection to node3 has closed: ssh ended with code 127; is `consort` installed there",
                               "the connection to gone has closed: ssh ended with code 255; try `ssh -oBatchMode=yes 10.77.0.99 true`"})
    EXPECT_NE(said.find(expected), std::string::npos) << expected << "\nin\n" << said;
  EXPECT_EQ(said.find("node1"), std::string::npos) << said;
}

TEST_F(Hosts, TheDoctorExaminesEachOverItsConnection) {
  folder_.write("hosts.yaml", four_hosts(2));
  const auto program = network_.on(0, fmt::format("cd {} && exec consort doctor --hosts hosts.yaml --json", folder_.path().string()));
  program->wait();  // limits of this machine may not suffice for a thousand agents
  const auto found = nlohmann::json::parse(program->out(), nullptr, false);
  ASSERT_TRUE(found.is_object()) << program->out() << program->err();
  for (int h = 1; h <= Network::kHosts; ++h) {
    std::map<std::string, bool> well;
    for (const auto& check : found.at("hosts").at(fmt::format("node{}", h))) well[check.at("name")] = check.at("well");
    for (const char* name : {"connection", "build", "arithmetic", "clock", "address", "multicast"})
      EXPECT_TRUE(well[name]) << h << ": " << name << found;
  }
}

}  // namespace
}  // namespace consort::hosts
