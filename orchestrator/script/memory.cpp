#include "orchestrator/script/memory.hpp"

#include "core/errors.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>
#include <mutex>

namespace consort {
namespace {

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

// Of a file that begins with a number; no limit where there is none ("max").
double number_in(const char* file) {
  std::ifstream in(file);
  double number = 0.0;
  return in >> number ? number : kNoLimit;
}

double available_on_host() {
  std::ifstream in("/proc/meminfo");
  for (std::string word; in >> word;) {
    double kilobytes = 0.0;
    if (word == "MemAvailable:" && in >> kilobytes) return kilobytes * 1024.0;
  }
  return kNoLimit;
}

double left_of_address_space() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kNoLimit;
  const double taken = number_in("/proc/self/statm") * static_cast<double>(::sysconf(_SC_PAGESIZE));
  return std::max(0.0, static_cast<double>(limit.rlim_cur) - taken);
}

struct Need {
  double bytes = 0.0;
  std::string what;
};
// Experiments may be read on several threads.
std::mutex g_mutex;
Need g_largest;

Need largest_need() {
  const std::lock_guard lock(g_mutex);
  return g_largest;
}

}  // namespace

double memory_to_be_had() {
  const double group = number_in("/sys/fs/cgroup/memory.max");
  const double of_group = group == kNoLimit ? kNoLimit : std::max(0.0, group - number_in("/sys/fs/cgroup/memory.current"));
  return std::min({available_on_host(), left_of_address_space(), of_group});
}

std::string bytes_text(double bytes) {
  constexpr std::array kUnits{"bytes", "kB", "MB", "GB", "TB", "PB", "EB"};
  std::size_t unit = 0;
  for (; bytes >= 999.5 && unit + 1 < kUnits.size(); ++unit) bytes /= 1000.0;
  return fmt::format("{:.3g} {}", bytes, kUnits[unit]);
}

void require_memory(double bytes, const std::string& what, const std::string& remedy, double to_be_had) {
  {
    const std::lock_guard lock(g_mutex);
    if (bytes > g_largest.bytes) g_largest = {bytes, what};
  }
  if (bytes <= to_be_had) return;
  throw ConfigError(
      fmt::format("{} would take {} of memory, and {} can be had; allowed: {}", what, bytes_text(bytes), bytes_text(to_be_had), remedy));
}

std::string out_of_memory() {
  const Need need = largest_need();
  return fmt::format(
      "out of memory: {} can be had{}; allowed: fewer agents, components, edges or runs, or fewer reports "
      "(`telemetry: {{every: ...}}`)",
      bytes_text(memory_to_be_had()), need.bytes > 0.0 ? fmt::format(", and {} are needed for {}", bytes_text(need.bytes), need.what) : "");
}

}  // namespace consort
