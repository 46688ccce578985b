#include "process/patience.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

using Seconds = Patience::Duration;

TEST(Patience, WhoHasLostNothingYetIsPatient) { EXPECT_EQ(Patience().wait(), Patience::kUntouched); }

TEST(Patience, WaitsLongerAndLongerWhileNothingComes) {
  Patience patience;
  Seconds before = patience.wait();
  for (int i = 0; i < 40; ++i) {
    patience.asks(Seconds(i));
    EXPECT_GE(patience.wait(), before);
    EXPECT_LE(patience.wait(), Patience::kLongest);
    before = patience.wait();
  }
  EXPECT_EQ(before, Patience::kLongest);
  patience.goes_on(Seconds(100));
  EXPECT_EQ(patience.wait(), Patience::kUntouched) << "of many questions nobody knows which one was answered";
}

TEST(Patience, LearnsHowLongAnAnswerTakes) {
  Patience patience;
  for (int i = 0; i < 50; ++i) {
    patience.asks(Seconds(i));
    patience.goes_on(Seconds(i + 0.01));
  }
  EXPECT_NEAR(patience.wait().count(), 0.02, 0.001);
  for (int i = 50; i < 100; ++i) {
    patience.asks(Seconds(i));
    patience.goes_on(Seconds(i + 0.0001));
  }
  EXPECT_EQ(patience.wait(), Patience::kShortest);
}

TEST(Patience, IsNotLedAstrayByAnswersThatWereLateThemselves) {
  Patience patience;
  for (int i = 0; i < 100; ++i) {
    patience.asks(Seconds(i));
    patience.goes_on(Seconds(i + (i % 10 == 0 ? 0.004 : 0.09)));
  }
  EXPECT_LT(patience.wait().count(), 0.015);
}

TEST(Patience, WhoAskedForWhatWasOnlyLateWaitsLongerUntilAnswersAreNeededAgain) {
  Patience patience;
  patience.asks(Seconds(0));
  patience.goes_on(Seconds(0.01));
  const Seconds before = patience.wait();
  patience.was_hasty();
  EXPECT_EQ(patience.wait(), 2.0 * before);
  for (int i = 0; i < 100; ++i) patience.was_hasty();
  EXPECT_EQ(patience.wait(), Patience::kMostReluctant);
  for (int i = 1; i < 200; ++i) {  // every fifth answer comes twice: another had lost it, too
    patience.asks(Seconds(i));
    patience.goes_on(Seconds(i + 0.01));
    if (i % 5 == 0) patience.was_hasty();
  }
  EXPECT_LE(patience.wait(), 2.0 * before);
}

TEST(Patience, WhoIsSlowHasLostNothing) {
  Patience patience;
  patience.asks(Seconds(0));
  patience.goes_on(Seconds(30));
  EXPECT_EQ(patience.wait(), Patience::kUntouched);
}

}  // namespace
}  // namespace consort
