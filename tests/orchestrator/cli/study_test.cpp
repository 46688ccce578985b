/// Studies with the real program: cells, their table, and that nothing is lost or done twice when somebody kills it.

#include "tests/orchestrator/cli/real_program.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <csignal>
#include <map>

namespace consort {
namespace {

class Studies : public RealProgram {
 protected:
  void write_study(const std::string& more) {
    folder_.write("study.yaml",
                  "# Does loss cost agreement?\nexperiment: small_study\nmode: simulate\nseed: 3\nruns: 3\nrounds: 60\n"
                  "agents: {count: 3, protocol: local_voting, initial: {x: [0, 1, 5]}}\ntopology: ring\n" +
                      more);
  }
  [[nodiscard]] std::string text(const std::string& name) const { return text_of(folder_.path() / name); }
  [[nodiscard]] nlohmann::json json(const std::string& name) const { return nlohmann::json::parse(text(name)); }
};

const char* const kSweep = "sweep: {links.loss: [0, 0.3], dt: [0.1, 0.2]}\ncriteria: ['local_voting.loss_0.dt_0.2.bias < 1e-9']\n";

TEST_F(Studies, AreOneTableWhoeverRanTheCells) {
  write_study(kSweep);
  ASSERT_EQ(consort({"run", at("study.yaml"), "--output", at("whole")}), 0) << err_;
  EXPECT_NE(out_.find("small_study"), std::string::npos) << out_;
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "whole/cells")) << "cells share one record unless asked";
  EXPECT_EQ(json("whole/summary.json")["criteria"][0]["met"], true);

  ASSERT_EQ(consort({"run", at("study.yaml"), "--output", at("parts"), "--plan"}), 0) << err_;
  EXPECT_NE(out_.find("4 cells"), std::string::npos) << out_;
  EXPECT_EQ(json("parts/plan.json")["cells"][3]["name"], "loss_0.3.dt_0.2");
  for (const char* cell : {"4", "2"}) ASSERT_EQ(consort({"run", "--resume", at("parts"), "--cell", cell}), 0) << err_;
  EXPECT_EQ(consort({"collect", at("parts")}), 3) << "two cells are missing";
  EXPECT_NE(out_.find("INCOMPLETE: 2 of 4 cells did not come to their end"), std::string::npos) << out_;
  ASSERT_EQ(consort({"run", "--resume", at("parts"), "--jobs", "1"}), 0) << err_;
  for (const char* file : {"table.csv", "table.tex", "table.md"})
    EXPECT_EQ(text(std::string("parts/") + file), text(std::string("whole/") + file));
  EXPECT_EQ(json("parts/summary.json")["trace_hash"], json("whole/summary.json")["trace_hash"]);
  EXPECT_EQ(consort({"collect", at("parts"), "--quiet"}), 0) << err_;

  EXPECT_EQ(consort({"run", "--resume", at("parts"), "--cell", "5"}), 2);
  EXPECT_NE(err_.find("--cell: found 5; allowed: 1 to 4"), std::string::npos) << err_;
  EXPECT_EQ(consort({"results", "show", at("whole")}), 0) << err_;
  EXPECT_NE(out_.find("passed"), std::string::npos) << out_;
}

// What spreads the cells over machines is typed as its example says.
TEST_F(Studies, AreSpreadByOtherPrograms) {
  write_study(kSweep);
  ASSERT_EQ(consort({"run", at("study.yaml"), "--quiet", "--output", at("whole")}), 0) << err_;
  const std::string examples = std::string(kSourceDir) + "/deploy/examples/";
  const std::string head = "set -e; export PATH='" + std::string(kBinDir) + "':/usr/bin:$PATH; cd '" + folder_.path().string() + "'; ";
  const std::map<std::string, std::string> spread{
      {"array", "consort run study.yaml --output array --plan; for i in 1 2 3 4; do SLURM_ARRAY_TASK_ID=$i sh " + examples +
                    "study.sbatch array; done; consort collect array"},
      {"parallel", examples + "study-parallel.sh study.yaml parallel --jobs 2"},
      {"snakemake", "HOME=$PWD snakemake --snakefile " + examples + "study.smk --cores 2 --config file=study.yaml folder=snakemake"}};
  for (const auto& [name, script] : spread) {
    Program program(folder_, "/bin/sh", {"-c", head + script});
    EXPECT_EQ(program.wait(), 0) << name << ":\n" << program.out() << program.err();
    EXPECT_EQ(text(name + "/table.csv"), text("whole/table.csv")) << name;
  }
}

// The cells take long enough to be met in the middle, and are enough that some are over by then.
TEST_F(Studies, GiveTheSameTableWhenTheyAreKilledAndResumed) {
  write_study("sweep: {seed: {linspace: [1, 100, 100]}, links.loss: [0.1, 0.5]}\n");
  ASSERT_EQ(consort({"run", at("study.yaml"), "--rounds", "2000", "--quiet", "--output", at("whole")}), 0) << err_;
  {
    Program killed(folder_, "consort", {"run", at("study.yaml"), "--rounds", "2000", "--output", at("killed"), "--jobs", "2"});
    ASSERT_TRUE(eventually([&] {
      return killed.over() || killed.err().find("cell ") != std::string::npos ||
             (std::filesystem::exists(folder_.path() / "killed/record.sqlite-wal") &&
              std::filesystem::file_size(folder_.path() / "killed/record.sqlite-wal") > 30'000);
    }));
    killed.signal(SIGKILL);
    killed.wait();
  }
  ASSERT_EQ(consort({"run", "--resume", at("killed"), "--quiet"}), 0) << err_;
  EXPECT_EQ(text("killed/table.csv"), text("whole/table.csv"));
  EXPECT_EQ(json("killed/summary.json")["trace_hash"], json("whole/summary.json")["trace_hash"]);
}

TEST_F(Studies, InProcessesGiveTheTableOfTheSimulation) {
  write_study("sweep: {agents.protocol: [local_voting, robust_information_consensus], links.loss: [0.1]}\n");
  EXPECT_EQ(consort({"run", at("study.yaml")}), 2);
  EXPECT_NE(err_.find("study.yaml:9:84: sweep.links.loss: found a list of 1; allowed: two values or more"), std::string::npos) << err_;
  write_study("dt: 0.1\nlinks: {loss: 0.1}\nsweep: {agents.protocol: {a: local_voting, b: {name: robust_information_consensus}}}\n");
  ASSERT_EQ(consort({"run", at("study.yaml"), "--quiet", "--full-cells", "--output", at("simulated")}), 0) << err_;
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "simulated/cells/0002/report.html")) << "on request";
  ASSERT_EQ(consort({"run", at("study.yaml"), "--mode", "lockstep", "--jobs", "2", "--quiet", "--output", at("processes")}), 0) << err_;
  EXPECT_EQ(text("processes/table.csv"), text("simulated/table.csv"));
}

TEST_F(Studies, GoOnPastACellThatFailsUnlessTheyAreToldNotTo) {
  write_study("sweep: {zip: {dt: [1, 0.1, 0.05], seed: [1, 2, 3]}}\n");  // with dt = 1 the states grow until they are no numbers
  EXPECT_EQ(consort({"run", at("study.yaml"), "--rounds", "3000", "--quiet", "--jobs", "1", "--output", at("on")}), 3);
  EXPECT_NE(text("on/table.csv").find("\n3,0.05,3,local_voting,"), std::string::npos);
  EXPECT_NE(json("on/summary.json")["incomplete"].get<std::string>().find("cell 1 (dt = 1, seed = 1): local_voting: agent 1, round "),
            std::string::npos);
  EXPECT_EQ(consort({"run", at("study.yaml"), "--rounds", "3000", "--quiet", "--jobs", "1", "--fail-fast", "--output", at("fast")}), 3);
  EXPECT_EQ(text("fast/table.csv").find("\n3,"), std::string::npos);
}

TEST_F(Studies, AreRepeated) {
  write_study(kSweep);
  ASSERT_EQ(consort({"run", at("study.yaml"), "--set", "links.loss=0.2,0.4", "--set", "dt=0.2", "--set", "runs=2", "--quiet", "--output",
                     at("first"), "--set", "criteria=[[local_voting.loss_0.2.bias < 9]]"}),
            0)
      << err_;
  EXPECT_EQ(consort({"replay", at("first"), "--output", at("again")}), 0) << out_ << err_;
  EXPECT_NE(out_.find("equal bit for bit: 4 runs"), std::string::npos) << out_;
}

// Fewer seeds or rounds than they ask for: a criterion then may be of what is not known, but none is contradicted.
TEST_F(Studies, ThatShipMeetTheirCriteria) {
  const std::map<std::string, std::vector<std::string>> shortened{
      {"loss_study", {"--runs", "40"}}, {"size_study", {"--rounds", "800"}}, {"gain_study", {"--runs", "3"}}};
  std::size_t files = 0;
  for (const auto& file : std::filesystem::directory_iterator(std::string(kSourceDir) + "/experiments/studies")) {
    ++files;
    const std::string name = file.path().stem().string(), head = text_of(file.path());
    ASSERT_TRUE(shortened.contains(name)) << name;
    EXPECT_NE(head.substr(0, head.find("\n#\n")).find('?'), std::string::npos) << name << ": the header opens with the question";
    for (const char* part : {"# Source: ", "# Status: ", "# Expected"}) EXPECT_NE(head.find(part), std::string::npos) << name << part;
    std::vector<std::string> words{"run", file.path().string(), "--quiet", "--no-report", "--output", at(name)};
    words.insert(words.end(), shortened.at(name).begin(), shortened.at(name).end());
    EXPECT_LE(consort(words), 1) << name << ": " << err_;
    std::size_t met = 0;
    const auto summary = json(name + "/summary.json");
    for (const auto& criterion : summary["criteria"]) {
      met += criterion["met"] == true ? 1 : 0;
      EXPECT_TRUE(criterion["met"] == true || criterion.contains("undefined")) << criterion;
    }
    EXPECT_GE(met, 8U) << name;
  }
  EXPECT_EQ(files, shortened.size());
}

TEST_F(Studies, SayWhatTheyCannotDo) {
  write_study(kSweep);
  const std::map<std::string, std::vector<std::string>> refused{
      {"--external: found a study", {"run", at("study.yaml"), "--external", "1"}},
      {"--cell: found no --resume", {"run", at("study.yaml"), "--cell", "1"}},
      {"holds no plan.json", {"run", "--resume", at("nowhere")}},
      {"file is required, or --resume DIR", {"run"}},
      {"cell 1 (dt = 0.1, links.loss = 3): --set: links.loss: found 3", {"run", at("study.yaml"), "--set", "links.loss=3,0.2"}},
      {"found no sweep", {"run", at("study.yaml"), "--set", "links.loss=0", "--set", "dt=0.1", "--jobs", "2"}},
  };
  for (const auto& [words, arguments] : refused) {
    EXPECT_EQ(consort(arguments), 2) << words;
    EXPECT_NE(err_.find(words), std::string::npos) << err_ << "\nlacks: " << words;
  }
}

}  // namespace
}  // namespace consort
