#pragma once
/// The rounds of a raw program that a clock paces: nobody is waited for, and what has not come when a round ends is missing. The
/// yardstick of Consort's mode realtime, with no link model, no telemetry, no orchestrator.

#include "tests/bench/lockstep.hpp"

#include <sys/prctl.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <ctime>

namespace consort::bench {

/// One agent of a process of its own. Round k is from instant k to instant k + 1, when what came of round k is used. Not thread-safe.
class PacedAgent {
 public:
  PacedAgent(Shape shape, std::uint32_t n, std::uint32_t id) : id_(id), neighbours_(neighbours_of(shape, n, id)) {
    heard_.resize(neighbours_.size());
    step_ = 0.5 / static_cast<double>(neighbours_.size() + 1);
    for (std::size_t i = 0; i < x_.size(); ++i) x_[i] = static_cast<double>((id * 37 + i * 11) % 100) / 100.0;
  }

  void receive(const Message& message) {
    const auto found = std::find(neighbours_.begin(), neighbours_.end(), message.id);
    if (found == neighbours_.end()) return;
    ++arrived_;
    if (message.round < over_) return;
    Sample& sample = heard_[static_cast<std::size_t>(found - neighbours_.begin())][message.round % kAhead];
    sample.until = message.round + 1;
    std::memcpy(sample.x.data(), message.x, sizeof message.x);
  }

  /// Instant k of `rounds` rounds: ends round k - 1, if it was begun, and begins round k.
  template <class Publish>
  void beat(std::uint32_t k, std::uint32_t rounds, Publish&& publish) {
    if (begun_ == k && k > 0) absorb(k - 1);
    over_ = k;
    if (k == rounds) return;
    begun_ = k + 1;
    Message message{id_, k, {}};
    std::memcpy(message.x, x_.data(), sizeof message.x);
    publish(message);
  }

  std::uint64_t arrived() const { return arrived_; }
  std::uint64_t in_time() const { return in_time_; }

 private:
  static constexpr std::size_t kAhead = 4;  ///< rounds that a neighbour's clock may be ahead of ours, ours included
  struct Sample {
    std::uint32_t until = 0;  // its round, plus one; 0: none yet
    std::array<double, 8> x{};
  };

  void absorb(std::uint32_t k) {
    std::array<double, 8> sum{};
    for (const auto& samples : heard_) {
      const Sample& sample = samples[k % kAhead];
      if (sample.until != k + 1) continue;
      ++in_time_;
      for (std::size_t i = 0; i < x_.size(); ++i) sum[i] += sample.x[i] - x_[i];
    }
    for (std::size_t i = 0; i < x_.size(); ++i) x_[i] += step_ * sum[i];
  }

  std::uint32_t id_;
  std::vector<std::uint32_t> neighbours_;
  std::vector<std::array<Sample, kAhead>> heard_;  // by neighbour, then by round
  std::array<double, 8> x_{};
  double step_ = 0.0;
  std::uint32_t begun_ = 0, over_ = 0;  // rounds below
  std::uint64_t arrived_ = 0, in_time_ = 0;
};

/// Absolute instants of CLOCK_MONOTONIC, all processes the same, and how late this process woke up for them. What Consort's Pacer does, by
/// the shortest means.
class Beats {
 public:
  Beats(double start, double dt, std::uint32_t last) : start_(start), dt_(dt), last_(last) { late_.reserve(last + 1); }

  /// Calls `beat(k)` at instant k of 0..last. Who has overslept instants goes on with the newest.
  template <class Beat>
  void run(Beat&& beat) {
    prctl(PR_SET_TIMERSLACK, 1UL);  // ns, instead of 50 us
    for (std::uint32_t k = 0; k <= last_; k = next_after(k)) {
      const double instant = start_ + k * dt_;
      await_instant(instant);
      late_.push_back(std::max(0.0, now() - instant));
      beat(k);
    }
    std::sort(late_.begin(), late_.end());
  }

  /// How late the wake-ups were, s; for 0 < share <= 1. After run().
  double jitter(double share) const { return late_[static_cast<std::size_t>(std::ceil(share * static_cast<double>(late_.size()))) - 1]; }
  std::uint64_t left_out() const { return left_out_; }

 private:
  static double now() {
    timespec time{};
    clock_gettime(CLOCK_MONOTONIC, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

  static void await_instant(double instant) {
    const double whole = std::floor(instant);
    const timespec time{static_cast<time_t>(whole), static_cast<long>((instant - whole) * 1e9)};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr) == EINTR) {
    }
  }

  std::uint32_t next_after(std::uint32_t k) {
    const double elapsed = std::max(0.0, now() - start_);
    const auto newest = static_cast<std::uint32_t>(std::min(elapsed / dt_, static_cast<double>(last_)));
    if (newest <= k + 1) return k + 1;
    left_out_ += newest - (k + 1);
    return newest;
  }

  double start_, dt_;
  std::uint32_t last_;
  std::vector<double> late_;
  std::uint64_t left_out_ = 0;
};

}  // namespace consort::bench
