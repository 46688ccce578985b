#include "core/network/sent_window.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

std::vector<Round> rounds_in(SentWindow& window, Round first, Round rounds) {
  std::vector<Round> found;
  window.for_each(first, rounds, [&](const SentWindow::Sent& sent) {
    EXPECT_EQ(sent.values, (std::vector<double>{1.0 * sent.round, 2.0}));
    found.push_back(sent.round);
  });
  return found;
}

TEST(SentWindow, KeepsWhatSomebodyMayAskForAndNoMore) {
  SentWindow window;
  EXPECT_TRUE(rounds_in(window, 0, 10).empty());
  window.forget_before(5);
  for (Round k = 0; k < 1000; ++k) {
    if (k % 7 == 3) continue;  // nobody heard it there
    window.forget_before(k < 20 ? 0 : k - 20);
    window.push(k, std::vector<double>{1.0 * k, 2.0});
  }
  EXPECT_EQ(rounds_in(window, 995, 3), (std::vector<Round>{995, 996}));
  EXPECT_EQ(rounds_in(window, 0, 980), (std::vector<Round>{979}));
  EXPECT_EQ(rounds_in(window, 999, kNever), (std::vector<Round>{999}));
  window.forget_before(2000);
  EXPECT_TRUE(rounds_in(window, 0, kNever).empty());
  window.push(2000, std::vector<double>{2000.0, 2.0});
  EXPECT_EQ(rounds_in(window, 0, kNever), (std::vector<Round>{2000}));
}

TEST(SentWindow, CountsHowOftenEachWasSentAgain) {
  SentWindow window;
  window.push(3, {});
  window.for_each(3, 1, [](SentWindow::Sent& sent) { sent.repeated = 4; });
  window.push(4, {});
  std::vector<std::uint32_t> repeated;
  window.for_each(0, 9, [&](const SentWindow::Sent& sent) { repeated.push_back(sent.repeated); });
  EXPECT_EQ(repeated, (std::vector<std::uint32_t>{4, 0}));
}

}  // namespace
}  // namespace consort
