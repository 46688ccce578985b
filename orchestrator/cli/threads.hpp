#pragma once
/// The same thing done many times, on several threads.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace consort {

/// Calls `each(0)` to `each(count - 1)`, in this order as far as threads have one. What the call with the lowest number threw is thrown
/// when all that had begun have ended; no further one begins.
template <class Each>
void on_threads(std::size_t threads, std::size_t count, const Each& each) {
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  std::exception_ptr failure;
  std::size_t failed = count;
  const auto work = [&] {
    for (std::size_t i = 0; (i = next++) < count;) {
      try {
        each(i);
      } catch (...) {
        const std::lock_guard lock(mutex);
        next = count;
        if (i < failed) failure = std::current_exception();
        failed = std::min(failed, i);
      }
    }
  };
  {
    std::vector<std::jthread> others;
    for (std::size_t t = 1; t < std::min(threads, count); ++t) others.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace consort
