/// The closed loop's topics: a measurement reaches the process it is for, and no other. What steers or records a run reaches who is late.

#include "idl/wire.hpp"
#include "tests/dds/ping.hpp"

#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <vector>

namespace consort::wire {
namespace {

using ping::TwoSides;
using namespace std::chrono_literals;

/// What a reader was handed, by round.
class Received {
 public:
  void add(Round round, std::span<const double> values) {
    const std::lock_guard lock(mutex_);
    rounds_.push_back(round);
    values_.assign(values.begin(), values.end());
    arrived_.notify_all();
  }
  /// Calls `again` now and then until `round` is here, or patience ends.
  bool holds(Round round, const std::function<void()>& again) {
    const auto give_up = std::chrono::steady_clock::now() + ping::kPatience;
    std::unique_lock lock(mutex_);
    while (std::find(rounds_.begin(), rounds_.end(), round) == rounds_.end()) {
      if (std::chrono::steady_clock::now() > give_up) return false;
      lock.unlock();
      again();
      lock.lock();
      arrived_.wait_for(lock, 50ms);
    }
    return true;
  }
  std::vector<Round> rounds() {
    const std::lock_guard lock(mutex_);
    return rounds_;
  }
  std::vector<double> values() {
    const std::lock_guard lock(mutex_);
    return values_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<Round> rounds_;
  std::vector<double> values_;
};

TEST_F(TwoSides, AMeasurementReachesItsProcessAndNoOther) {
  Received of_two, of_three;
  MeasurementReader two(there.participant, 2, [&](const Measurement& m) { of_two.add(m.round, m.values); });
  MeasurementReader three(there.participant, 3, [&](const Measurement& m) { of_three.add(m.round, m.values); });
  MeasurementWriter to_two(here.participant, 2, [](std::size_t) {}), to_three(here.participant, 3, [](std::size_t) {});
  const std::vector<double> secret{1.5, 2.5}, own{-1.0};
  // Rounds from 100 on prove the connections; a match alone does not.
  ASSERT_TRUE(of_two.holds(100, [&] { to_two.write({1, 100, secret}); }));
  ASSERT_TRUE(of_three.holds(200, [&] { to_three.write({1, 200, own}); }));
  for (Round k = 0; k < 50; ++k) to_two.write({1, k, secret});
  ASSERT_TRUE(of_two.holds(49, [&] { to_two.write({1, 49, secret}); }));
  // What was written to process 2 before this would have come before it, had it been sent to process 3 as well.
  ASSERT_TRUE(of_three.holds(201, [&] { to_three.write({1, 201, own}); }));
  for (const Round round : of_three.rounds()) EXPECT_GE(round, 200u);
  EXPECT_EQ(of_three.values(), own);
  EXPECT_EQ(of_two.values(), secret);
}

TEST_F(TwoSides, ActuationsOfEveryProcessReachThePlant) {
  Received at_plant;
  ActuationReader plant(here.participant, 0, [&](const Actuation& a) { at_plant.add(1000 * a.process + a.round, a.values); });
  ActuationWriter two(there.participant, 2, [](std::size_t) {}), three(there.participant, 3, [](std::size_t) {});
  const std::vector<double> control{0.25};
  ASSERT_TRUE(at_plant.holds(2007, [&] { two.write({1, 2, 7, control}); }));
  ASSERT_TRUE(at_plant.holds(3008, [&] { three.write({1, 3, 8, control}); }));
  EXPECT_EQ(at_plant.values(), control);
}

// A process that comes back into a run runs its rounds while packets of discovery may be lost: the orchestrator's reader, or its own, is
// not known yet, and more than one report, or grant, can have been written by then.
TEST_F(TwoSides, WhatWasWrittenBeforeItsReaderIsKnownReachesItWhole) {
  Writer<Telemetry> reports(here.participant);
  Writer<Grant> grants(here.participant);
  for (const Round k : {1u, 2u, 3u}) {
    reports.write({.process = 1, .epoch = 1, .last = false, .members = {}, .links = {}, .round = k});
    grants.write({1, k, k, {}});
  }
  Received reported, granted;
  const Reader<Telemetry> hears_reports(there.participant, [&](Telemetry&& report) { reported.add(report.round, {}); });
  const Reader<Grant> hears_grants(there.participant, [&](Grant&& grant) { granted.add(grant.until, {}); });
  ASSERT_TRUE(reported.holds(3, [] {}));
  ASSERT_TRUE(granted.holds(3, [] {}));
  EXPECT_EQ(reported.rounds(), (std::vector<Round>{1, 2, 3}));
  EXPECT_EQ(granted.rounds(), (std::vector<Round>{1, 2, 3}));
}

}  // namespace
}  // namespace consort::wire
