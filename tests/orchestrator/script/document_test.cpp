#include "orchestrator/script/document.hpp"

#include "core/errors.hpp"
#include "orchestrator/script/script.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>

namespace consort {
namespace {

Experiment read(const std::string& text) { return parse_experiment(text, "e.yaml", "."); }

/// What the user is told; empty if the text is accepted.
std::string refusal_of(const std::string& text) {
  try {
    read(text);
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

std::string repeated(const std::string& text, std::size_t times) {
  std::string out;
  for (std::size_t i = 0; i < times; ++i) out += text;
  return out;
}

const std::string kHead = "experiment: e\nagents: {count: 4, protocol: local_voting, initial: {x: 1}}\ntopology: ring\n";

TEST(Document, ASecondDocumentIsRefusedInItsLine) {
  EXPECT_EQ(refusal_of(kHead + "...\n"), "");
  EXPECT_EQ(refusal_of("---\n" + kHead + "---\n").find("e.yaml:5:1: found a second YAML document"), 0u) << "even one without a word";
  EXPECT_EQ(refusal_of(kHead + "---\nrounds: 5\n").find("e.yaml:4:1: found a second YAML document"), 0u);
  EXPECT_EQ(refusal_of(kHead + "...\nrounds: 5\n").find("e.yaml:5:1: found a second YAML document"), 0u);
}

TEST(Document, AnAliasWithinWhatItStandsForIsRefusedAtItsPlace) {
  const std::string expected = "found an alias within what it stands for";
  EXPECT_EQ(refusal_of("experiment: e\nx-a: &x [1, *x]\n"),
            "e.yaml:2:13: " + expected + "; allowed: an alias of something that ended before");
  EXPECT_EQ(refusal_of("experiment: e\nx-a: &x {a: {b: *x}}\n").find("e.yaml:2:17: " + expected), 0u);
  EXPECT_EQ(refusal_of("experiment: e\nx-a: &x\n  <<: *x\n").find("e.yaml:3:7: " + expected), 0u);
}

TEST(Document, AnAliasBombIsRefusedAtOnceWhereItGrowsTooLarge) {
  std::string bomb = "experiment: e\na0: &a0 [1,1,1,1,1,1,1,1,1,1]\n";
  for (int level = 1; level < 12; ++level)
    bomb += fmt::format("a{0}: &a{0} [{1}*a{2}]\n", level, repeated(fmt::format("*a{}, ", level - 1), 9), level - 1);
  const auto began = std::chrono::steady_clock::now();
  EXPECT_EQ(refusal_of(bomb).find("e.yaml:6:"), 0u) << refusal_of(bomb);
  EXPECT_NE(refusal_of(bomb).find("found an alias with which aliases stand for more than 100000 values"), std::string::npos);
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(10)) << "it would take a day";
}

TEST(Document, DepthAndSizeAreBounded) {
  EXPECT_EQ(refusal_of("experiment: " + repeated("[", 1000) + repeated("]", 1000))
                .find("e.yaml:1:76: found lists and mappings more than 64 deep"),
            0u);
  std::string chain = "experiment: e\nx-0: &a0 [[[[[[[[[[[[1]]]]]]]]]]]]\n";
  for (int i = 1; i < 10; ++i) chain += fmt::format("x-{0}: &a{0} [[[[[[[[[[[[*a{1}]]]]]]]]]]]]\n", i, i - 1);
  EXPECT_NE(refusal_of(chain).find("e.yaml:7:22: found lists and mappings more than 64 deep"), std::string::npos) << refusal_of(chain);
  const std::string text = refusal_of(kHead + "mode: " + std::string(1'000'000, 'a') + "\n" + std::string(1000, 'b') + ": 1\n");
  EXPECT_NE(text.find("aaa... (1000000 bytes)"), std::string::npos);
  EXPECT_LT(text.size(), 3000u);
}

TEST(Document, TabsAndFalseSpacesAreNamedAtTheirPlace) {
  EXPECT_EQ(refusal_of("experiment: tabs\nrounds: 10\nagents:\n\tcount: 4\n\tprotocol: local_voting\ntopology: ring\n"),
            "e.yaml:4:1: found a tab in the indentation; allowed: spaces");
  EXPECT_EQ(refusal_of("experiment: tabs\nagents:\n  count: 4\n\tprotocol: local_voting\n").find("e.yaml:4:1: found a tab"), 0u);
  EXPECT_EQ(refusal_of("experiment: e\nagents:\n\u00a0\u00a0count: 4\n").find("e.yaml:3:1: found a no-break space (U+00A0)"), 0u);
  EXPECT_EQ(refusal_of("experiment: e\nrounds:\u00a05\n").find("e.yaml:2:8: found a no-break space (U+00A0)"), 0u);
  EXPECT_EQ(refusal_of(kHead + "rounds: 5\u202f # \u00a0\n").find("e.yaml:4:10: found a narrow no-break space (U+202F)"), 0u);
  EXPECT_EQ(refusal_of("# \u00a0\t\n" + kHead + "rounds:\t5\t# and tabs after it\n"), "") << "a comment may hold them";
}

TEST(Document, WhereTextBelongsANumberIsAskedForInQuotes) {
  EXPECT_EQ(refusal_of(kHead + "criteria: [disagreement < 0,000001]\n"), "e.yaml:4:29: criteria[1]: found 000001; allowed: text, in quotes")
      << "a comma that parts two entries";
  EXPECT_EQ(refusal_of(kHead + "criteria: [true]\n"), "e.yaml:4:12: criteria[0]: found true; allowed: text, in quotes");
  EXPECT_EQ(refusal_of(kHead + "criteria: ['1']\n").find("e.yaml:4:12: criteria[0]: criterion: found '1'"), 0u);
  EXPECT_EQ(refusal_of("experiment: true\nagents: {count: 4, protocol: local_voting, initial: {x: 0}}\ntopology: ring\n")
                .find("e.yaml:1:13: experiment: found true; allowed: a name of letters"),
            0u);
}

TEST(Document, ControlCharactersAreRefusedAtTheirPlace) {
  EXPECT_EQ(refusal_of(kHead + "rounds: 5" + std::string(1, '\0') + "\n"),
            "e.yaml:4:10: found the control character U+0000; allowed: text");
  EXPECT_EQ(refusal_of(kHead + "\x04" + "rounds: x\n").find("e.yaml:4:1: found the control character U+0004"), 0u) << "YAML would end here";
  EXPECT_EQ(refusal_of("\xef\xbb\xbf" + kHead), "") << "a byte order mark";
}

TEST(Document, MergeKeysAndAnchorsOfTheirOwnWork) {
  const Experiment merged = read(R"(experiment: e
x-noise: &noise {bernoulli: 0.25}
x-agent: &sure {initial: {x: 7}}
x-more: &more {loss: *noise, delay_rounds: 2}
agents: {count: 4, protocol: local_voting, initial: {x: 1}, overrides: {2: *sure, 3: {<<: *sure}}}
topology: ring
links: {<<: [*more, {delay_rounds: 9, duplication: 0.5}], duplication: 0.125}
)");
  const Experiment plain = read(R"(experiment: e
agents: {count: 4, protocol: local_voting, initial: {x: 1}, overrides: {2: {initial: {x: 7}}, 3: {initial: {x: 7}}}}
topology: ring
links: {loss: {bernoulli: 0.25}, delay_rounds: 2, duplication: 0.125}
)");
  EXPECT_EQ(merged.resolved_text, plain.resolved_text);
  EXPECT_EQ(merged.resolved_text.find("x-"), std::string::npos);
  EXPECT_EQ(refusal_of(kHead + "links: {<<: 5}\n").find("e.yaml:4:13: <<: found 5; allowed: an alias of a mapping"), 0u);
  EXPECT_NE(refusal_of(kHead + "x-l: &l {los: 1}\nlinks: {<<: *l}\n").find("e.yaml:4:10: links: found the unknown key 'los'"),
            std::string::npos)
      << "at the place where it is written";
  EXPECT_NE(refusal_of(kHead + "links: {x-l: 1}\n").find("found the unknown key 'x-l'"), std::string::npos) << "at the top only";
}

TEST(Document, NumbersAreDecimalAndWhole) {
  const auto found = [](const std::string& key, const std::string& value) { return refusal_of(kHead + key + ": " + value + "\n"); };
  for (const char* key : {"seed", "runs", "rounds"})
    for (const char* value : {"-1", "18446744073709551616", "1x", "0x10", "0o17", "1.5", "1e3", ".nan", ".inf", "nan", "inf", "'7'",
                              "1_000", "+-1", "[1]", "{}", "~"})
      EXPECT_EQ(found(key, value).find(fmt::format("e.yaml:4:")), 0u) << key << ": " << value << ": " << found(key, value);
  for (const char* value : {"0", "-1", "1e999", "1x", "0x10", ".nan", ".inf", "nan", "inf", "'7'", "1_000", "--1", "[1]", "{}", "~"})
    EXPECT_EQ(found("dt", value).find("e.yaml:4:"), 0u) << value << ": " << found("dt", value);
  EXPECT_EQ(read(kHead + "rounds: 010\n").rounds, 10u);
  EXPECT_EQ(read(kHead + "seed: 18446744073709551615\n").seed.value, 18446744073709551615u);
}

}  // namespace
}  // namespace consort
