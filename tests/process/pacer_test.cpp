/// The clock of a process in real time.

#include "process/pacer.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace consort {
namespace {

TEST(Pacer, RoundsComeInOrderAndThoseThatAreOverAreLeftOut) {
  std::mutex mutex;
  std::condition_variable wake;
  std::vector<Round> seen;
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto start = static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
  constexpr Round kLast = 400;
  Pacer pacer(start, 0.005, 0, kLast, {0.0}, [&](std::size_t, Round k) {
    std::unique_lock lock(mutex);
    seen.push_back(k);
    // The first call takes as long as fifty rounds do.
    if (seen.size() == 1) wake.wait_for(lock, std::chrono::milliseconds(250), [] { return false; });
    if (k == kLast) wake.notify_all();
  });
  std::unique_lock lock(mutex);
  ASSERT_TRUE(wake.wait_for(lock, std::chrono::seconds(60), [&] { return !seen.empty() && seen.back() == kLast; }));
  Performance performance;
  lock.unlock();
  pacer.add_to(performance);
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
  EXPECT_EQ(performance.periods, seen.size());
  if (seen.front() + 50 < kLast) {
    EXPECT_GE(performance.missed_deadlines, 48u) << "250 ms are 50 rounds";
  }
  EXPECT_EQ(seen.front() + seen.size() + performance.missed_deadlines, kLast + 1) << "each round is called or counted";
}

TEST(Lateness, QuantilesAreRightToAFewPerCent) {
  Lateness lateness;
  for (int i = 1; i <= 1000; ++i) lateness.add(1e-6 * i);
  EXPECT_NEAR(lateness.quantile(0.5), 500e-6, 0.03 * 500e-6);
  EXPECT_NEAR(lateness.quantile(0.99), 990e-6, 0.03 * 990e-6);
  EXPECT_EQ(lateness.quantile(1.0), 1e-3);
  EXPECT_EQ(lateness.largest(), 1e-3);
}

}  // namespace
}  // namespace consort
