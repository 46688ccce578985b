#include "orchestrator/script/slips.hpp"

#include "orchestrator/script/document.hpp"
#include "orchestrator/script/script.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace consort {
namespace {

/// An experiment with `old` replaced by `slip`.
std::string with(const std::string& old, const std::string& slip) {
  std::string text = R"(# a question
experiment: d
seed: 11
rounds: 50
agents:
  count: 4
  protocol: {name: kalman_consensus, Q: 0.1}
  initial:
    x: {linspace: [5, 7]}
    P: 1
topology: ring
links:
  loss: {bernoulli: 0.1}
metrics: [disagreement]
criteria: ["disagreement < 5"]
)";
  return text.replace(text.find(old), old.size(), slip);
}

std::string refusal_of(const std::string& text) {
  try {
    parse_experiment(text, "e", ".");
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

void expect_refused(const std::string& old, const std::string& slip, const std::string& expected) {
  const std::string refusal = refusal_of(with(old, slip));
  EXPECT_EQ(refusal.substr(0, expected.size()), expected) << "of '" << slip << "': " << refusal;
}

TEST(Slips, AKeyWithoutASpaceAfterItsColonIsNamedAtTheColon) {
  expect_refused("rounds: 50", "rounds:50", "e:4:7: found 'rounds:50' without a space after the colon; allowed: 'rounds: 50'");
  expect_refused("rounds: 50", "rounds:50   # \"x: [", "e:4:7: found 'rounds:50' without");
  expect_refused("experiment: d", "experiment:d", "e:2:11: found 'experiment:d' without");
  expect_refused("seed: 11\nrounds: 50", "seed:11\nrounds:50", "e:3:5: found 'seed:11' without");
  expect_refused("count: 4", "count:4", "e:6:8: found 'count:4' without");
  expect_refused("{bernoulli: 0.1}", "{bernoulli:0.1}", "e:13:19: found 'bernoulli:0.1' without");
  expect_refused("rounds: 50", "\"rounds\":50", "e:4:9: found '\"rounds\":50' without");
  EXPECT_EQ(refusal_of(with("rounds: 50\n", "") + "rounds:50\n").find("e:15:7: found 'rounds:50' without"), 0u) << "in the last line too";
}

TEST(Slips, AKeyWithoutAColonIsNamedWhereItStands) {
  expect_refused("rounds: 50", "rounds 50", "e:4:1: found 'rounds 50', which has no colon; allowed: 'rounds: 50'");
  expect_refused("rounds: 50", "rounds = 50", "e:4:8: found '=' after 'rounds'; allowed: a colon and a space, 'rounds: 50'");
  expect_refused("rounds: 50", "rounds: 50: 60", "e:4:11: found a second colon in the line");
  expect_refused("rounds: 50", "rounds: 50 runs: 2", "e:4:16: found a second colon in the line");
}

TEST(Slips, ACharacterThatLooksLikeAnotherIsNamedAtItsPlace) {
  expect_refused("rounds: 50", "rounds\uff1a50", "e:4:7: found a full-width colon (U+FF1A); allowed: a plain colon and a space");
  expect_refused("rounds: 50", "rounds\uff1a 50", "e:4:7: found a full-width colon");
  expect_refused("[5, 7]", "[5\uff0c 7]", "e:9:21: found a full-width comma (U+FF0C)");
  expect_refused("{bernoulli: 0.1}", "\uff5bbernoulli: 0.1\uff5d", "e:13:9: found a full-width brace (U+FF5B)");
  expect_refused("\"disagreement < 5\"", "\u201cdisagreement < 5\u201d",
                 "e:15:12: found a curly quotation mark (U+201C); allowed: plain quotes");
  expect_refused("[5, 7]", "[\u22125, 7]", "e:9:20: found a minus sign (U+2212); allowed: a plain '-'");
  const std::string twice = refusal_of(with("rounds: 50\n", "rounds: 50\u2028"));
  EXPECT_EQ(twice, "e:4:11: found a line separator (U+2028); allowed: a plain end of line") << "once";
  EXPECT_EQ(refusal_of(with("# a question", "# \u201ca question\u201d \u2013")), "") << "a comment may hold them";
}

TEST(Slips, QuotesAndBracketsThatDoNotMatchAreNamedWhereTheyOpenOrClose) {
  expect_refused("\"disagreement < 5\"", "\"disagreement < 5", "e:15:12: found a quotation mark (\") that is not closed");
  expect_refused("\"disagreement < 5\"", "'disagreement < 5", "e:15:12: found a quotation mark (') that is not closed");
  expect_refused("experiment: d", "experiment: \"d", "e:2:13: found a quotation mark (\") that is not closed");
  expect_refused("[5, 7]}", "[5, 7}", "e:9:24: found '}' where the '[' of line 9, column 19 is open; allowed: a ']' first");
  expect_refused("[5, 7]}", "[5, 7]", "e:9:8: found '{' that is not closed; allowed: a '}' for it");
  expect_refused("{linspace", "linspace", "e:9:24: found '}' that closes nothing");
  expect_refused("[disagreement]", "[disagreement]]", "e:14:24: found ']' that closes nothing");
  expect_refused("[disagreement]", "[disagreement", "e:14:10: found '[' that is not closed");
  expect_refused("Q: 0.1}", "\n    Q: 0.1", "e:7:13: found '{' that is not closed");
  expect_refused("\"disagreement < 5\"", "x[0] < 5", "e:15:13: found '[' within a text within brackets; allowed: such a text in quotes");
}

TEST(Slips, AnIndentationThatFitsNoLineIsNamedWithThoseThatWould) {
  expect_refused("  count", " count",
                 "e:7:3: found a line that is indented further than line 6, which has a value already; allowed: 1 space as");
  expect_refused(
      "  count", "   count",
      "e:7:3: found an indentation of 2, which no line has that this one could belong with; allowed: 3 as line 6, or 0 as line 5");
  expect_refused(
      "    P:", "   P:",
      "e:10:4: found an indentation of 3, which no line has that this one could belong with; allowed: 4 as line 9, or 2 as line 8");
  expect_refused("    P:", "     P:", "e:10:6: found a line that is indented further than line 9");
  expect_refused("agents:", "agents: 4", "e:6:3: found a line that is indented further than line 5, which has a value already");
  expect_refused("[\"disagreement < 5\"]", "\n  - disagreement < 5\n - rounds < 9", "e:17:2: found an indentation of 1");
  expect_refused("  count: 4", "\tcount: 4", "e:6:1: found a tab in the indentation");
  EXPECT_NE(
      refusal_of(with("topology: ring", "  topology: ring"))
          .find("e:11:3: agents: found the unknown key 'topology'; allowed: count, protocol, protocols, initial, overrides; it belongs at "
                "the top level"),
      std::string::npos);
}

TEST(Slips, WhatMeansSomethingToYamlIsAskedForInQuotes) {
  expect_refused("rounds: 50", "rounds: %50", "e:4:9: found '%' at the beginning of a text");
  expect_refused("experiment: d", "experiment: @d", "e:2:13: found '@' at the beginning of a text");
  expect_refused("rounds: 50", "rounds: *r", "e:4:9: found the alias '*r' of nothing before it");
}

TEST(Slips, AKeyWithoutAValueIsNamedInItsOwnLine) {
  expect_refused("rounds: 50", "rounds:", "e:4:1: rounds: found nothing");
  expect_refused("rounds: 50", "rounds:   # later\n\n# more", "e:4:1: rounds: found nothing");
  expect_refused("rounds: 50", "rounds: ~", "e:4:9: rounds: found nothing");
  expect_refused("count: 4", "count:", "e:6:3: agents.count: found nothing");
  expect_refused("    x: {linspace: [5, 7]}", "    x:", "e:9:5: agents.initial.x: found nothing");
  expect_refused("{bernoulli: 0.1}", "{bernoulli: }", "e:13:21: links.loss.bernoulli: found nothing");
  expect_refused("[\"disagreement < 5\"]", "\n  - disagreement < 5\n  -", "e:17:3: criteria[1]: found nothing");
  EXPECT_EQ(refusal_of(with("rounds: 50\n", "") + "rounds:\n").find("e:15:1: rounds: found nothing"), 0u);
}

TEST(Slips, LinesEndAsOnAnySystem) {
  for (const std::string end : {"\n", "\r", "\r\n"}) {
    std::string text;
    for (const char c : with("rounds: 50", "rounds: 7")) text += c == '\n' ? end : std::string(1, c);
    const Experiment read = parse_experiment("\xef\xbb\xbf" + text, "e", ".");
    EXPECT_EQ(read.rounds, 7u);
    EXPECT_EQ(read.description, "a question");
    text.replace(text.find('7'), 1, "x");
    EXPECT_EQ(refusal_of(text).find("e:4:9: rounds: found text 'x'"), 0u) << refusal_of(text);
  }
}

}  // namespace
}  // namespace consort
