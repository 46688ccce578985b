/// Output that cannot be written: a full or closed stream, a full disk, a terminal that goes away.

#include "tests/support/process_run.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <csignal>

namespace consort {
namespace {

constexpr const char* kShort = R"(
experiment: short
mode: simulate
rounds: 40
dt: 0.1
agents: {count: 5, protocol: local_voting, initial: {x: {linspace: [0, 1]}}}
topology: ring
)";

constexpr const char* kEndless = R"(
experiment: endless
mode: simulate
rounds: 100000000
dt: 0.1
agents: {count: 20, protocol: local_voting, initial: {x: {linspace: [0, 1]}}}
topology: ring
telemetry: {every: 1000}
stop: {deadline: 600 s}
criteria: ["rounds > 0"]
)";

struct Shell {
  explicit Shell(const std::string& experiment) { folder.write("experiment.yaml", experiment); }
  /// `command` in a shell in the folder; $C is the folder of the programs.
  std::unique_ptr<Program> start(const std::string& command) const {
    return std::make_unique<Program>(
        folder, "/bin/sh", std::vector<std::string>{"-c", "cd " + folder.path().string() + " && C=" + kBinDir + " && " + command});
  }
  [[nodiscard]] nlohmann::json summary() const { return nlohmann::json::parse(text_of(folder.path() / "out" / "summary.json")); }
  Folder folder;
};

TEST(Output, ThatIsLostIsExitCodeThreeForEveryVerb) {
  const Shell shell(kShort);
  ASSERT_EQ(shell.start("$C/consort run experiment.yaml --output kept")->wait(), 0);
  for (const char* command :
       {"consort run experiment.yaml --output table", "consort run experiment.yaml --json --quiet --output json",
        "consort validate experiment.yaml", "consort validate experiment.yaml --json", "consort list protocols", "consort doctor",
        "consort export kept --csv", "consort --help", "consort run --help", "consort-agent --help", "consort-plant --version"}) {
    const auto program = shell.start(std::string("exec $C/") + command + " > /dev/full");
    EXPECT_EQ(program->wait(), 3) << command;
    EXPECT_NE(program->err().find("standard output cannot be written (No space left on device)"), std::string::npos)
        << command << ": " << program->err();
  }
  for (const char* folder : {"table", "json"})
    EXPECT_TRUE(std::filesystem::exists(shell.folder.path() / folder / "summary.json")) << "results first";
}

TEST(Output, OnAStandardErrorThatCannotBeWrittenChangesNothing) {
  const Shell shell(kShort);
  int number = 0;
  for (const char* where : {"2>&-", "2>/dev/full"}) {
    const std::string output = " --output out" + std::to_string(++number) + " " + where;
    const auto run = shell.start("exec $C/consort run experiment.yaml" + output);
    EXPECT_EQ(run->wait(), 0) << where;
    EXPECT_NE(run->out().find("DONE"), std::string::npos) << run->out();
    EXPECT_EQ(shell.start(std::string("exec $C/consort run no_such_file.yaml ") + where)->wait(), 2);
    EXPECT_EQ(shell.start(std::string("exec $C/consort-agent --id x --run r --domain 7 ") + where)->wait(), 2);
  }
}

TEST(Output, ALimitOnFilesEndsTheRunWithItsTableSayingWhatWasSaved) {
  std::string reporting = kEndless;  // a lot
  reporting.replace(reporting.find("100000000"), 9, "1000000");
  reporting.replace(reporting.find("every: 1000"), 11, "every: 1");
  const Shell shell(reporting);
  const auto run = shell.start("ulimit -f 8000 && exec $C/consort run experiment.yaml --output out");
  EXPECT_EQ(run->wait(), 3);
  EXPECT_NE(run->out().find("FAILED"), std::string::npos) << "the table is shown: " << run->out();
  EXPECT_NE(run->out().find("INCOMPLETE"), std::string::npos) << run->out();
  EXPECT_NE(run->err().find("record.sqlite"), std::string::npos) << run->err();
  EXPECT_NE(run->err().find("the record holds the reports up to round"), std::string::npos) << run->err();
  EXPECT_EQ(run->err().find("INSERT"), std::string::npos) << "no SQL: " << run->err();
  EXPECT_EQ(shell.summary().at("complete"), false);
  EXPECT_EQ(shell.summary().at("exit"), 3);
  const auto exported = shell.start("exec $C/consort export out --csv");
  EXPECT_EQ(exported->wait(), 0) << "what was committed is intact: " << exported->err();
}

TEST(Output, ARecordThatCannotEvenBeginSaysWhyWithoutSql) {
  const Shell shell(kShort);
  const auto run = shell.start("ulimit -f 20 && exec $C/consort run experiment.yaml --output out");
  EXPECT_EQ(run->wait(), 3);
  EXPECT_NE(run->err().find("record.sqlite"), std::string::npos) << run->err();
  EXPECT_EQ(run->err().find("CREATE"), std::string::npos) << run->err();
  EXPECT_EQ(run->err().find("PRAGMA"), std::string::npos) << run->err();
}

TEST(Output, AHangUpEndsARunUnlessItIsStartedWithNohup) {
  for (const bool nohup : {false, true}) {
    SCOPED_TRACE(nohup ? "nohup" : "plain");
    const Shell shell(kEndless);
    const auto run = shell.start(std::string(nohup ? "trap '' HUP && " : "") + "exec $C/consort run experiment.yaml --output out");
    ASSERT_TRUE(eventually([&] { return run->err().find("rounds/s") != std::string::npos; })) << run->err();
    run->signal(SIGHUP);
    if (nohup) {
      const std::string before = run->err();
      EXPECT_TRUE(eventually([&] { return run->err().size() > before.size(); })) << "it goes on";
      EXPECT_FALSE(run->over());
      run->signal(SIGTERM);
    }
    EXPECT_EQ(run->wait(), 143) << run->err();
    EXPECT_EQ(shell.summary().at("complete"), false);
  }
}

}  // namespace
}  // namespace consort
