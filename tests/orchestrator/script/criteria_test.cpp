#include "orchestrator/script/criteria.hpp"

#include "core/errors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

namespace consort {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

CriterionResult judged(const std::string& text, const Metrics& metrics) { return judge(std::vector{text}, metrics).front(); }

std::string refusal(const std::string& text, std::vector<std::string> known = {"bias", "disagreement", "rounds"}) {
  try {
    check_criterion(text, known);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Criterion, IsJudgedByItsComparisonAndReportsItsLeftHandSide) {
  const Metrics metrics{{"bias", -0.5}, {"rounds", 30}};
  const auto met = judged("abs(bias) < 1", metrics);
  EXPECT_TRUE(met.met);
  EXPECT_EQ(met.value, 0.5);
  const auto missed = judged("rounds * 2 <= 59", metrics);
  EXPECT_FALSE(missed.met);
  EXPECT_EQ(missed.value, 60.0);
  EXPECT_EQ(missed.text, "rounds * 2 <= 59");
}

TEST(Criterion, UnderstandsConjunctionAndEveryComparison) {
  const Metrics metrics{{"bias", 1.0}, {"rounds", 30}};
  EXPECT_TRUE(judged("bias >= 1 && rounds == 30", metrics).met);
  EXPECT_FALSE(judged("bias > 1 && rounds == 30", metrics).met);
  EXPECT_TRUE(judged("bias > 1 || rounds != 31", metrics).met);
  EXPECT_EQ(judged("bias + 1 > 1 || rounds != 31", metrics).value, 2.0);
}

TEST(Criterion, ReadsPrefixedComponentAndDeviationNames) {
  const Metrics metrics{{"kalman_consensus.bias[0]", 2.0}, {"kalman_consensus.bias[1]", -3.0}, {"kalman_consensus.bias[1].std", 0.5}};
  EXPECT_TRUE(judged("kalman_consensus.bias[0] > kalman_consensus.bias[1] + 3 * kalman_consensus.bias[1].std", metrics).met);
  EXPECT_EQ(metrics_of("kalman_consensus.bias[1] < 0.5 * kalman_consensus.bias[0]"),
            (std::vector<std::string>{"kalman_consensus.bias[0]", "kalman_consensus.bias[1]"}));
}

TEST(Criterion, ChainedMeansWhatItSays) {
  EXPECT_FALSE(judged("10 < bias < 20", {{"bias", 4}}).met);
  EXPECT_TRUE(judged("10 < bias < 20", {{"bias", 14}}).met);
  EXPECT_FALSE(judged("10 < bias < 20", {{"bias", 24}}).met);
  EXPECT_EQ(judged("10 < bias < 20", {{"bias", 4}}).value, 4.0) << "the side that is measured";
  EXPECT_EQ(judged("bias < rounds < bias + 9", {{"bias", 1}, {"rounds", 4}}).value, 4.0) << "and enclosed";
  EXPECT_TRUE(judged("3 >= bias > rounds >= 1", {{"bias", 3}, {"rounds", 1}}).met);
  EXPECT_TRUE(judged("bias == rounds == 2", {{"bias", 2}, {"rounds", 2}}).met);
  for (const char* text : {"1 < bias > 2", "1 < bias == 2", "1 != bias != 2", "bias == 1 != rounds"})
    EXPECT_PRED_FORMAT2(testing::IsSubstring, "a chain runs in one direction", refusal(text));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "column 10: a chain", refusal("1 < bias > 2"));
}

TEST(Criterion, JoinsComparisonsByWordsAndSigns) {
  const Metrics metrics{{"bias", 1.0}, {"rounds", 30}};
  for (const char* met :
       {"bias < 2 and rounds > 3", "bias > 2 or rounds > 3", "not bias > 2", "!bias > 2", "not(bias > 2)&&!(rounds<3)", "not not bias < 2",
        "bias < 2 or bias > 2 and rounds < 3", "not bias > 2 or rounds > 3", "(bias < 2) and ((rounds) > (3))", "((bias + 1) * 2 == 4)",
        "bias<2&&rounds>3||bias>2", "bias != 2 and bias>=1", "bias < 2\n  and rounds == 30"})
    EXPECT_TRUE(judged(met, metrics).met) << met;
  for (const char* unmet : {"(bias < 2 or bias > 2) and rounds < 3", "not (bias < 2 or rounds > 99)", "not bias < 2 and rounds > 3",
                            "bias > 2 or rounds < 3", "!(bias != 2)"})
    EXPECT_FALSE(judged(unmet, metrics).met) << unmet;
}

TEST(Criterion, CalculatesAsOneDoesByHand) {
  const Metrics metrics{{"bias", 3.0}, {"a.b_1e5[0].std", 2.0}};
  for (const char* met :
       {"-bias^2 == -9", "(-bias)^2 == 9", "2^bias^2 == 512", "2^-bias == .125", "bias - 1 - 1 == 1", "12 / bias / 2 == 2",
        "1e-6 * bias < 3.1E-6", "--bias == +3.", "min(bias, 4, 2) == 2 and max(bias) == 3", "abs(-bias) == 3", "sqrt(bias + 6) == 3",
        "exp(ln(bias)) / 3 <= 1.0000001", "log10(10^bias) == 3", "a.b_1e5[0].std*bias==6", "1 + bias * 2 == 7", "bias*-2 < -5"})
    EXPECT_TRUE(judged(met, metrics).met) << met;
}

TEST(Criterion, ShowsEveryMetricItNamesAndTheShareOfRunsThatHasIt) {
  const Metrics metrics{{"bias", 1.0}, {"bias.share", 1.0}, {"rounds", 30}, {"rounds.share", 0.5}};
  const CriterionResult result = judged("abs(bias - 4) < 2 or rounds < 9", metrics);
  EXPECT_EQ(result.value, 3.0);
  EXPECT_EQ(result.metrics, (Metrics{{"bias", 1.0}, {"rounds", 30.0}, {"rounds.share", 0.5}}));
}

TEST(Criterion, OnAMetricThatIsNotThereIsNotMet) {
  const CriterionResult result = judged("not speed > 1", {{"bias", 0.0}});
  EXPECT_FALSE(result.met);
  EXPECT_TRUE(std::isnan(result.metrics.at("speed")));
}

TEST(Criterion, IsNeverMetByANumberThatIsNone) {
  const Metrics metrics{{"rounds_to_convergence", kNaN}, {"bias", 0.0}};
  for (const char* text : {"rounds_to_convergence <= 300", "rounds_to_convergence > 300", "rounds_to_convergence != 3",
                           "bias < 1 || rounds_to_convergence < 3", "bias / bias != 1", "not rounds_to_convergence < 3",
                           "bias < 1 or not (bias < 1 and rounds_to_convergence < 3)", "max(bias / bias, 1) == 1", "(bias / bias)^0 == 1",
                           "sqrt(bias - 1) < 1 or bias < 1"}) {
    SCOPED_TRACE(text);
    EXPECT_FALSE(judged(text, metrics).met);
  }
}

TEST(Criterion, IsNeverMetByWhatIsInfinite) {
  const Metrics metrics{{"bias", 3}, {"far", std::numeric_limits<double>::infinity()}};
  for (const char* text : {"1 / (bias - bias) > 1", "far > 1", "-1 / (bias - bias) < 0", "not 1 / (bias - bias) < 1", "bias > 1 or far > 1",
                           "1 / (1 / (bias - bias)) < 1", "exp(1000 * bias) > 1"}) {
    EXPECT_FALSE(judged(text, metrics).met) << text;
    EXPECT_EQ(judged(text, metrics).undefined, "infinite") << text;
  }
  EXPECT_EQ(judged("(bias - bias) / (bias - bias) > 1", metrics).undefined, "not a number");
  EXPECT_EQ(judged("absent > 1", metrics).undefined, "not a number");
  EXPECT_EQ(judged("bias > 5", metrics).undefined, "");
}

TEST(Criterion, WithAnUnknownMetricNamesTheNearest) {
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "found the unknown metric 'disagrement'", refusal("disagrement < 1"));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "allowed: bias, disagreement, rounds; did you mean 'disagreement'?",
                      refusal("disagrement < 1"));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "'disagrement' (column 12)", refusal("1 < bias + disagrement"));
}

TEST(Criterion, ThatIsNoComparisonIsRefusedWithTheReason) {
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "no comparison", refusal("abs(bias)"));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "'==' compares", refusal("bias = 0"));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "found 'bias < '", refusal("bias < "));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "allowed: a comparison over metric names", refusal("(bias < 1"));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "allowed: a comparison over metric names", refusal("bias < 1 )"));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "it names no metric", refusal("1 < 2"));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "besin", refusal("besin(bias) < 2"));
  EXPECT_EQ(refusal("bias <= 0"), "accepted");
}

TEST(Criterion, IsRefusedAtTheColumnOfTheMistake) {
  const std::vector<std::pair<std::string, std::string>> mistakes{
      {"disagreement < 0,000001", "column 17: ',' stands between the arguments of a call only; 'and' joins comparisons"},
      {"bias > 5, rounds > 0", "column 9: ',' stands between the arguments of a call only"},
      {"(bias, rounds) < 1", "column 6: ',' stands between"},
      {"abs(bias, 1) < 1", "column 9: abs() takes one argument"},
      {"bias = 5", "column 6: '=' assigns"},
      {"(bias = 5) < 1", "column 7: '=' assigns"},
      {"bias => 5", "column 6: '=' assigns; '==' compares, and so do '<=' and '>='"},
      {"bias < 1 ? 2 : 3", "column 10: found '?'"},
      {"bias < 1 & rounds < 2", "column 10: found a single '&'; '&&' joins"},
      {"bias < 1 | rounds < 2", "column 10: found a single '|'"},
      {"bias \xE2\x89\xA4 1", "column 6: found '\xE2\x89\xA4' in the place of the end or an operator"},
      {"\xC3\xA4 < bias", "column 1: found '\xC3\xA4' in the place of a number or a metric"},
      {"bias < \"a\"", "column 8: found '\"'"},
      {"bias < 1 AND rounds < 2", "column 10: found 'AND' in the place of the end or an operator"},
      {"bias < 2x", "column 9: found 'x' right after a number"},
      {"bias < 0x10", "column 9: found 'x' right after"},
      {"bias < 1e", "column 9: found 'e' right after"},
      {"bias < 1.2.3", "column 11: found '.' right after"},
      {"bias < 1e999", "column 8: a number beyond the range of doubles"},
      {"bias < 2 rounds", "column 10: found 'rounds'"},
      {"(bias < 1", "column 10: it ends where the ')' of column 1 or an operator is missing"},
      {"bias < 1 )", "column 10: found ')'"},
      {"", "column 1: it ends where a number or a metric is missing"},
      {"bias < 1 and", "column 13: it ends where"},
      {"and bias < 1", "column 1: found 'and'"},
      {"bias and rounds < 1", "column 1: no comparison where 'and' asks for one"},
      {"rounds < 1 or bias", "column 15: no comparison where 'or' asks for one"},
      {"not bias", "column 5: no comparison where 'not' asks for one"},
      {"(bias < 1) + 1 < 3", "column 1: a comparison where '+' asks for a number"},
      {"(bias < 1) == (rounds < 1)", "column 1: a comparison where a comparison asks for a number"},
      {"abs(bias < 1) < 1", "column 5: a comparison where abs() asks for a number"},
      {"bias < !rounds", "column 8: what is negated is a comparison"},
      {"bias < 1 or 1 < 2", "column 13: it names no metric"},
      {"0 < 1 < bias", "column 1: it names no metric"},
      {"abss(bias) < 2", "column 1: there is no function 'abss' but abs, sqrt, exp, ln, log10, min, max; did you mean 'abs'?"},
      {"min() < bias", "column 5: found ')'"},
      {"sqrt bias < 2", "column 6: found 'bias'"},
      {std::string("bias \0< 1", 9), "column 6: found ' '"},
      {std::string(1000, '(') + "bias < 1", "nested too deeply"},
      {std::string(1000, '-') + "bias < 1", "nested too deeply"},
  };
  for (const auto& [text, why] : mistakes) EXPECT_PRED_FORMAT2(testing::IsSubstring, why, refusal(text));
  std::string sums = "bias", joined = "bias < 1";
  for (int i = 0; i < 10'000; ++i) sums += " + bias", joined += " and bias < 1";
  EXPECT_EQ(refusal(sums + " < 1"), "accepted") << "length is no depth";
  EXPECT_EQ(refusal(joined), "accepted");
}

}  // namespace
}  // namespace consort
