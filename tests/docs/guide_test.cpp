/// What README and guide tell readers to type is typed here, with the real programs: a page is a folder, its blocks are run in order.

#include "tests/docs/pages.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <regex>
#include <set>

namespace consort::docs {
namespace {

class Guide : public testing::TestWithParam<std::string> {
 protected:
  Guide() {
    for (const char* name : {"experiments", "python"})
      std::filesystem::create_directory_symlink(std::filesystem::path(kSourceDir) / name, folder_.path() / name);
  }

  [[nodiscard]] std::string place(const Block& block) const { return GetParam() + ":" + std::to_string(block.line); }

  /// Runs a script as a reader would; whatever it leaves in the background ends with it.
  int bash(const std::string& script) {
    const std::string preamble = "set -e\ncd '" + folder_.path().string() + "'\nexport PATH='" + kBinDir +
                                 "':/usr/bin:$PATH PYTHONDONTWRITEBYTECODE=1\n";  // and Debian's python3
    Program program(folder_, "/usr/bin/timeout", {"--kill-after=5", "200", "/bin/bash", "-c", preamble + script});
    const int code = program.wait();
    said_ = program.out() + program.err();
    return code;
  }

  Folder folder_;
  std::string said_;
};

/// Exit codes a block may end with: those that its title names, otherwise 0.
std::set<int> expected(const Block& block) {
  if (!block.title.starts_with("exit code ")) return {0};
  static const std::regex number(R"(\d+)");
  std::set<int> codes;
  for (auto it = std::sregex_iterator(block.title.begin(), block.title.end(), number); it != std::sregex_iterator(); ++it)
    codes.insert(std::stoi(it->str()));
  return codes;
}

/// Text as it is but for its numbers, their units, and how far apart words are: what a reader's own run may differ in.
std::string shape(const std::string& text) {
  static const std::regex number(R"([-+]?\d[\d.,:]*(e[-+]?\d+)?( (ms|s)\b)?)"), space(R"(\s+)");
  return std::regex_replace(std::regex_replace(text, number, "#"), space, " ");
}

TEST_P(Guide, EveryCommandRunsAndSaysWhatIsShown) {
  for (const Block& block : blocks_in(GetParam())) {
    if (block.language == "yaml" && !block.title.empty()) folder_.write(block.title.substr(0, block.title.find(' ')), block.text);
    if (!block.run()) continue;
    ASSERT_FALSE(block.typed().empty()) << place(block) << ": nothing to type";
    const int code = bash(block.typed());
    ASSERT_TRUE(expected(block).contains(code)) << place(block) << ": exit code " << code << "\n" << block.typed() << said_;
    if (expected(block).size() > 1) continue;  // it depends on the host
    for (const std::string& line : block.shown())
      EXPECT_NE(shape(said_).find(shape(line)), std::string::npos) << place(block) << ": nothing like\n" << line << "\nin\n" << said_;
  }
}

/// A part of an experiment, completed by what it does not say itself.
std::string whole_experiment(const std::string& part) {
  std::string whole = part;
  for (const char* line :
       {"experiment: part", "agents: {count: 5, protocol: local_voting, initial: {x: [1, 2, 3, 4, 5]}}", "topology: ring"}) {
    const std::string key = std::string(line).substr(0, std::string(line).find(':') + 1);
    if (("\n" + part).find("\n" + key) == std::string::npos) whole += std::string(line) + "\n";
  }
  return whole;
}

TEST_P(Guide, EveryExperimentIsValid) {
  for (const Block& block : blocks_in(GetParam())) {
    if (block.language != "yaml" || block.title.ends_with("(broken)")) continue;
    folder_.write("part.yaml", whole_experiment(block.text));
    EXPECT_EQ(bash("consort validate part.yaml"), 0) << place(block) << "\n" << said_;
  }
}

TEST_P(Guide, WhatIsNotRunNamesOptionsThatExist) {
  static const std::regex call(R"((consort [a-z]+|consort-agent|consort-plant) [^\n]*)"), option(R"(--[a-z-]+)");
  for (const Block& block : blocks_in(GetParam())) {
    if (!block.shell() || block.run()) continue;
    for (auto it = std::sregex_iterator(block.text.begin(), block.text.end(), call); it != std::sregex_iterator(); ++it) {
      ASSERT_EQ(bash((*it)[1].str() + " --help"), 0) << place(block) << "\n" << said_;
      const std::string line = it->str();
      for (auto o = std::sregex_iterator(line.begin(), line.end(), option); o != std::sregex_iterator(); ++o)
        EXPECT_NE(said_.find(o->str()), std::string::npos) << place(block) << ": " << line << ": there is no " << o->str();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Pages, Guide, testing::ValuesIn(pages()), [](const auto& page) {
  std::string name = std::filesystem::path(page.param).stem().string();
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
});

// Parameters of protocols and models, which `consort list` documents, are in the schema for their words alone.
bool is_parameter(const nlohmann::json& property) { return property.value("$ref", "").starts_with("#/definitions/words_of_"); }

void add_keys(const nlohmann::json& schema, std::set<std::string>& keys) {
  if (schema.is_object() && schema.contains("properties"))
    for (const auto& [key, property] : schema["properties"].items())
      if (!is_parameter(property)) keys.insert(key);
  if (schema.is_structured())
    for (const auto& part : schema) add_keys(part, keys);
}

TEST(GuideText, NamesEveryKeyOfAnExperiment) {
  std::string code;  // what stands in blocks and backticks
  static const std::regex quoted("`[^`\n]+`");
  for (const std::string& page : pages()) {
    const std::string text = text_of(std::filesystem::path(kSourceDir) / page);
    for (auto it = std::sregex_iterator(text.begin(), text.end(), quoted); it != std::sregex_iterator(); ++it) code += it->str() + "\n";
    for (const Block& block : blocks_of(text)) code += block.text;
  }
  std::set<std::string> keys;
  auto schema = nlohmann::json::parse(text_of(std::filesystem::path(kSourceDir) / "experiments/experiment.schema.json"));
  for (const char* parameters : {"protocol_by_name", "model_by_name"}) schema["definitions"].erase(parameters);
  add_keys(schema, keys);
  EXPECT_GT(keys.size(), 60U);
  for (const std::string& key : keys) EXPECT_TRUE(std::regex_search(code, std::regex("\\b" + key + "\\b"))) << key;
}

/// What a CI server is to do is what the page has typed, and so what has run here.
TEST(GuideText, ExamplesOfContinuousIntegrationTestAsIsTyped) {
  std::set<std::string> typed, servers;
  static const std::regex line("consort test [^\n]*");
  for (const Block& block : blocks_in("docs/ci.md"))
    for (auto it = std::sregex_iterator(block.text.begin(), block.text.end(), line); it != std::sregex_iterator(); ++it) {
      if (block.language == "sh") typed.insert(it->str());
      if (block.language == "yml") servers.insert(block.title + " " + it->str());
    }
  ASSERT_EQ(typed.size(), 1U);
  EXPECT_EQ(servers, (std::set{".gitlab-ci.yml " + *typed.begin(), ".github/workflows/experiments.yml " + *typed.begin()}));
}

TEST(GuideBlocks, MostAreRun) {
  int run = 0, not_run = 0;
  for (const std::string& page : pages())
    for (const Block& block : blocks_in(page))
      if (block.shell()) ++(block.run() ? run : not_run);
  EXPECT_GT(run, 15);
  EXPECT_LT(3 * not_run, run);
}

TEST(GuideBlocks, AreReadWithTheirTitles) {
  const auto blocks = blocks_of("text\n```console title=\"exit code 2 or 3\"\n$ a\nshown\n$ b\n```\n```yaml\nx: 1\n```\n");
  ASSERT_EQ(blocks.size(), 2U);
  EXPECT_EQ(blocks[0].line, 3U);
  EXPECT_EQ(blocks[0].typed(), "a\nb\n");
  EXPECT_EQ(blocks[0].shown(), std::vector<std::string>{"shown"});
  EXPECT_EQ(expected(blocks[0]), (std::set{2, 3}));
  EXPECT_EQ(blocks[1].language, "yaml");
  EXPECT_EQ(blocks[1].text, "x: 1\n");
}

}  // namespace
}  // namespace consort::docs
