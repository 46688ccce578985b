#pragma once
/// How long nothing may come before one asks (again) for what is lacking: soon where messages are known to get lost, as measured round
/// trips say; less often while nothing comes, but not much: where one stands still soon all do, and each may have lost something of its
/// own. Who has asked for what was only late is more reluctant from then on: on a busy machine everything is late, and questions make it
/// later. Told the time, knows no clock.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

namespace consort {

class Patience {
 public:
  using Duration = std::chrono::duration<double>;
  static constexpr Duration kUntouched{0.1};  // before anything was ever lacking: who is late is only slow
  static constexpr Duration kShortest{0.002}, kLongest{0.5};
  static constexpr Duration kMostReluctant{2.0};

  /// For so long, if nothing has come since.
  [[nodiscard]] Duration wait() const {
    const Duration first = round_trip_ ? std::clamp(2.0 * *round_trip_, kShortest, kLongest) : kUntouched;
    return std::min(std::min(first * std::pow(2.0, std::min(asked_, 3)), kLongest) * reluctance_, kMostReluctant);
  }
  /// Something has been asked for.
  void asks(Duration now) {
    if (asked_++ == 0) first_asked_ = now;
  }
  /// So often since the rounds went on last.
  [[nodiscard]] int asked() const { return asked_; }
  /// The rounds go on. Of several questions nobody knows which one was answered; and who took so long was slow, and lost nothing.
  void goes_on(Duration now) {
    if (asked_ == 1 && now - first_asked_ < kUntouched) measure(now - first_asked_);
    asked_ = 0;
  }
  /// What was asked for has come twice: the question was needless.
  void was_hasty() {
    if (wait() < kMostReluctant) reluctance_ *= 2.0;
  }

 private:
  // The shortest of late: most answers come late because who answers stands still too, for want of something of its own. A mean would say
  // how long everybody waits, and make everybody wait for so long.
  void measure(Duration took) {
    round_trip_ = round_trip_ ? std::min(took, kForgets * *round_trip_) : took;
    reluctance_ = std::max(1.0, kRelents * reluctance_);
  }

  static constexpr double kForgets = 1.05, kRelents = 0.8;
  int asked_ = 0;
  Duration first_asked_{};
  std::optional<Duration> round_trip_;
  double reluctance_ = 1.0;
};

}  // namespace consort
