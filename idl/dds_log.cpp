#include "idl/dds_log.hpp"

#include <dds/dds.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

namespace consort::wire {
namespace {

constexpr std::size_t kMostKinds = 50;

bool is_malformed(std::string_view text) {
  constexpr std::array<std::string_view, 5> kSigns{"malformed packet", "deserialization", "no/invalid payload", "missing payload",
                                                   "without proper payload"};
  return std::any_of(kSigns.begin(), kSigns.end(), [&](std::string_view sign) { return text.find(sign) != std::string_view::npos; });
}

// Two texts that differ in addresses, counts or bytes alone are of one kind.
std::string kind_of(std::string_view text) {
  std::string kind;
  for (const char c : text)
    if (!std::isxdigit(static_cast<unsigned char>(c))) kind += c;
  return kind;
}

}  // namespace

DdsLog& DdsLog::of_this_process() {
  static DdsLog log;
  static const dds::log::Sink sink = [](bool severe, std::string_view text) { log.hear(severe, text); };
  static const bool installed = (dds::log::set_sink(sink), true);
  static_cast<void>(installed);
  return log;
}

void DdsLog::write_to(Write write) {
  const std::lock_guard lock(mutex_);
  write_ = std::move(write);
}

void DdsLog::write(const std::string& line) {
  if (write_) write_(line);
}

void DdsLog::hear(bool severe, std::string_view text) {
  const std::lock_guard lock(mutex_);
  if (is_malformed(text)) {
    ++malformed_;
    if (!std::exchange(malformed_told_, true))
      write(
          "packets arrive that DDS cannot read: another program uses these ports, or somebody forges them; they are left out and counted");
    return;
  }
  if (kinds_.size() >= kMostKinds || kinds_[kind_of(text)]++ > 0) return;
  reasons_.emplace_back(text);
  write(std::string("DDS: ") + (severe ? "" : "warning: ") + std::string(text));
}

std::uint64_t DdsLog::take_malformed() {
  const std::lock_guard lock(mutex_);
  return std::exchange(malformed_, 0);
}

std::vector<std::string> DdsLog::take_reasons() {
  const std::lock_guard lock(mutex_);
  kinds_.clear();
  return std::exchange(reasons_, {});
}

}  // namespace consort::wire
