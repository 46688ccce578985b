#include "orchestrator/criteria.hpp"

#include "core/errors.hpp"

#include <gtest/gtest.h>

#include <limits>

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

TEST(Criterion, IsNeverMetByANumberThatIsNone) {
  const Metrics metrics{{"rounds_to_convergence", kNaN}, {"bias", 0.0}};
  for (const char* text : {"rounds_to_convergence <= 300", "rounds_to_convergence > 300", "rounds_to_convergence != 3",
                           "bias < 1 || rounds_to_convergence < 3", "bias / bias != 1"}) {
    SCOPED_TRACE(text);
    EXPECT_FALSE(judged(text, metrics).met);
  }
}

TEST(Criterion, WithAnUnknownMetricNamesTheNearest) {
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "found the unknown metric 'disagrement'", refusal("disagrement < 1"));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "allowed: bias, disagreement, rounds; did you mean 'disagreement'?",
                      refusal("disagrement < 1"));
  EXPECT_THROW(judged("speed < 1", {{"bias", 0.0}}), ConfigError);
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

}  // namespace
}  // namespace consort
