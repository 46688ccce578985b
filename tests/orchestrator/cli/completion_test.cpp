#include "orchestrator/cli/completion.hpp"

#include "orchestrator/cli/help.hpp"
#include "orchestrator/cli/tables.hpp"
#include "tests/support/program.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

/// A parser like that of consort, with one of each kind.
class Completion : public testing::Test {
 protected:
  Completion() : app_("", "consort") {
    CLI::App& show = *app_.add_subcommand("show", "show something\nAt length.");
    show.add_option("file", text_, "What. It is read.")->type_name("FILE");
    show.add_option("-m,--mode", text_, "How (one of two); the rest is the file's.")->type_name("MODE")->check(one_of({"fast", "slow"}));
    show.add_option("--output", text_, "Where.")->type_name("DIR");
    show.add_option("--number", text_, "How many.")->type_name("N");
    show.add_flag("--quiet", flag_, "Say nothing.");
    CLI::App& list = *app_.add_subcommand("list", "list something");
    list.add_option("what", text_, "What.")->type_name("LIST")->check(one_of({"protocols", "metrics"}));
    list.add_option("name", text_, "Which.")->type_name("NAME");
  }
  CLI::App app_;
  std::string text_;
  bool flag_ = false;
};

TEST_F(Completion, KnowsWhatTheParserTakes) {
  const auto verbs = typed_verbs(app_);
  ASSERT_EQ(verbs.size(), 2U);
  EXPECT_EQ(verbs[0].meaning, "show something");
  ASSERT_EQ(verbs[0].arguments.size(), 1U);
  EXPECT_EQ(verbs[0].arguments[0].kind, Taken::Kind::files);
  const auto& options = verbs[0].options;
  ASSERT_EQ(options.size(), 5U) << "and --help";
  EXPECT_EQ(options[1].names, (std::vector<std::string>{"-m", "--mode"}));
  EXPECT_EQ(options[1].meaning, "How (one of two)");
  EXPECT_EQ(options[1].value.words, (std::vector<std::string>{"fast", "slow"}));
  EXPECT_EQ(options[2].value.kind, Taken::Kind::folders);
  EXPECT_EQ(options[3].value.kind, Taken::Kind::text);
  EXPECT_EQ(options[4].value.kind, Taken::Kind::nothing);
  EXPECT_EQ(verbs[1].after.at("protocols"), names_in("protocols"));
}

TEST_F(Completion, SaysTheSameToEachShell) {
  const auto verbs = typed_verbs(app_);
  for (const std::string& script : {bash_completion(verbs), zsh_completion(verbs), fish_completion(verbs)})
    for (const char* word : {"show", "fast slow", "local_voting", "quiet"}) EXPECT_NE(script.find(word), std::string::npos) << word;
}

TEST(CompletionOfBash, OffersWhatMayFollow) {
  const Folder folder;
  folder.write("ring of ten.yaml", "");
  std::filesystem::create_directory(folder.path() / "results");
  // What is typed after `consort`, and what bash then offers for the last word.
  const std::vector<std::pair<std::string, std::string>> cases{
      {"re", "report,replay,results,"},
      {"run --no", "--no-report,"},
      {"run --mode re", "realtime,"},
      {"run --mode = re", "realtime,"},
      {"run --seed 7 ri", "ring of ten.yaml,"},
      {"run --seed ''", ""},
      {"run --output r", "results,"},
      {"report --json r", "results,"},
      {"list proto", "protocols,"},
      {"list protocols local_", "local_voting,"},
      {"list --json metrics disag", "disagreement,"},
      {"diff --tolerance disag", "disagreement=,"},
      {"results p", "prune,"},
      {"results show r", "results,"},
      {"completion f", "fish,"},
  };
  std::string script = "cd " + folder.path().string() + "; source <(" + kBinDir + "/consort completion bash)\n";
  std::string expected;
  for (const auto& [typed, offered] : cases) {
    script += "COMP_WORDS=(consort " + typed + "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); COMPREPLY=(); _consort\n";
    script += "printf '%s: ' \"" + typed + "\"; ((${#COMPREPLY[@]})) && printf '%s,' \"${COMPREPLY[@]}\"; echo\n";
    expected += typed + ": " + offered + "\n";
  }
  Program bash(folder, "/bin/bash", {"-c", script});
  EXPECT_EQ(bash.wait(), 0);
  EXPECT_EQ(bash.err(), "");
  EXPECT_EQ(bash.out(), expected);
}

}  // namespace
}  // namespace consort
