#pragma once
/// What was sent, by round, for as long as somebody may ask for it again. No allocation in steady state.

#include "core/types.hpp"

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace consort {

class SentWindow {
 public:
  struct Sent {
    Round round = 0;
    std::uint32_t repeated = 0;  ///< so often
    std::vector<double> values;
  };

  /// Of a later round than all before.
  void push(Round round, std::span<const double> values) {
    if (count_ == places_.size()) grow();
    Sent& sent = at(count_++);
    sent.round = round;
    sent.repeated = 0;
    sent.values.assign(values.begin(), values.end());
  }
  /// Nobody asks for rounds before this one any more.
  void forget_before(Round round) {
    while (count_ > 0 && at(0).round < round) {
      first_ = (first_ + 1) % places_.size();
      --count_;
    }
  }
  /// Those of the rounds first <= k < first + rounds that are here, ascending.
  template <class Use>
  void for_each(Round first, Round rounds, Use&& use) {
    for (std::size_t i = 0; i < count_; ++i)
      if (Sent& sent = at(i); sent.round >= first && sent.round - first < rounds) use(sent);
  }

 private:
  [[nodiscard]] Sent& at(std::size_t place) { return places_[(first_ + place) % places_.size()]; }
  void grow() {
    std::vector<Sent> wider(places_.empty() ? 4 : 2 * places_.size());
    for (std::size_t i = 0; i < count_; ++i) wider[i] = std::move(at(i));
    places_ = std::move(wider);
    first_ = 0;
  }

  std::vector<Sent> places_;  // a ring: the oldest at first_
  std::size_t first_ = 0, count_ = 0;
};

}  // namespace consort
