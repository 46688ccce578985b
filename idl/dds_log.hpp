#pragma once
/// What DDS reports, in words for a person: once per kind, never a line per packet. Packets that are none of DDS's are counted.

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace consort::wire {

class DdsLog {
 public:
  using Write = std::function<void(const std::string& line)>;
  /// Lines are handed to `write` as they arise, on any thread; nobody, to begin with.
  explicit DdsLog(Write write = {}) : write_(std::move(write)) {}

  /// That of this process; DDS reports to it from the first call on, which should come before the first domain.
  static DdsLog& of_this_process();
  void write_to(Write write);

  /// DDS has said this.
  void hear(bool severe, std::string_view text);
  /// Packets and samples that could not be read, since the last call.
  std::uint64_t take_malformed();
  /// What DDS has said of anything else, each kind once, since the last call: the reasons of a failure that has just been met.
  std::vector<std::string> take_reasons();

 private:
  void write(const std::string& line);

  std::mutex mutex_;
  Write write_;
  std::map<std::string, std::uint64_t> kinds_;  // by text without its numbers; few: at most kMostKinds
  std::vector<std::string> reasons_;
  std::uint64_t malformed_ = 0;
  bool malformed_told_ = false;
};

}  // namespace consort::wire
