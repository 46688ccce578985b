#pragma once
/// Calls a driver at the absolute instants of the wall clock at which rounds begin: no drift, whatever each call takes.

#include "core/trace.hpp"

#include <sys/prctl.h>

#include <array>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace consort {

/// How late wake-ups were, in bins of 2.3 %; the largest exactly.
class Lateness {
 public:
  void add(Seconds late) {
    late = std::max(late, 0.0);
    const double bin = late <= kSmallest ? 0.0 : std::ceil(std::log10(late / kSmallest) * kBinsPerDecade);
    ++bins_[std::min(static_cast<std::size_t>(bin), bins_.size() - 1)];
    ++count_;
    largest_ = std::max(largest_, late);
  }
  /// Upper edge of the bin that holds this share of all, 0 < share <= 1.
  [[nodiscard]] Seconds quantile(double share) const {
    const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
    std::uint64_t seen = 0;
    for (std::size_t bin = 0; bin < bins_.size(); ++bin)
      if ((seen += bins_[bin]) >= wanted) return std::min(largest_, kSmallest * std::pow(10.0, static_cast<double>(bin) / kBinsPerDecade));
    return largest_;
  }
  [[nodiscard]] Seconds largest() const { return largest_; }

 private:
  static constexpr Seconds kSmallest = 1e-7;
  static constexpr double kBinsPerDecade = 100.0;
  std::array<std::uint64_t, 1000> bins_{};  // up to 1000 s
  std::uint64_t count_ = 0;
  Seconds largest_ = 0.0;
};

class Pacer {
 public:
  /// `phase` of round k has come.
  using Beat = std::function<void(std::size_t phase, Round k)>;

  /// Round k begins at `start_ns` (ns of the wall clock since 1970) plus k dt, and its phase p that much later, in s. Calls `beat` on a
  /// thread of its own for the rounds from `first` (or from the one that is going on now) to `last`, in order. A round that is over before
  /// its turn comes is left out, and counted.
  Pacer(std::uint64_t start_ns, Seconds dt, Round first, Round last, std::vector<Seconds> phases, Beat beat)
      : dt_(dt), last_(last), phases_(std::move(phases)), beat_(std::move(beat)) {
    const auto wall = std::chrono::system_clock::time_point(
        std::chrono::duration_cast<std::chrono::system_clock::duration>(std::chrono::nanoseconds(start_ns)));
    start_ = std::chrono::steady_clock::now() + (wall - std::chrono::system_clock::now());
    thread_ = std::thread([this, first] { run(std::max(first, now())); });
  }
  ~Pacer() {
    {
      const std::lock_guard lock(mutex_);
      stopped_ = true;
    }
    wake_.notify_all();
    thread_.join();
  }
  Pacer(const Pacer&) = delete;
  Pacer& operator=(const Pacer&) = delete;

  /// Adds what is known of the time kept so far. `process` and the rest stay as they are.
  void add_to(Performance& performance) const {
    const std::lock_guard lock(mutex_);
    performance.periods = periods_;
    performance.missed_deadlines = missed_;
    performance.jitter_p50 = lateness_.quantile(0.5);
    performance.jitter_p99 = lateness_.quantile(0.99);
    performance.jitter_max = lateness_.largest();
  }

 private:
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] Clock::time_point instant(Round k, Seconds phase) const {
    return start_ + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(k * dt_ + phase));
  }
  // The round that is going on; 0 before the first.
  [[nodiscard]] Round now() const {
    const double elapsed = std::chrono::duration<double>(Clock::now() - start_).count();
    return elapsed <= 0.0 ? 0 : static_cast<Round>(std::min(elapsed / dt_, static_cast<double>(last_)));
  }

  void run(Round k) {
    prctl(PR_SET_NAME, "pacer");
    prctl(PR_SET_TIMERSLACK, 1UL);  // ns, instead of 50 us
    for (; k <= last_; k = next_after(k)) {
      for (std::size_t phase = 0; phase < phases_.size(); ++phase) {
        if (!wait_until_instant(instant(k, phases_[phase]), phase == 0)) return;
        beat_(phase, k);
      }
    }
  }

  bool wait_until_instant(Clock::time_point instant, bool counted) {
    std::unique_lock lock(mutex_);
    if (wake_.wait_until(lock, instant, [this] { return stopped_; })) return false;
    if (counted) {
      ++periods_;
      lateness_.add(std::chrono::duration<double>(Clock::now() - instant).count());
    }
    return true;
  }

  Round next_after(Round k) {
    const Round going_on = now();
    if (going_on <= k + 1) return k + 1;
    const std::lock_guard lock(mutex_);
    missed_ += going_on - (k + 1);
    return going_on;
  }

  Clock::time_point start_;
  Seconds dt_;
  Round last_;
  std::vector<Seconds> phases_;
  Beat beat_;
  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable wake_;
  bool stopped_ = false;
  Lateness lateness_;
  std::uint64_t periods_ = 0, missed_ = 0;
  std::thread thread_;
};

}  // namespace consort
