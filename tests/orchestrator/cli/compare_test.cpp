/// `consort diff` and `consort replay`, with the real program.

#include "tests/support/program.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace consort {
namespace {

class Compare : public testing::Test {
 protected:
  [[nodiscard]] std::string at(const std::string& name) const { return (folder_.path() / name).string(); }
  int consort(std::vector<std::string> arguments) {
    Program program(folder_, "consort", std::move(arguments));
    const int code = program.wait();
    out_ = program.out();
    err_ = program.err();
    return code;
  }
  void run(const std::string& output, std::vector<std::string> more = {}) {
    folder_.write("ring.yaml",
                  "experiment: ring\nseed: 3\nrounds: 60\nagents: {count: 3, protocol: local_voting, initial: {x: [0, 1, 5]}}\n"
                  "topology: ring\nlinks: {loss: {bernoulli: 0.2}}\ncriteria: [\"disagreement < 1\"]\n");
    more.insert(more.begin(), {"run", at("ring.yaml"), "--mode", "simulate", "--no-report", "--quiet", "--output", at(output)});
    ASSERT_EQ(consort(more), 0) << err_;
  }

  Folder folder_;
  std::string out_, err_;
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

}  // namespace
}  // namespace consort
