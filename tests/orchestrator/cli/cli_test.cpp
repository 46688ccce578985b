#include "core/build.hpp"
#include "orchestrator/report/sqlite.hpp"
#include "orchestrator/report/terminal.hpp"
#include "tests/orchestrator/folder.hpp"
#include "tests/support/program.hpp"
#include "tests/support/tree.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>
#include <thread>

namespace consort {
namespace {

struct Answer {
  int code = -1;
  std::string out, err;
};

/// The real program in a folder of its own.
class Cli : public testing::Test {
 protected:
  /// Starts consort; `prepare` runs in the child before it. It does not outlive the tests, whatever becomes of them.
  pid_t start(std::vector<std::string> arguments, const std::function<void()>& prepare = {}) {
    arguments.insert(arguments.begin(), std::string(kBinDir) + "/consort");
    const pid_t child = ::fork();
    if (child != 0) return child;
    std::vector<char*> words;
    for (auto& argument : arguments) words.push_back(argument.data());
    words.push_back(nullptr);
    const int out = ::open((streams_.path() / "out").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    const int err = ::open((streams_.path() / "err").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    if (::chdir(folder_.path().c_str()) != 0 || ::dup2(out, STDOUT_FILENO) < 0 || ::dup2(err, STDERR_FILENO) < 0) ::_exit(126);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (prepare) prepare();
    ::execv(words.front(), words.data());
    ::_exit(127);
  }

  Answer wait(pid_t child) {
    int status = 0;
    EXPECT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status)) << "signal " << WTERMSIG(status);
    return {WEXITSTATUS(status), text_of(streams_.path() / "out"), text_of(streams_.path() / "err")};
  }

  Answer consort(std::vector<std::string> arguments, const std::function<void()>& prepare = {}) {
    return wait(start(std::move(arguments), prepare));
  }

  void write(const std::string& name, const std::string& text) { std::ofstream(folder_.path() / name) << text; }

  /// A small experiment, with lines of its own at the end.
  void write_ring(const std::string& more = "") {
    write("ring.yaml",
          "# Do five agents on a ring agree on the mean?\nexperiment: small_ring\nmode: simulate\nseed: 3\nrounds: 200\ndt: 0.25\n"
          "agents:\n  count: 5\n  protocol: local_voting\n  initial: {x: {linspace: [0, 4]}}\ntopology: ring\n" +
              more);
  }

  [[nodiscard]] std::filesystem::path only_result() const {
    std::filesystem::path found;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path() / "results")) {
      EXPECT_TRUE(found.empty()) << "more than one output folder";
      found = entry.path();
    }
    return found;
  }

  ScratchFolder folder_, streams_;
};

void expect_contains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "no '" << part << "' in:\n" << text;
}

TEST_F(Cli, RunThatEverybodyLeavesEndsWithThemAndMeetsNoCriterionOnThem) {
  const std::string leaving = "events: [{round: 50, leave: [1, 2, 3]}, {round: 60, kill: [4, 5]}]\n";
  write_ring(leaving);
  Answer answer = consort({"run", "ring.yaml", "--json", "--output", "without"});
  EXPECT_EQ(answer.code, 0) << answer.err;
  nlohmann::json summary = nlohmann::json::parse(answer.out);
  EXPECT_EQ(summary["rounds"], 60);
  EXPECT_EQ(summary["complete"], true);
  EXPECT_TRUE(summary["metrics"]["consensus_value"].is_null()) << summary["metrics"];
  write_ring(leaving + "criteria: [\"disagreement < 1e9\"]\n");
  answer = consort({"run", "ring.yaml", "--json", "--output", "with"});
  EXPECT_EQ(answer.code, 1) << answer.err;
  EXPECT_EQ(nlohmann::json::parse(answer.out)["criteria"][0]["met"], false);
}

TEST_F(Cli, RunPrintsTheTableAndFillsAFolder) {
  write_ring("criteria: [\"disagreement < 1e-6\", \"abs(bias) < 1e-9\"]\n");
  const Answer answer = consort({"run", "ring.yaml"});
  EXPECT_EQ(answer.code, 0) << answer.err;
  expect_contains(answer.out, "PASSED");
  expect_contains(answer.out, "consensus value");
  const auto folder = only_result();
  expect_contains(answer.out, "results/" + folder.filename().string());
  EXPECT_TRUE(folder.filename().string().starts_with("small_ring-"));
  expect_contains(text_of(folder / "experiment.yaml"), "small_ring");
  const auto host = nlohmann::json::parse(text_of(folder / "host.json"));
  EXPECT_EQ(host["seed"], 3);
  EXPECT_EQ(host["command_line"][1], "run");
  for (const char* version : {"consort", "cyclonedds", "eigen", "compiler"})
    EXPECT_FALSE(host["versions"][version].get<std::string>().empty());
  EXPECT_GT(host["cores"], 0);
  EXPECT_GT(host["memory_bytes"], 1 << 20);
  EXPECT_TRUE(std::filesystem::is_directory(folder / "logs"));
  EXPECT_EQ(nlohmann::json::parse(text_of(folder / "summary.json"))["passed"], true);
  Database database(folder / "record.sqlite", Database::Open::read);
  Statement rows = database.prepare("SELECT count(*), max(round) FROM estimates");
  ASSERT_TRUE(rows.step());
  EXPECT_EQ(rows.integer(0), 5 * 201);
  EXPECT_EQ(rows.integer(1), 200);
}

TEST_F(Cli, RunSaysBeforehandWhatTheoryWarnsOfAndAfterwardsThatItDiverged) {
  write("apart.yaml",
        "experiment: apart\nmode: simulate\nrounds: 300\ndt: 0.6\n"
        "agents: {count: 4, protocol: local_voting, initial: {x: [1, 2, 3, 10]}}\ntopology: ring\n");
  const Answer told = consort({"run", "apart.yaml", "--output", "told"});
  EXPECT_EQ(told.code, 0);
  expect_contains(told.err, "local_voting: all eigenvalues of I - dt L other than one 1 lie inside the unit circle");
  expect_contains(told.err, "dt = 0.6, allowed below 0.5");
  EXPECT_EQ(std::count(told.err.begin(), told.err.end(), '\n'), 1) << "a line for each condition that fails: " << told.err;
  expect_contains(told.out, "local_voting diverged: the disagreement rose from");
  const auto theory = nlohmann::json::parse(text_of(folder_.path() / "told" / "theory.json"));
  EXPECT_TRUE(std::any_of(theory.begin(), theory.end(), [](const auto& finding) { return finding["verdict"] == "fails"; }));
  const Answer quiet = consort({"run", "apart.yaml", "--json", "--quiet", "--output", "quiet"});
  EXPECT_EQ(quiet.err, "");
  const auto diverged = nlohmann::json::parse(quiet.out)["diverged"];
  ASSERT_EQ(diverged.size(), 1U);
  EXPECT_EQ(diverged[0]["protocol"], "local_voting");
  EXPECT_EQ(diverged[0]["of"], "disagreement");
  EXPECT_EQ(diverged[0]["from_round"], 150);
  EXPECT_EQ(diverged[0]["to_round"], 300);
  EXPECT_GT(diverged[0]["to"], 1e40);
}

TEST_F(Cli, GraphTellsAndDrawsWhatAnExperimentOrAnotherProgramHas) {
  write("path.edges", "anna bert\nbert carl 0.5\n");
  Answer answer = consort({"graph", "path.edges", "--both-ways"});
  EXPECT_EQ(answer.code, 0) << answer.err;
  EXPECT_EQ(answer.out,
            "3 agents: 4 edges, undirected, strongly connected, balanced\nin-degree 1 to 2, out-degree 1 to 2\n"
            "algebraic connectivity 0.633975\n");
  expect_contains(consort({"graph", "path.edges", "--svg"}).out, ">anna</text>");
  expect_contains(consort({"graph", "path.edges", "--dot"}).out, "\"bert\" -> \"carl\" [label=\"0.5\"]");
  write_ring();
  EXPECT_EQ(nlohmann::json::parse(consort({"graph", "ring.yaml", "--json"}).out)["edges"], 10);
  expect_contains(consort({"graph", "ring.yaml", "--graphml"}).out, "<edge source=\"1\" target=\"5\">");
  write("bad.edges", "1 2\n2 2\n");
  answer = consort({"graph", "bad.edges"});
  EXPECT_EQ(answer.code, 2);
  expect_contains(answer.err, "bad.edges:2: found an edge from '2' to '2'");
}

TEST_F(Cli, JsonOnStandardOutputIsTheSummary) {
  write_ring();
  const Answer answer = consort({"run", "ring.yaml", "--json", "--quiet", "--seed", "8", "--rounds", "30", "--output", "here"});
  EXPECT_EQ(answer.code, 0);
  EXPECT_EQ(answer.err, "") << "--quiet";
  EXPECT_EQ(answer.out, text_of(folder_.path() / "here" / "summary.json"));
  const auto json = nlohmann::json::parse(answer.out);
  EXPECT_EQ(json["seed"], 8);
  EXPECT_EQ(json["rounds"], 30);
  EXPECT_EQ(json["mode"], "simulate");
  EXPECT_EQ(json["output"], "here");
  EXPECT_NEAR(json["metrics"]["consensus_value"].get<double>(), 2.0, 1e-12) << "local voting keeps the mean";
  EXPECT_EQ(json["performance"]["messages_sent"], 5 * 2 * 30);
}

TEST_F(Cli, SameSeedGivesTheSameHashAnotherSeedAnother) {
  write_ring("links: {loss: 0.2}\n");
  const auto hash = [&](const char* seed) {
    return nlohmann::json::parse(consort({"run", "ring.yaml", "--json", "--quiet", "--seed", seed}).out)["trace_hash"].get<std::string>();
  };
  const std::string first = hash("5");
  EXPECT_EQ(hash("5"), first);
  EXPECT_NE(hash("6"), first);
}

TEST_F(Cli, UnmetCriterionExitsOne) {
  write_ring("criteria: [\"disagreement < -1\"]\n");
  const Answer answer = consort({"run", "ring.yaml"});
  EXPECT_EQ(answer.code, 1);
  expect_contains(answer.out, "NOT MET");
  EXPECT_EQ(nlohmann::json::parse(text_of(only_result() / "summary.json"))["exit"], 1);
}

TEST_F(Cli, MonteCarloGivesMeansAndDeviations) {
  write_ring("links: {loss: 0.2}\n");
  const auto json = nlohmann::json::parse(consort({"run", "ring.yaml", "--json", "--quiet", "--runs", "20"}).out);
  EXPECT_EQ(json["runs"], 20);
  EXPECT_TRUE(json["metrics"].contains("consensus_value.std"));
  EXPECT_GT(json["metrics"]["consensus_value.std"].get<double>(), 0.0) << "loss breaks the balance differently for each seed";
}

TEST_F(Cli, SeveralProtocolsStandSideBySide) {
  write("two.yaml",
        "experiment: two\nmode: simulate\nrounds: 20\nagents:\n  count: 4\n  protocols: [{name: kalman_consensus, Q: 0.1, Omega: 0.1}, "
        "{name: unbiased_kalman_consensus, Q: 0.1}]\n  initial: {x: {linspace: [0, 3]}, P: 1}\ntopology: complete\n");
  const Answer answer = consort({"run", "two.yaml", "--output", "out"});
  EXPECT_EQ(answer.code, 0) << answer.err;
  std::istringstream lines(answer.out);
  bool found = false;
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(shown_width(line), 80u) << line;
    found = found || (line.find("  kalman_consensus") != std::string::npos && line.find("unbiased_kalman_consensus") != std::string::npos);
  }
  EXPECT_TRUE(found) << answer.out;
  const auto json = nlohmann::json::parse(text_of(folder_.path() / "out" / "summary.json"));
  EXPECT_TRUE(json["metrics"].contains("kalman_consensus.bias"));
  EXPECT_TRUE(json["metrics"].contains("unbiased_kalman_consensus.bias"));
}

TEST_F(Cli, BadInputExitsTwoAndLeavesNothing) {
  write("bad.yaml", "experiment: bad\nagents:\n  count: 5\n  protocol: local_votin\n  initial: {x: 1}\ntopology: ring\n");
  write_ring();
  struct Case {
    std::vector<std::string> arguments;
    std::string expected;
  };
  const std::vector<Case> cases{
      {{"run", "bad.yaml"}, "local_voting"},
      {{"run", "bad.yaml"}, "bad.yaml:4:"},
      {{"run", "absent.yaml"}, "absent.yaml"},
      {{"run"}, "file is required"},
      {{"run", "ring.yaml", "--mode", "fast"}, "simulate"},
      {{"run", "ring.yaml", "--rounds", "0"}, "--rounds"},
      {{"run", "ring.yaml", "--domain", "300"}, "230"},
      {{"run", "ring.yaml", "--external", "2"}, "lockstep"},
      {{"run", "ring.yaml", "--mode", "lockstep", "--external", "7"}, "1 to 5"},
      {{"runn", "ring.yaml"}, "did you mean 'run'?"},
      {{"list", "colours"}, "topologies"},
      {{"run", "ring.yaml", "--sed", "3"}, "unknown option '--sed'; did you mean '--seed'?"},
      {{"run", "ring.yaml", "--mode", "simulat"}, "did you mean 'simulate'?"},
      {{"run", "ring.yaml", "--mode", "lockstep", "--interface", "nix0"}, "'nix0', which this host does not have; allowed: "},
      {{"run", "ring.yaml", "--mode", "lockstep", "--name", std::string(101, 'a')}, "--name: found 101 bytes; allowed: up to 100"},
      {{"run", "ring.yaml", "--hosts", "absent.hosts"}, "absent.hosts: "},
      {{"run", "ring.yaml", "--open-domain"}, "--open-domain: found mode simulate; allowed: mode lockstep or realtime"},
      {{"run", "ring.yaml", "--dry-run"}, "--dry-run: found mode simulate; allowed: mode lockstep or realtime"},
      {{"run", "ring.yaml", "--mode", "lockstep", "--ports", "20000"}, "--ports: found a run whose processes find each other by multicast"},
      {{"run", "ring.yaml", "--mode", "lockstep", "--launcher", "slurm"}, "--launcher slurm: found no allocation"},
      {{"list", "protocls"}, "did you mean 'protocols'?"},
      {{"list", "klman"}, "did you mean 'kalman_consensus'? It is in `consort list protocols`"},
      {{"list", "plants", "--quiet"}, "--quiet: found with list, which does nothing but print"},
      {{"export", "."}, "record.sqlite"},
      {{"run", "/dev/zero"}, "/dev/zero: is a device"},
      {{"validate", "bad.yaml"}, "local_voting"}};
  for (const auto& [arguments, expected] : cases) {
    SCOPED_TRACE(testing::PrintToString(arguments));
    const Answer answer = consort(arguments);
    EXPECT_EQ(answer.code, 2);
    EXPECT_EQ(answer.out, "");
    expect_contains(answer.err, expected);
    EXPECT_TRUE(answer.err.starts_with("consort: ")) << answer.err;
  }
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "results"));
}

TEST_F(Cli, NumbersOfOptionsAreWhatTheySayOrRefused) {
  write_ring();
  for (const std::string option : {"--seed", "--rounds", "--runs", "--agents-per-process", "--domain"}) {
    for (const std::string number : {"-1", "18446744073709551616", "3x", "0x3", "1e3", "nan"}) {
      const Answer answer = consort({"run", "ring.yaml", option + "=" + number});
      EXPECT_EQ(answer.code, 2) << option << " " << number;
      expect_contains(answer.err, option + ": found '" + number + "'; allowed: a whole number from ");
    }
  }
  expect_contains(consort({"run", "ring.yaml", "--runs", "1e3"}).err, "a whole number from 1 to 1000000, digits only; did you mean 1000?");
  expect_contains(consort({"run", "ring.yaml", "--rounds", "2000000000"}).err, "a whole number from 1 to 1000000000");
  EXPECT_EQ(consort({"run", "ring.yaml", "--seed", "-1"}).code, 2);
  const Answer ten = consort({"run", "ring.yaml", "--seed", "010", "--rounds", "5", "--json"});
  EXPECT_EQ(nlohmann::json::parse(ten.out)["seed"], 10);
}

TEST_F(Cli, EveryVerbAnswersInJson) {
  EXPECT_GE(nlohmann::json::parse(consort({"list", "protocols", "--json"}).out).size(), 10u);
  EXPECT_TRUE(nlohmann::json::parse(consort({"list", "plants", "--json"}).out)[0].contains("parameters"));
  for (const auto& [list, values] : std::map<std::string, std::vector<std::string>>{
           {"protocols", {"parameters", "initial", "estimate", "recorded"}}, {"plants", {"parameters", "initial", "couplings"}}}) {
    const std::string text = consort({"list", list}).out;
    for (const auto& entry : nlohmann::json::parse(consort({"list", list, "--json"}).out))
      for (const std::string& key : values)
        for (const auto& value : entry.at(key))
          EXPECT_NE(text.find(" " + value.at("name").get<std::string>() + ": "), std::string::npos) << entry["name"] << ", " << value;
  }
  EXPECT_NE(consort({"list", "plants"}).out.find("coupling A: what x_j does to x_i'"), std::string::npos);
  EXPECT_TRUE(nlohmann::json::parse(consort({"list", "topologies", "--json"}).out)[0].contains("form"));
  EXPECT_TRUE(nlohmann::json::parse(consort({"list", "metrics", "--json"}).out)[0].contains("summary"));
  const auto doctor = nlohmann::json::parse(consort({"doctor", "--json", "--interface", "nix0"}).out);
  EXPECT_EQ(doctor["well"], false);
  EXPECT_TRUE(std::any_of(doctor["checks"].begin(), doctor["checks"].end(),
                          [](const auto& check) { return check["name"] == "interface" && check["remedy"] == "ip -brief address"; }));
  write_ring();
  EXPECT_EQ(consort({"run", "ring.yaml", "--output", "out", "--quiet"}).out, "");
  const auto files = nlohmann::json::parse(consort({"export", "out", "--json"}).out)["files"];
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / files[0]["file"].get<std::string>()));
}

TEST_F(Cli, QuietVerbsPrintNothingButWhatJsonAsksFor) {
  write_ring();
  EXPECT_EQ(consort({"run", "ring.yaml", "--output", "out", "--quiet"}).out, "");
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"validate", "ring.yaml", "--quiet"},
                                                    {"export", "out", "--quiet"},
                                                    {"doctor", "--interface", "nix0", "--quiet"}}) {
    SCOPED_TRACE(arguments.front());
    const Answer answer = consort(arguments);
    EXPECT_EQ(answer.code, arguments.front() == "doctor" ? 3 : 0);
    EXPECT_EQ(answer.out + answer.err, "");
    std::vector<std::string> json = arguments;
    json.emplace_back("--json");
    EXPECT_TRUE(nlohmann::json::parse(consort(json).out).is_object());
  }
  EXPECT_TRUE(nlohmann::json::parse(consort({"list", "metrics", "--quiet", "--json"}).out).is_array());
  EXPECT_NE(consort({"validate", "absent.yaml", "--quiet"}).err, "") << "a mistake is told";
}

TEST_F(Cli, ADdsConfigurationThatDdsRefusesIsBadInputAndSaidOnce) {
  write_ring();
  const Answer answer =
      consort({"run", "ring.yaml", "--mode", "lockstep"}, [] { ::setenv("CYCLONEDDS_URI", "<General><Foo>1</Foo></General>", 1); });
  EXPECT_EQ(answer.code, 2);
  EXPECT_EQ(answer.err.find("consort: CYCLONEDDS_URI: found the element 'Foo' in CycloneDDS/Domain/General"), 0u) << answer.err;
  EXPECT_EQ(std::count(answer.err.begin(), answer.err.end(), '\n'), 1) << answer.err;
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "results"));
}

TEST_F(Cli, ARefusalIsJsonWhereJsonIsAskedFor) {
  write_ring("rouns: 3\n");
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"run", "ring.yaml", "--json"},
                                                    {"run", "--json", "ring.yaml", "--seed", "-1"},
                                                    {"run", "--json", "ring.yaml", "--sed", "1"},
                                                    {"list", "protocls", "--json"},
                                                    {"export", "nowhere", "--json"},
                                                    {"rn", "--json"},
                                                    {"run", "--json"}}) {
    SCOPED_TRACE(testing::PrintToString(arguments));
    const Answer answer = consort(arguments);
    EXPECT_EQ(answer.code, 2);
    const auto json = nlohmann::json::parse(answer.out);
    EXPECT_EQ(json["exit"], 2);
    expect_contains(answer.err, json["error"].get<std::string>());
  }
}

TEST_F(Cli, ListShowsTheEntriesThatAreNamed) {
  const auto listed = nlohmann::json::parse(consort({"list", "topologies", "ring", "star", "--json"}).out);
  ASSERT_EQ(listed.size(), 2U);
  EXPECT_EQ(listed[0]["name"], "ring");
  const Answer text = consort({"list", "metrics", "disagreement"});
  EXPECT_EQ(text.out.find("disagreement\n"), 0U);
  EXPECT_EQ(text.out.find("\nbias\n"), std::string::npos);
  const Answer unknown = consort({"list", "metrics", "disagrement"});
  EXPECT_EQ(unknown.code, 2);
  expect_contains(unknown.err, "metrics: found 'disagrement'");
  expect_contains(unknown.err, "did you mean 'disagreement'");
  EXPECT_EQ(consort({"list", "metrics", "disagreement", "--markdown"}).code, 2);
}

TEST_F(Cli, TheThreeProgramsTellTheirVersionAlike) {
  std::vector<std::string> told;
  for (const std::string program : {"consort", "consort-agent", "consort-plant"}) {
    const std::string file = (streams_.path() / program).string();
    ASSERT_EQ(std::system((std::string(kBinDir) + "/" + program + " --version >" + file).c_str()), 0);
    const std::string text = text_of(file);
    EXPECT_TRUE(text.starts_with(program + " ")) << text;
    told.push_back(text.substr(program.size()));
  }
  EXPECT_EQ(told[0], told[1]);
  EXPECT_EQ(told[0], told[2]);
  EXPECT_EQ(told[0], version_text("") + "\n");
  for (const std::string_view fact : {kBuild.version, kBuild.commit, kBuild.type, kBuild.cyclone, kBuild.eigen}) {
    EXPECT_FALSE(fact.empty());
    expect_contains(told[0], std::string(fact));
  }
}

TEST_F(Cli, ProgramsStartedByHandNameTheWordTheyDoNotKnow) {
  const std::string file = (streams_.path() / "hand").string(), program = std::string(kBinDir) + "/consort-plant ";
  ASSERT_EQ(WEXITSTATUS(std::system((program + "--rnu demo 2>" + file).c_str())), 2);
  EXPECT_EQ(text_of(file).find("consort-plant: unknown option '--rnu'"), 0u) << text_of(file);
  ASSERT_EQ(WEXITSTATUS(std::system((program + "2>" + file).c_str())), 2);
  EXPECT_EQ(text_of(file), "consort-plant: --run is required; see `consort-plant --help`\n");
}

TEST_F(Cli, ProgramsStartedByHandNameWhatKeepsThemFromTheirDomain) {
  const std::string file = (streams_.path() / "hand").string();
  const auto told = [&](const std::string& environment, const std::string& options) {
    const std::string command = environment + " CONSORT_KEY=0123456789abcdef0123456789abcdef " + kBinDir +
                                "/consort-agent --id 1 --run demo --domain 59 " + options + " 2>" + file;
    const int code = WEXITSTATUS(std::system(command.c_str()));
    return std::pair(code, text_of(file));
  };
  const auto [no_port, port_text] = told("", "--discovery neighbours");
  EXPECT_EQ(no_port, 2);
  EXPECT_EQ(port_text.find("consort-agent: --port: found none with --discovery neighbours; allowed: "), 0u) << port_text;
  const auto [refused, text] = told("CYCLONEDDS_URI='<General><Foo>1</Foo></General>'", "");
  EXPECT_EQ(refused, 2);
  EXPECT_EQ(text.find("consort-agent: CYCLONEDDS_URI: found the element 'Foo'"), 0u) << text;
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << "once: " << text;
}

TEST_F(Cli, QuietTellsWhatExternalProcessesAreToBeEnteredWith) {
  write_ring("stop: {deadline: 300 ms}\n");
  const Answer answer = consort({"run", "ring.yaml", "--mode", "lockstep", "--external", "2", "--quiet", "--json", "--output", "out"});
  EXPECT_EQ(answer.code, 4);
  EXPECT_EQ(answer.err.find("waiting for agent 2: CONSORT_KEY="), 0u) << answer.err;
  expect_contains(answer.err, " --interface lo ");
  EXPECT_EQ(nlohmann::json::parse(answer.out)["ending"], "deadline");
}

TEST_F(Cli, MemoryThatCannotBeHadIsSaidAndExitsTwo) {
  write("huge.yaml",
        "experiment: huge\nmode: simulate\nagents: {count: 100000, protocol: local_voting, initial: {x: 1}}\ntopology: complete\n");
  const Answer answer = consort({"run", "huge.yaml"});
  EXPECT_EQ(answer.code, 2);
  expect_contains(answer.err, "huge.yaml:4:11: topology: a graph of 1e+10 edges would take ");
}

TEST_F(Cli, OutputFolderIsNeverOverwritten) {
  write_ring();
  EXPECT_EQ(consort({"run", "ring.yaml", "--output", "out"}).code, 0);
  const std::string before = text_of(folder_.path() / "out" / "summary.json");
  const Answer answer = consort({"run", "ring.yaml", "--output", "out", "--seed", "9"});
  EXPECT_EQ(answer.code, 2);
  expect_contains(answer.err, "not empty");
  EXPECT_EQ(text_of(folder_.path() / "out" / "summary.json"), before);
}

TEST_F(Cli, DeadlineExitsFourWithASummary) {
  write_ring("stop: {deadline: 20 ms}\ntelemetry: {every: 1000}\n");
  const Answer answer = consort({"run", "ring.yaml", "--rounds", "900000000", "--json", "--output", "out"});
  EXPECT_EQ(answer.code, 4) << answer.err;
  expect_contains(answer.err, "deadline");
  const auto json = nlohmann::json::parse(text_of(folder_.path() / "out" / "summary.json"));
  EXPECT_EQ(json["exit"], 4);
  EXPECT_EQ(json["passed"], false);
  expect_contains(json["error"].get<std::string>(), "deadline");
  EXPECT_GT(json["rounds"], 0) << "what was reached is kept";
  EXPECT_EQ(nlohmann::json::parse(answer.out), json);
}

/// Whoever looks into the record finds estimates, as one of a run that goes on.
bool estimates_are_written(const std::filesystem::path& record) {
  if (!std::filesystem::exists(record)) return false;
  try {
    Database database(record, Database::Open::read);
    Statement some = database.prepare("SELECT 1 FROM estimates LIMIT 1 OFFSET 100");
    return some.step();
  } catch (const std::exception&) {
    return false;  // its tables are only being made
  }
}

TEST_F(Cli, SignalsEndARunWithItsRecordIntact) {
  write_ring("telemetry: {every: 100}\n");
  for (const auto& [signal, code] : {std::pair{SIGINT, 130}, std::pair{SIGTERM, 143}}) {
    SCOPED_TRACE(signal);
    const std::string out = "out" + std::to_string(code);
    const auto record = folder_.path() / out / "record.sqlite";
    const pid_t child = start({"run", "ring.yaml", "--rounds", "900000000", "--output", out});
    ASSERT_TRUE(eventually([&] { return estimates_are_written(record); }, 300));
    ::kill(child, signal);
    const Answer answer = wait(child);
    EXPECT_EQ(answer.code, code);
    expect_contains(answer.out, "INTERRUPTED");
    expect_contains(answer.out, "after round ");
    const auto json = nlohmann::json::parse(text_of(folder_.path() / out / "summary.json"));
    EXPECT_EQ(json["exit"], code);
    expect_contains(json["error"].get<std::string>(), signal == SIGINT ? "SIGINT" : "SIGTERM");
    Database database(record, Database::Open::read);
    Statement last = database.prepare("SELECT max(round) FROM estimates");
    ASSERT_TRUE(last.step());
    EXPECT_EQ(last.integer(0), json["rounds"].get<std::int64_t>()) << "nothing that was reported is missing";
  }
}

TEST_F(Cli, KilledRunLeavesAReadableRecord) {
  write_ring("telemetry: {every: 100}\n");
  const auto record = folder_.path() / "out" / "record.sqlite";
  const pid_t child = start({"run", "ring.yaml", "--rounds", "900000000", "--output", "out"});
  ASSERT_TRUE(eventually([&] { return estimates_are_written(record); }, 300));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  const Answer answer = consort({"export", "out", "--csv"});
  EXPECT_EQ(answer.code, 0) << answer.err;
  expect_contains(answer.out, "out/csv/estimates.csv");
  EXPECT_GT(std::filesystem::file_size(folder_.path() / "out" / "csv" / "estimates.csv"), 1000u);
}

TEST_F(Cli, ValidateShowsTheExperimentAndItsTopology) {
  write_ring("criteria: [\"disagreement < 1\"]\n");
  const Answer answer = consort({"validate", "ring.yaml"});
  EXPECT_EQ(answer.code, 0) << answer.err;
  for (const char* part : {"small_ring", "Do five agents", "local_voting", "disagreement < 1", "Who hears whom", "What theory says"})
    expect_contains(answer.out, part);
  const auto json = nlohmann::json::parse(consort({"validate", "ring.yaml", "--json"}).out);
  EXPECT_EQ(json["valid"], true);
  EXPECT_EQ(json["agents"], 5);
  ASSERT_FALSE(json["findings"].empty());
  for (const char* field : {"verdict", "condition", "evidence", "consequence"}) EXPECT_TRUE(json["findings"][0].contains(field)) << field;
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "results")) << "nothing is run";
}

TEST_F(Cli, ValidateAnswersInJsonAlsoWhenTheFileIsWrong) {
  write("bad.yaml", "experiment: 3: 4\n");
  const Answer answer = consort({"validate", "bad.yaml", "--json"});
  EXPECT_EQ(answer.code, 2);
  EXPECT_EQ(nlohmann::json::parse(answer.out)["valid"], false);
}

TEST_F(Cli, ListsNameWhatThereIs) {
  expect_contains(consort({"list", "protocols"}).out, "unbiased_kalman_consensus");
  expect_contains(consort({"list", "topologies"}).out, "random_pairs");
  expect_contains(consort({"list", "metrics"}).out, "rounds_to_convergence");
}

TEST_F(Cli, HelpIsAManualPageOnEveryVerb) {
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"--help"},
                                                    {"run", "--help"},
                                                    {"validate", "--help"},
                                                    {"list", "-h"},
                                                    {"doctor", "--help"},
                                                    {"export", "--help"}}) {
    SCOPED_TRACE(testing::PrintToString(arguments));
    const Answer answer = consort(arguments);
    EXPECT_EQ(answer.code, 0);
    EXPECT_EQ(answer.err, "");
    std::string name = arguments.size() == 1 ? "consort" : "consort " + arguments[0];
    for (const std::string& part : {std::string("NAME\n    ") + name + " - ", std::string("USAGE\n    consort"),
                                    std::string("DESCRIPTION\n"), std::string("EXAMPLES\n    consort "), std::string("EXIT CODES\n    0")})
      expect_contains(answer.out, part);
  }
  expect_contains(consort({"--version"}).out, "consort ");
  const Answer nothing = consort({});
  EXPECT_EQ(nothing.code, 2);
  expect_contains(nothing.err, "VERBS");
}

TEST_F(Cli, DoctorTellsTheRemedyAndExitsThree) {
  const Answer answer = consort({"doctor"}, [] {
    const rlimit few{64, 64};
    ::setrlimit(RLIMIT_NOFILE, &few);
  });
  EXPECT_EQ(answer.code, 3);
  expect_contains(answer.out, "remedy: sudo prlimit --pid $$ --nofile=4096:4096");
  expect_contains(answer.out, "loopback multicast");
}

TEST_F(Cli, ProgressGoesToStandardError) {
  write_ring("stop: {deadline: 1500 ms}\ntelemetry: {every: 1000}\n");
  const Answer answer = consort({"run", "ring.yaml", "--rounds", "900000000", "--output", "out"});
  EXPECT_EQ(answer.code, 4);
  expect_contains(answer.err, " rounds/s, disagreement ");
  expect_contains(answer.err, "local_voting: round ");
}

}  // namespace
}  // namespace consort
