#pragma once
/// A queue from DDS's receive threads to the one thread of the run.

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <utility>
#include <vector>

namespace consort {

template <class Item>
class News {
 public:
  void push(Item&& item) {
    const std::lock_guard lock(mutex_);
    items_.push_back(std::move(item));
    if (items_.size() == 1) arrived_.notify_one();
  }
  /// All there is; waits for it, but for no longer than `patience`.
  std::deque<Item> take(std::chrono::milliseconds patience) {
    std::unique_lock lock(mutex_);
    arrived_.wait_for(lock, patience, [this] { return !items_.empty(); });
    return std::exchange(items_, {});
  }
  /// These come first, as if they had not been taken.
  template <class Kept>
  void give_back(std::vector<Kept>&& kept) {
    const std::lock_guard lock(mutex_);
    for (auto item = kept.rbegin(); item != kept.rend(); ++item) items_.emplace_front(std::move(*item));
  }

 private:
  std::mutex mutex_;  // guards items_
  std::condition_variable arrived_;
  std::deque<Item> items_;
};

}  // namespace consort
