/// What is done with results: `consort diff`, `replay`, `test`, `results`, `export`, with the real program.

#include "tests/orchestrator/cli/real_program.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <csignal>

namespace consort {
namespace {

class Compare : public RealProgram {
 protected:
  void run(const std::string& output, std::vector<std::string> more = {}) {
    folder_.write("ring.yaml",
                  "experiment: ring\nseed: 3\nrounds: 60\nagents: {count: 3, protocol: local_voting, initial: {x: [0, 1, 5]}}\n"
                  "topology: ring\nlinks: {loss: {bernoulli: 0.2}}\ncriteria: [\"disagreement < 1\"]\n");
    more.insert(more.begin(), {"run", at("ring.yaml"), "--mode", "simulate", "--no-report", "--quiet", "--output", at(output)});
    ASSERT_EQ(consort(more), 0) << err_;
  }
};

TEST_F(Compare, AReplayInProcessesGivesTheBitsOfTheSimulation) {
  run("first");
  EXPECT_EQ(consort({"replay", at("first"), "--mode", "lockstep", "--output", at("again")}), 0) << out_ << err_;
  EXPECT_NE(out_.find("equal bit for bit: 1 run, 60 rounds"), std::string::npos) << out_;
  EXPECT_NE(out_.find("mode: simulate in A, lockstep in B"), std::string::npos) << out_;
  EXPECT_EQ(consort({"replay", at("nowhere")}), 2);
  EXPECT_NE(err_.find("holds no record.sqlite"), std::string::npos) << err_;
}

TEST_F(Compare, AnotherSeedPartsInARoundThatIsNamed) {
  run("first");
  run("other", {"--seed", "4"});
  EXPECT_EQ(consort({"diff", at("first"), at("other"), "--json"}), 1) << err_;
  const auto other = nlohmann::json::parse(out_);
  EXPECT_EQ(other["runs"][0]["bits"], "differ") << other["runs"];
  EXPECT_EQ(other["runs"][0]["first"]["field"], "x");
  EXPECT_GT(other["runs"][0]["first"]["round"], 0) << "they start alike, and lose other messages";
  run("second", {"--rounds", "40"});
  EXPECT_EQ(consort({"diff", at("first"), at("second"), "--json"}), 1) << err_;
  const auto json = nlohmann::json::parse(out_);
  EXPECT_EQ(json["runs"][0]["bits"], "length") << json["runs"];
  EXPECT_EQ(json["file"][0]["key"], "rounds") << json["file"];
  EXPECT_EQ(consort({"diff", at("first"), at("second"), "--tolerance", "1000", "--tolerance", "rounds*=100%", "--quiet"}), 0) << out_;
  EXPECT_EQ(out_, "");
  EXPECT_EQ(consort({"diff", at("first"), at("second"), "--tolerance", "much"}), 2);
  EXPECT_NE(err_.find("found 'much'; allowed: "), std::string::npos) << err_;
}

TEST_F(Compare, TestsAreCasesInAJunitReportAndBaselinesForLater) {
  run("first");  // writes ring.yaml
  std::filesystem::create_directory(folder_.path() / "all");
  std::filesystem::rename(at("ring.yaml"), at("all/ring.yaml"));
  folder_.write("all/broken.yaml", "experiment: broken\ntopology: ]]><&\n");
  EXPECT_EQ(consort({"test", at("all/ring.yaml"), "--mode", "simulate", "--output", at("base"), "--quiet"}), 0) << err_;
  EXPECT_EQ(consort({"test", at("all"), "--jobs", "2", "--mode", "simulate", "--output", at("now"), "--baseline", at("base"), "--junit",
                     at("report.xml")}),
            2)
      << "one is no experiment; " << out_ << err_;
  EXPECT_NE(out_.find("2 experiments, 4 cases: 3 passed, 0 failed, 1 error, 0 skipped"), std::string::npos) << out_;
  const std::string report = text_of(folder_.path() / "report.xml");
  EXPECT_NE(report.find("name=\"disagreement &lt; 1\""), std::string::npos) << report;
  EXPECT_NE(report.find("name=\"as the baseline\""), std::string::npos) << report;
  EXPECT_NE(report.find("consensus value"), std::string::npos) << "the table is its output";
  EXPECT_EQ(consort({"test", at("all/ring.yaml"), "--tolerance", "1%"}), 2) << "a tolerance of nothing";
}

TEST_F(Compare, ATestThatIsInterruptedEndsItsRunsAndReports) {
  folder_.write(
      "endless.yaml",
      "experiment: endless\nmode: simulate\nrounds: 1000000000\nagents: {count: 3, protocol: local_voting, initial: {x: [0, 1, 5]}}\n"
      "topology: ring\ntelemetry: {every: 1000000}\n");
  Program program(folder_, "consort", {"test", at("endless.yaml"), "--output", at("now"), "--junit", at("report.xml")});
  ASSERT_TRUE(eventually([&] { return std::filesystem::exists(at("now/endless/record.sqlite")); })) << program.err();
  const auto children = program.children();
  ASSERT_EQ(children.size(), 1U);
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait(), 143);
  EXPECT_FALSE(runs(children.front()));
  EXPECT_NE(text_of(folder_.path() / "report.xml").find("errors=\"1\""), std::string::npos);
}

TEST_F(Compare, ResultsAreListedShownExportedAndPruned) {
  run("some/first");
  run("some/second");
  ASSERT_EQ(consort({"results", "list", at("some"), "--json"}), 0) << err_;
  const auto list = nlohmann::json::parse(out_);
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(list[0]["verdict"], "passed");
  EXPECT_EQ(list[0]["seed"], "3");
  EXPECT_GT(list[0]["bytes"], 1000);
  EXPECT_EQ(consort({"results", "show", at("some/first")}), 0) << err_;
  EXPECT_NE(out_.find("disagreement < 1"), std::string::npos) << out_;
  EXPECT_EQ(consort({"export", at("some/first"), "--format", "mat", "--shape", "wide"}), 0) << err_;
  EXPECT_NE(out_.find("wide_0.mat  61 rows"), std::string::npos) << out_;
  EXPECT_EQ(consort({"export", at("some/first"), "--format", "graphml", "--shape", "long"}), 2);
  EXPECT_EQ(consort({"results", "prune", at("some")}), 2) << "it has to be said what may go";
  EXPECT_EQ(consort({"results", "prune", at("some"), "--keep", "0"}), 2) << "there is nobody to ask";
  EXPECT_NE(err_.find("allowed: --yes"), std::string::npos) << err_;
  EXPECT_EQ(consort({"results", "prune", at("some"), "--keep", "0", "--yes"}), 0) << err_;
  EXPECT_FALSE(std::filesystem::exists(at("some/second")));
  EXPECT_FALSE(std::filesystem::exists(at("some/first")));
}

}  // namespace
}  // namespace consort
