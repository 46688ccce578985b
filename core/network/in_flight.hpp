#pragma once
/// Messages under way on one delaying link.

#include "core/errors.hpp"
#include "core/types.hpp"

#include <optional>
#include <span>
#include <vector>

namespace consort {

class InFlight {
 public:
  struct Message {
    Round due = 0, sent = 0;
    double weight = 1.0;              ///< of the edge in the round of emission
    std::span<const double> payload;  ///< valid until the next call of a non-const function
  };

  /// Room for the payload of a message that arrives in round `due`; the caller fills it at once. No allocation in steady state.
  std::span<double> add(Round due, Round sent, double weight, std::size_t size) {
    const std::size_t place = free_.empty() ? entries_.size() : free_.back();
    if (free_.empty()) {
      check(entries_.empty() || payloads_.size() == entries_.size() * size, "InFlight: all messages of a link have one size");
      entries_.push_back({});
      payloads_.resize(payloads_.size() + size);
      free_.reserve(entries_.size());
    } else {
      free_.pop_back();
    }
    entries_[place] = {due, sent, weight, true};
    return std::span(payloads_).subspan(place * size, size);
  }

  /// Takes out everything due in round k or before and returns the newest of it (the largest `sent`): the older ones are superseded. `each`
  /// is called with the `sent` of every one.
  template <class Each>
  std::optional<Message> take(Round k, Each&& each) {
    std::optional<std::size_t> newest;
    for (std::size_t place = 0; place < entries_.size(); ++place) {
      Entry& entry = entries_[place];
      if (!entry.under_way || entry.due > k) continue;
      entry.under_way = false;
      free_.push_back(place);  // its payload stays untouched until the next add()
      each(entry.sent);
      if (!newest || entries_[*newest].sent < entry.sent) newest = place;
    }
    if (!newest) return std::nullopt;
    const Entry& entry = entries_[*newest];
    const std::size_t size = payloads_.size() / entries_.size();
    return Message{entry.due, entry.sent, entry.weight, std::span<const double>(payloads_).subspan(*newest * size, size)};
  }

  std::optional<Message> take(Round k) {
    return take(k, [](Round) {});
  }

  [[nodiscard]] std::size_t count() const { return entries_.size() - free_.size(); }

 private:
  struct Entry {
    Round due = 0, sent = 0;
    double weight = 1.0;
    bool under_way = false;
  };
  std::vector<Entry> entries_;
  std::vector<double> payloads_;   // entry after entry
  std::vector<std::size_t> free_;  // places that may be used again
};

}  // namespace consort
