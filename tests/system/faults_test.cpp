/// What happens when a person interrupts, a process dies, or somebody never comes: real programs, real signals.

#include "idl/trust.hpp"
#include "tests/support/process_run.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/socket.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <csignal>

namespace consort {
namespace {

/// Longer than any test waits: it ends only by what the test does to it.
constexpr const char* kEndless = R"(
experiment: endless
seed: 1
rounds: 100000000
dt: 0.01
agents: {count: 6, protocol: local_voting, initial: {x: {linspace: [0, 1]}}}
topology: ring
telemetry: {every: 1000}
stop: {deadline: 600 s}
)";

constexpr const char* kShort = R"(
experiment: short
seed: 1
rounds: 40
dt: 0.1
agents: {count: 5, protocol: local_voting, initial: {x: {linspace: [0, 1]}}}
topology: ring
stop: {deadline: 120 s}
)";

struct Command {
  explicit Command(const std::string& text, std::vector<std::string> more = {}, const std::string& mode = "lockstep") {
    std::vector<std::string> arguments{"run", folder.write("experiment.yaml", text), "--mode", mode, "--output", output()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    program = std::make_unique<Program>(folder, "consort", arguments);
  }
  [[nodiscard]] std::string output() const { return folder.path() / "result"; }
  [[nodiscard]] nlohmann::json summary() const { return nlohmann::json::parse(text_of(folder.path() / "result" / "summary.json")); }
  /// Rounds are being recorded.
  [[nodiscard]] bool goes_on() const { return estimates() > 0; }
  [[nodiscard]] long estimates() const { return rows_of("estimates"); }
  [[nodiscard]] long rows_of(const std::string& table) const {
    sqlite3* database = nullptr;
    long rows = -1;
    const std::string file = output() + "/record.sqlite";
    if (std::filesystem::exists(file) && sqlite3_open_v2(file.c_str(), &database, SQLITE_OPEN_READONLY, nullptr) == SQLITE_OK) {
      sqlite3_stmt* statement = nullptr;
      if (sqlite3_prepare_v2(database, ("SELECT count(*) FROM " + table).c_str(), -1, &statement, nullptr) == SQLITE_OK &&
          sqlite3_step(statement) == SQLITE_ROW) {
        rows = sqlite3_column_int(statement, 0);
      }
      sqlite3_finalize(statement);
    }
    sqlite3_close(database);
    return rows;
  }

  Folder folder;
  std::unique_ptr<Program> program;
};

void expect_none_left(const std::vector<pid_t>& pids, double seconds) {
  EXPECT_TRUE(eventually([&] { return std::none_of(pids.begin(), pids.end(), runs); }, seconds)) << "agent processes are left";
}

/// The child that hosts this agent alone.
pid_t process_of(const std::vector<pid_t>& children, char id) {
  const std::string option = std::string("--ids\0", 6) + id;
  const auto found = std::find_if(children.begin(), children.end(), [&](pid_t pid) {
    return text_of("/proc/" + std::to_string(pid) + "/cmdline").find(option) != std::string::npos;
  });
  EXPECT_NE(found, children.end()) << "no process of agent " << id;
  return found == children.end() ? 0 : *found;
}

TEST(Faults, SignalsEndARunCleanlyWithItsRecordIntact) {
  for (const auto& [signal, code] : {std::pair{SIGINT, 130}, std::pair{SIGTERM, 143}}) {
    SCOPED_TRACE(signal);
    Command run(kEndless);
    ASSERT_TRUE(eventually([&] { return run.goes_on(); })) << run.program->err();
    const auto children = run.program->children();
    EXPECT_EQ(children.size(), 6u);
    run.program->signal(signal);
    EXPECT_EQ(run.program->wait(60), code) << run.program->err();
    expect_none_left(children, 5);
    EXPECT_GT(run.estimates(), 0);
    EXPECT_EQ(run.summary().at("exit"), code);
    EXPECT_EQ(run.summary().at("complete"), false);
    EXPECT_EQ(run.summary().at("ending"), "signal");
    EXPECT_NE(run.program->out().find("INCOMPLETE"), std::string::npos) << run.program->out();
  }
}

TEST(Faults, AKilledAgentEndsTheRunNamingAgentSignalAndLog) {
  Command run(kEndless);
  ASSERT_TRUE(eventually([&] { return run.goes_on(); })) << run.program->err();
  const auto children = run.program->children();
  ASSERT_EQ(children.size(), 6u);
  const std::string line = text_of("/proc/" + std::to_string(children[3]) + "/cmdline");
  const std::string id = line.substr(line.find("--ids") + 6, 1);
  kill(children[3], SIGKILL);
  EXPECT_EQ(run.program->wait(60), 3);
  const std::string err = run.program->err();
  EXPECT_NE(err.find("agent-" + id), std::string::npos) << err;
  EXPECT_NE(err.find("SIGKILL"), std::string::npos) << err;
  EXPECT_NE(err.find("last lines of its log"), std::string::npos) << err;
  expect_none_left(children, 5);
  EXPECT_EQ(run.summary().at("exit"), 3);
  EXPECT_NE(run.summary().at("error").get<std::string>().find("SIGKILL"), std::string::npos);
  EXPECT_GT(run.estimates(), 0);
  EXPECT_EQ(run.summary().at("complete"), false);
  // The survivors have told of their links and of themselves, and the dead one had told of its links before.
  EXPECT_EQ(run.rows_of("processes"), 5);
  EXPECT_EQ(run.rows_of("links"), 12);
}

TEST(Faults, AKilledAgentIsGivenUpWhereTheFileSaysContinue) {
  // Slow enough that it runs when the agent dies, and comes to its end afterwards.
  const std::string text = std::string(kEndless) + "on_agent_loss: continue\n";
  for (const char* plant : {"", "plant: {model: integrator, initial: {position: {linspace: [0, 1]}}}\n"}) {
    SCOPED_TRACE(plant);
    Command run(text + plant);
    ASSERT_TRUE(eventually([&] { return run.goes_on(); })) << run.program->err();
    const auto children = run.program->children();
    const pid_t third = process_of(children, '3');
    ASSERT_GT(third, 0);
    kill(third, SIGKILL);
    EXPECT_TRUE(eventually([&] { return run.program->err().find("loss in round") != std::string::npos; })) << run.program->err();
    EXPECT_NE(run.program->err().find("agent-3"), std::string::npos) << run.program->err();
    const long then = run.estimates();
    EXPECT_TRUE(eventually([&] { return run.estimates() > then + 100; })) << "the rest go on; " << run.program->err();
    run.program->signal(SIGTERM);
    EXPECT_EQ(run.program->wait(60), 143) << run.program->err();
    expect_none_left(children, 5);
  }
}

TEST(Faults, AfterAnUnplannedLossTheRestComesToTheLastRound) {
  std::string text = std::string(kEndless) + "on_agent_loss: continue\n";
  text.replace(text.find("100000000"), 9, "200000");
  Command run(text);
  ASSERT_TRUE(eventually([&] { return run.goes_on(); })) << run.program->err();
  const auto children = run.program->children();
  const pid_t second = process_of(children, '2'), third = process_of(children, '3');
  ASSERT_TRUE(second > 0 && third > 0);
  kill(second, SIGSTOP);  // so that the run cannot end before the loss
  kill(third, SIGKILL);
  EXPECT_TRUE(eventually([&] { return run.program->err().find("loss in round") != std::string::npos; })) << run.program->err();
  kill(second, SIGCONT);
  EXPECT_EQ(run.program->wait(), 0) << run.program->err();
  EXPECT_EQ(run.summary().at("rounds"), 200'000);
  EXPECT_EQ(run.summary().at("exit"), 0);
  EXPECT_EQ(run.summary().at("complete"), true) << "who was given up makes no run incomplete, but is named";
  EXPECT_EQ(run.summary().at("agents").dump().find("given_up") == std::string::npos, false) << run.summary().at("agents");
  EXPECT_NE(run.program->out().find("given up after round"), std::string::npos) << run.program->out();
  EXPECT_EQ(run.rows_of("links WHERE receiver = 3 AND delivered > 0"), 2) << "what the dead one had told of its links";
  expect_none_left(children, 5);
}

TEST(Faults, WithoutTheOrchestratorEverybodyWritesWhatItHoldsAndEnds) {
  for (const char* mode : {"lockstep", "realtime"}) {
    SCOPED_TRACE(mode);
    std::string text = std::string(kEndless) + "plant: {model: integrator, initial: {position: {linspace: [0, 1]}}}\n";
    if (mode == std::string("realtime")) text.replace(text.find("100000000"), 9, "50000");  // 500 s: the deadline is behind it
    Command run(text, {}, mode);
    ASSERT_TRUE(eventually([&] { return run.goes_on(); })) << run.program->err();
    const auto children = run.program->children();
    ASSERT_EQ(children.size(), 7u);
    kill(children[2], SIGSTOP);  // who is stopped must not be left either
    run.program->signal(SIGKILL);
    expect_none_left(children, 30);
    std::size_t told = 0;
    for (const auto& entry : std::filesystem::directory_iterator(run.output() + "/logs"))
      told += text_of(entry.path()).find("held: agent") != std::string::npos ? 1 : 0;
    EXPECT_EQ(told, 7u) << "the log of each process says what it held";
  }
}

TEST(Faults, TwoRunsOfOneExperimentDoNotDisturbEachOther) {
  Command first(kShort), second(kShort);
  EXPECT_EQ(first.program->wait(120), 0) << first.program->err();
  EXPECT_EQ(second.program->wait(120), 0) << second.program->err();
  EXPECT_EQ(first.summary().at("trace_hash"), second.summary().at("trace_hash"));
}

TEST(Faults, WhoIsScheduledToLeaveEndsItsProcessAndTheRestFinish) {
  const std::string text = std::string(kEndless) + "events: [{round: 3000, leave: 2}]\n";
  Command run(text);
  ASSERT_TRUE(eventually([&] { return run.goes_on(); })) << run.program->err();
  EXPECT_TRUE(eventually([&] { return run.program->children().size() == 5; })) << "the process of agent 2 goes on";
  const long then = run.estimates();
  EXPECT_TRUE(eventually([&] { return run.estimates() > then + 100; })) << run.program->err();
  EXPECT_EQ(run.program->children().size(), 5u);
  const auto children = run.program->children();
  run.program->signal(SIGINT);
  EXPECT_EQ(run.program->wait(60), 130) << run.program->err();
  expect_none_left(children, 5);
}

/// The closed loop of six agents, without end.
std::string endless_loop() { return std::string(kEndless) + "plant: {model: integrator, initial: {position: {linspace: [0, 1]}}}\n"; }

TEST(Faults, AKilledPlantEndsTheRunNamingIt) {
  Command run(endless_loop());
  ASSERT_TRUE(eventually([&] { return run.goes_on(); })) << run.program->err();
  const auto children = run.program->children();
  ASSERT_EQ(children.size(), 7u) << "six agents and the plant";
  const auto plant = std::find_if(children.begin(), children.end(), [](pid_t pid) {
    return text_of("/proc/" + std::to_string(pid) + "/cmdline").find("consort-plant") != std::string::npos;
  });
  ASSERT_NE(plant, children.end());
  kill(*plant, SIGKILL);
  EXPECT_EQ(run.program->wait(60), 3);
  const std::string err = run.program->err();
  EXPECT_NE(err.find("plant"), std::string::npos) << err;
  EXPECT_NE(err.find("SIGKILL"), std::string::npos) << err;
  expect_none_left(children, 5);
  EXPECT_GT(run.estimates(), 0);
}

TEST(PatientFaults, APlantThatStandsStillIsNamedByThoseWhoWait) {
  Command run(endless_loop());
  ASSERT_TRUE(eventually([&] { return run.goes_on(); })) << run.program->err();
  const auto children = run.program->children();
  ASSERT_EQ(children.size(), 7u);
  const auto plant = std::find_if(children.begin(), children.end(), [](pid_t pid) {
    return text_of("/proc/" + std::to_string(pid) + "/cmdline").find("consort-plant") != std::string::npos;
  });
  ASSERT_NE(plant, children.end());
  kill(*plant, SIGSTOP);
  EXPECT_TRUE(eventually([&] { return run.program->err().find("waits for its measurement") != std::string::npos; }, 60))
      << run.program->err();
  EXPECT_NE(run.program->err().find("no answer from plant"), std::string::npos) << run.program->err();
  kill(*plant, SIGCONT);
  run.program->signal(SIGTERM);
  EXPECT_EQ(run.program->wait(60), 143);
  expect_none_left(children, 5);
}

TEST(Faults, AKilledOrchestratorLeavesNoProcess) {
  for (const std::string& text : {std::string(kEndless), endless_loop()}) {
    Command run(text);
    ASSERT_TRUE(eventually([&] { return run.goes_on(); })) << run.program->err();
    const auto children = run.program->children();
    ASSERT_GE(children.size(), 6u);
    run.program->signal(SIGKILL);
    run.program->wait(60);
    expect_none_left(children, 5);
    EXPECT_GT(run.estimates(), 0) << "what was committed can be read";
  }
}

TEST(Faults, ARunWhoseAgentNeverAppearsTimesOutNamingIt) {
  Command run(
      "experiment: lonely\nrounds: 5\nagents: {count: 3, protocol: local_voting, initial: {x: {linspace: [0, 1]}}}\n"
      "topology: ring\ndt: 0.1\nstop: {deadline: 3 s}\n",
      {"--external", "2"});
  EXPECT_EQ(run.program->wait(60), 4) << run.program->err();
  EXPECT_NE(run.program->err().find("never appeared: agent-2; to be started by hand"), std::string::npos) << run.program->err();
}

TEST(Faults, AStalledRunTimesOutSayingWhoWaitsForWhom) {
  std::string text = kEndless;
  text.replace(text.find("600 s"), 5, "8 s");
  Command run(text);
  ASSERT_TRUE(eventually([&] { return run.goes_on(); })) << run.program->err();
  const auto children = run.program->children();
  ASSERT_EQ(children.size(), 6u);
  const std::string line = text_of("/proc/" + std::to_string(children[2]) + "/cmdline");
  const std::string id = line.substr(line.find("--ids") + 6, 1);
  kill(children[2], SIGSTOP);
  EXPECT_EQ(run.program->wait(120), 4);
  const std::string err = run.program->err();
  EXPECT_NE(err.find("waits in round"), std::string::npos) << err;
  EXPECT_NE(err.find("no answer from agent-" + id), std::string::npos) << err;
  expect_none_left(children, 5);
}

TEST(Faults, TwoRunsAtOnceAreIndependent) {
  Command first(kShort, {"--json"}), second(kShort, {"--json"});
  EXPECT_EQ(first.program->wait(), 0) << first.program->err();
  EXPECT_EQ(second.program->wait(), 0) << second.program->err();
  EXPECT_EQ(first.summary().at("trace_hash"), second.summary().at("trace_hash"));
}

TEST(Faults, TwoRunsInTheSameDomainAreIndependent) {
  Command first(kShort, {"--domain", "61"}), second(kShort, {"--domain", "61", "--seed", "1"});
  EXPECT_EQ(first.program->wait(), 0) << first.program->err();
  EXPECT_EQ(second.program->wait(), 0) << second.program->err();
  EXPECT_EQ(first.summary().at("trace_hash"), second.summary().at("trace_hash"));
}

/// The runs and agents started under it know each other.
class SharedKey {
 public:
  SharedKey() { setenv(wire::RunKey::kVariable, wire::RunKey::random_secret().c_str(), 1); }
  ~SharedKey() { unsetenv(wire::RunKey::kVariable); }
  SharedKey(const SharedKey&) = delete;
  SharedKey& operator=(const SharedKey&) = delete;
};

/// An agent started by hand, before or after the orchestrator, joins; the result is the one of a launched run.
TEST(Faults, AnAgentStartedByHandJoinsInWhateverOrder) {
  Command launched(kShort);
  ASSERT_EQ(launched.program->wait(), 0) << launched.program->err();
  const SharedKey key;
  for (const bool agent_first : {true, false}) {
    SCOPED_TRACE(agent_first);
    const std::string name = unique_run_name("by-hand");
    const Folder folder;
    const std::vector<std::string> by_hand{"--id", "4", "--run", name, "--domain", "62"};
    std::unique_ptr<Program> agent;
    if (agent_first) {
      agent = std::make_unique<Program>(folder, "consort-agent", by_hand);
      ASSERT_TRUE(eventually([&] { return !agent->err().empty(); })) << "the agent logs that it says hello";
    }
    Command run(kShort, {"--name", name, "--domain", "62", "--external", "4"});
    if (!agent_first) {
      ASSERT_TRUE(eventually([&] { return run.program->children().size() == 4; }));
      agent = std::make_unique<Program>(folder, "consort-agent", by_hand);
    }
    EXPECT_EQ(run.program->wait(), 0) << run.program->err();
    EXPECT_EQ(agent->wait(60), 0) << agent->err();
    EXPECT_EQ(run.summary().at("trace_hash"), launched.summary().at("trace_hash"));
  }
}

/// One line of `consort run --external`, from "waiting for agents 3-4: " on.
std::string printed_command(Command& run, const std::string& whom) {
  const std::string beginning = "waiting for " + whom + ": ";
  EXPECT_TRUE(eventually([&] {
    const std::string err = run.program->err();
    const auto at = err.find(beginning);
    return at != std::string::npos && err.find('\n', at) != std::string::npos;
  })) << run.program->err();
  const std::string err = run.program->err();
  const auto at = err.find(beginning) + beginning.size();
  return err.substr(at, err.find('\n', at) - at);
}

TEST(Faults, TheLinesThatARunPrintsStartItsProcessesAsTheyStand) {
  const Folder folder;
  const std::string loop =
      std::string(kShort) + "plant: {model: integrator, initial: {position: {linspace: [0, 1]}}}\nplacement: {agents_per_process: 2}\n";
  Command run(loop, {"--name", unique_run_name("it's-typed"), "--domain", "64", "--external", "0,3"});
  std::vector<std::unique_ptr<Program>> by_hand;
  for (const std::string whom : {"the plant", "agents 3-4"})
    by_hand.push_back(std::make_unique<Program>(
        folder, "/bin/sh", std::vector<std::string>{"-c", "PATH=" + std::string(kBinDir) + ":$PATH; " + printed_command(run, whom)}));
  EXPECT_EQ(run.program->wait(), 0) << run.program->err();
  for (const auto& program : by_hand) EXPECT_EQ(program->wait(60), 0) << program->err();
}

TEST(Faults, AnInterfaceThatIsNotThereIsRefusedInOurWords) {
  const Folder folder;
  for (const std::string name : {"consort-agent", "consort-plant"}) {
    std::vector<std::string> arguments{"--run", "none", "--domain", "64", "--interface", "nix0"};
    if (name == "consort-agent") arguments.insert(arguments.end(), {"--id", "4"});
    Program program(folder, name, arguments);
    EXPECT_EQ(program.wait(60), 2) << program.err();
    EXPECT_EQ(program.err().find(name + ": --interface: found 'nix0', which this host does not have; allowed: "), 0u) << program.err();
  }
}

TEST(Faults, APlantStartedByHandJoins) {
  const std::string loop = std::string(kShort) + "plant: {model: integrator, initial: {position: {linspace: [0, 1]}}}\n";
  Command launched(loop);
  ASSERT_EQ(launched.program->wait(), 0) << launched.program->err();
  const SharedKey key;
  const std::string name = unique_run_name("plant-by-hand");
  const Folder folder;
  Command run(loop, {"--name", name, "--domain", "64", "--external", "0"});
  ASSERT_TRUE(eventually([&] { return run.program->children().size() == 5; }));
  Program plant(folder, "consort-plant", {"--run", name, "--domain", "64"});
  EXPECT_EQ(run.program->wait(), 0) << run.program->err();
  EXPECT_EQ(plant.wait(60), 0) << plant.err();
  EXPECT_EQ(run.summary().at("trace_hash"), launched.summary().at("trace_hash"));
}

TEST(Faults, AnAgentStartedByHandLeavesWhenItsOrchestratorIsKilled) {
  const SharedKey key;
  const std::string name = unique_run_name("orphan");
  const Folder folder;
  Program agent(folder, "consort-agent", {"--id", "4", "--run", name, "--domain", "63"});
  Command run(kEndless, {"--name", name, "--domain", "63", "--external", "4"});
  ASSERT_TRUE(eventually([&] { return run.goes_on(); })) << run.program->err();
  run.program->signal(SIGKILL);
  run.program->wait(60);
  EXPECT_EQ(agent.wait(60), 3) << agent.err();
  EXPECT_NE(agent.err().find("orchestrator disappeared"), std::string::npos) << agent.err();
}

/// Nobody here waits for that process: its liveliness tells.
TEST(Faults, AnAgentStartedByHandThatIsKilledIsNoticed) {
  const SharedKey key;
  for (const bool goes_on : {false, true}) {
    SCOPED_TRACE(goes_on);
    const std::string name = unique_run_name("killed-by-hand");
    const Folder folder;
    Program agent(folder, "consort-agent", {"--id", "4", "--run", name, "--domain", "66"});
    Command run(std::string(kEndless) + (goes_on ? "on_agent_loss: continue\n" : ""),
                {"--name", name, "--domain", "66", "--external", "4"});
    ASSERT_TRUE(eventually([&] { return run.goes_on(); })) << run.program->err();
    agent.signal(SIGKILL);
    EXPECT_TRUE(eventually([&] { return run.program->err().find("no sign of life") != std::string::npos; })) << run.program->err();
    EXPECT_NE(run.program->err().find("agent-4 (pid "), std::string::npos) << run.program->err();
    if (goes_on) {
      const long then = run.estimates();
      EXPECT_TRUE(eventually([&] { return run.estimates() > then + 100; })) << "the rest go on; " << run.program->err();
      run.program->signal(SIGTERM);
    }
    EXPECT_EQ(run.program->wait(60), goes_on ? 143 : 3) << run.program->err();
  }
}

/// A cable that was out, a laptop that slept: both ends go on where they were.
TEST(Faults, AnAgentStartedByHandMayBeAwayForLessThanTheSilenceAllowed) {
  const SharedKey key;
  const std::string name = unique_run_name("away"),
                    text = std::string(kShort).replace(std::string(kShort).find("rounds: 40"), 10, "rounds: 20000") +
                           "links: {loss: 0.1}\ntransport: {silence: 60 s}\n";
  const Folder folder;
  Program agent(folder, "consort-agent", {"--id", "4", "--run", name, "--domain", "66"});
  Command run(text, {"--name", name, "--domain", "66", "--external", "4"});
  ASSERT_TRUE(eventually([&] { return run.goes_on(); })) << run.program->err();
  for (Program* sleeper : {&agent, run.program.get()}) {
    sleeper->signal(SIGSTOP);
    poll(nullptr, 0, 3000);  // DDS itself says after 0.7 s that it is silent
    sleeper->signal(SIGCONT);
  }
  EXPECT_EQ(run.program->wait(), 0) << run.program->err();
  EXPECT_EQ(agent.wait(), 0) << agent.err();
  Command simulated(text, {}, "simulate");
  EXPECT_EQ(simulated.program->wait(), 0);
  EXPECT_EQ(run.summary()["trace_hash"], simulated.summary()["trace_hash"]);
}

/// Both ends say at once what is wrong; the run goes on.
void expect_refused(Command& run, Program& stranger, const std::vector<std::string>& words) {
  EXPECT_EQ(stranger.wait(60), 3) << stranger.err();
  for (const std::string& word : words) {
    EXPECT_NE(stranger.err().find(word), std::string::npos) << word << " in " << stranger.err();
    EXPECT_TRUE(eventually([&] { return run.program->err().find(word) != std::string::npos; }, 60)) << word << " in " << run.program->err();
  }
  EXPECT_NE(run.program->err().find("may not take part"), std::string::npos) << run.program->err();
}

TEST(Faults, AnAgentTheRunDoesNotPlaceIsRefusedAtOnce) {
  const SharedKey key;
  const std::string name = unique_run_name("unplaced");
  const Folder folder;
  Command run(kShort, {"--name", name, "--domain", "64", "--external", "4-5"});
  Program stranger(folder, "consort-agent", {"--ids", "4-5", "--run", name, "--domain", "64"});
  expect_refused(run, stranger, {"agents 4-5 together", "--ids 4, --ids 5", "agents_per_process"});
  EXPECT_FALSE(run.program->over()) << "the right ones may still come";
  Program right(folder, "consort-agent", {"--ids", "4", "--run", name, "--domain", "64"});
  Program other(folder, "consort-agent", {"--ids", "5", "--run", name, "--domain", "64"});
  EXPECT_EQ(run.program->wait(), 0) << run.program->err();
}

TEST(Faults, ASecondProcessWithTheSameIdsIsRefusedByNameAndTheRunGoesOn) {
  const SharedKey key;
  const std::string name = unique_run_name("twice");
  const std::string loop = endless_loop() + "placement: {agents_per_process: 2}\nevents: [{round: 20, kill: 2}, {round: 40, restart: 2}]\n";
  const Folder folder;
  const std::vector<std::string> agents{"--ids", "3-4", "--run", name, "--domain", "66"}, plant{"--run", name, "--domain", "66"};
  Program first(folder, "consort-agent", agents), first_plant(folder, "consort-plant", plant);
  Command run(loop, {"--name", name, "--domain", "66", "--external", "0,3-4"});
  // At the start, where either may be the first ...
  ASSERT_TRUE(eventually([&] { return run.goes_on(); })) << run.program->err();
  // ... and on the way.
  Program second(folder, "consort-agent", agents), second_plant(folder, "consort-plant", plant);
  expect_refused(run, second, {"agents 3-4 are there already: pid " + std::to_string(first.pid())});
  expect_refused(run, second_plant, {"the plant is there already: pid " + std::to_string(first_plant.pid())});
  Program launched(folder, "consort-agent", {"--id", "1", "--run", name, "--domain", "66"});
  expect_refused(run, launched, {"--external 1"});
  const long then = run.estimates();
  EXPECT_TRUE(eventually([&] { return run.estimates() > then + 100; })) << run.program->err();
  run.program->signal(SIGTERM);
  EXPECT_EQ(run.program->wait(60), 143) << run.program->err();
  EXPECT_EQ(first.wait(60), 0) << first.err();
  EXPECT_EQ(first_plant.wait(60), 0) << first_plant.err();
}

TEST(Faults, AnAgentWithAnotherKeyIsNamedAtOnceAndEnds) {
  const std::string name = unique_run_name("keyless");
  const Folder folder;
  const std::vector<std::string> by_hand{"--id", "4", "--run", name, "--domain", "65"};
  const SharedKey key;
  Command run(kShort, {"--name", name, "--domain", "65", "--external", "4"});
  const std::string right = getenv(wire::RunKey::kVariable);
  setenv(wire::RunKey::kVariable, "not the key of this run", 1);
  Program agent(folder, "consort-agent", by_hand);
  EXPECT_EQ(agent.wait(60), 3) << agent.err();
  EXPECT_NE(agent.err().find("has another key"), std::string::npos) << agent.err();
  const std::string seen = "consort-agent of agent 4 (pid " + std::to_string(agent.pid());
  EXPECT_TRUE(eventually([&] { return run.program->err().find(seen) != std::string::npos; })) << run.program->err();
  EXPECT_NE(run.program->err().find("CONSORT_KEY"), std::string::npos) << run.program->err();
  setenv(wire::RunKey::kVariable, right.c_str(), 1);
  Program healed(folder, "consort-agent", by_hand);
  EXPECT_EQ(run.program->wait(), 0) << run.program->err();
  unsetenv(wire::RunKey::kVariable);
  Program without(folder, "consort-agent", by_hand);
  EXPECT_EQ(without.wait(60), 2);
  EXPECT_NE(without.err().find("CONSORT_KEY"), std::string::npos) << without.err();
}

TEST(Faults, WhoMeetsNoRunSaysWhatItLookedForAndEnds) {
  const SharedKey key;
  const Folder folder;
  Program agent(folder, "consort-agent", {"--id", "4", "--run", "nowhere", "--domain", "67", "--wait", "0.5"});
  Program plant(folder, "consort-plant", {"--run", "nowhere", "--domain", "67", "--wait", "0.5"});
  for (Program* program : {&agent, &plant}) {
    EXPECT_EQ(program->wait(60), 4) << program->err();
    for (const char* word : {"nowhere", "domain 67", "interface lo", "24150"})
      EXPECT_NE(program->err().find(word), std::string::npos) << word << " in " << program->err();
  }
}

TEST(Faults, AProcessOfAnotherBuildThanTheOrchestratorThatStartsItEndsNamingBoth) {
  const SharedKey key;
  const Folder folder;
  Program agent(folder, "consort-agent", {"--id", "4", "--run", "r", "--domain", "67", "--build", "99.0/abcdabcd/0.10.2"});
  EXPECT_EQ(agent.wait(60), 3);
  EXPECT_NE(agent.err().find("99.0 (wire abcdabcd"), std::string::npos) << agent.err();
  EXPECT_NE(agent.err().find(wire::Build::own().text()), std::string::npos) << agent.err();
}

/// Every packet of one run's discovery would wake all processes of the others, and runs would fail that have nothing to do with each other.
TEST(Faults, RunsInOneDomainDoNotShareItsPorts) {
  constexpr unsigned kDomain = 68;
  const int taken = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(7400 + 250 * kDomain);  // for this socket alone: whoever wants to listen there too cannot
  ASSERT_EQ(bind(taken, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  std::vector<std::unique_ptr<Command>> runs;
  for (int i = 0; i < 6; ++i)
    runs.push_back(std::make_unique<Command>(kShort, std::vector<std::string>{"--domain", std::to_string(kDomain)}));
  for (const auto& run : runs) EXPECT_EQ(run->program->wait(), 0) << run->program->err();
  close(taken);
}

TEST(Faults, BadOptionsOfTheAgentAreExplained) {
  const Folder folder;
  for (const char* ids : {"0", "x", "3-1", "1,,2", "1-"}) {
    Program agent(folder, "consort-agent", {"--ids", ids, "--run", "r", "--domain", "1"});
    EXPECT_EQ(agent.wait(60), 2) << ids;
    EXPECT_NE(agent.err().find("--ids"), std::string::npos) << agent.err();
  }
}

}  // namespace
}  // namespace consort
