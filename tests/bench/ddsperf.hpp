#pragma once
/// ddsperf, Cyclone's own program for figures of this kind, at the rate of a ring that a clock paces. Its processes know no ring: all that
/// share a domain exchange with all. So every two of them get a domain of their own, and each of the two publishes at the rate and
/// receives what the other publishes: as many processes as the ring has, each of which writes once a period and hears one neighbour, not
/// two. Best effort, newest only, samples of 72 bytes.

#include "tests/bench/command.hpp"

#include <fmt/format.h>
#include <dds/configuration.hpp>

#include <algorithm>
#include <cmath>
#include <future>
#include <optional>
#include <sstream>

namespace consort::bench {

struct Ddsperf {
  double cpu = 0.0, messages = 0.0;  ///< s, and samples received; starting and ending included
  double latency_p99 = 0.0;          ///< us, half a round trip; of the process where it is largest
};

namespace detail {

/// What one process printed, a block of lines a second: `size 72 total 999 lost 0 ...` of samples since the start, and `... 99% 82.2us max
/// 170.9us cnt 95` of the round trips of that second. The latency is the median of the seconds but the first, in which the two meet.
inline Ddsperf read_ddsperf(const std::string& output) {
  Ddsperf read;
  double received = 0.0;
  std::vector<double> latencies;
  std::istringstream lines(output);
  for (std::string line, word; std::getline(lines, line);) {
    double total = 0.0, answered = 0.0;
    std::istringstream words(line);
    while (words >> word) {
      if (word == "total") words >> total;
      if (word == "cnt") words >> answered;
      if (word == "99%" && words >> word) latencies.push_back(std::strtod(word.c_str(), nullptr));
    }
    received = std::max(received, total);
    read.messages += answered;
  }
  read.messages += received;
  if (latencies.size() > 1) latencies.erase(latencies.begin());
  std::sort(latencies.begin(), latencies.end());
  read.latency_p99 = latencies.empty() ? 0.0 : latencies[latencies.size() / 2];
  return read;
}

inline std::vector<std::string> ddsperf_command(int pair, double rate, int seconds) {
  const std::string configuration = dds::configuration::xml({.tag = fmt::format("consort-bench-{}", getpid())});
  const int answered = static_cast<int>(std::clamp(10'000.0 / rate, 1.0, 100.0));  // %: about a hundred round trips a second
  std::vector<std::string> command{"/usr/bin/env", "CYCLONEDDS_URI=" + configuration};
  std::istringstream words(fmt::format("ddsperf -u -k 1 -i {} -D {} pub {}Hz size 72 {}% sub", 1 + pair, seconds, rate, answered));
  for (std::string word; words >> word;) command.push_back(word);
  return command;
}

}  // namespace detail

/// None where ddsperf is not installed or one of the processes failed.
inline std::optional<Ddsperf> run_ddsperf(int processes, double rate, int seconds) {
  std::vector<std::future<Outcome>> running;
  for (int process = 0; process < processes; ++process)
    running.push_back(std::async(std::launch::async, [command = detail::ddsperf_command(process / 2, rate, seconds), seconds] {
      return run_command(command, seconds + 30.0);
    }));
  Ddsperf all;
  bool complete = true;
  for (auto& each : running) {
    const Outcome outcome = each.get();
    const Ddsperf one = detail::read_ddsperf(outcome.output);
    complete = complete && outcome.exit_code >= 0 && one.messages > 0.0;
    all.cpu += outcome.cpu_seconds;
    all.messages += one.messages;
    all.latency_p99 = std::max(all.latency_p99, one.latency_p99);
  }
  return complete ? std::optional(all) : std::nullopt;
}

}  // namespace consort::bench
