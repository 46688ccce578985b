#pragma once
/// Forking, measuring and ending the processes of a raw program.

#include "tests/bench/lockstep.hpp"

#include <CLI/CLI.hpp>

#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <functional>
#include <new>
#include <string>
#include <system_error>
#include <vector>

namespace consort::bench {

struct Options {
  Shape shape = Shape::ring;
  std::uint32_t agents = 10, agents_per_process = 1;
  double seconds = 2.0, warm_up_seconds = 0.3, give_up_seconds = 120.0;
  double rate = 0.0;  ///< rounds per second, by the clock; 0: in lockstep
  bool multicast = false, tuned = false;

  std::uint32_t rounds() const { return static_cast<std::uint32_t>(seconds * rate + 0.5); }
  std::uint32_t processes() const { return (agents + agents_per_process - 1) / agents_per_process; }
  std::uint32_t first(std::uint32_t process) const { return process * agents_per_process; }
  std::uint32_t count(std::uint32_t process) const { return std::min(agents_per_process, agents - first(process)); }
  std::uint32_t process_of(std::uint32_t agent) const { return agent / agents_per_process; }
};

inline void add_options(CLI::App& app, Options& options) {
  app.add_option("shape", options.shape, "ring or complete")
      ->required()
      ->transform(CLI::CheckedTransformer(std::map<std::string, Shape>{{"ring", Shape::ring}, {"complete", Shape::complete}}));
  app.add_option("agents", options.agents, "how many agents")->required()->check(CLI::Range(2, 100000));
  app.add_option("--agents-per-process", options.agents_per_process, "neighbours in one process are reached by a direct call")
      ->check(CLI::Range(1, 100000));
  app.add_option("--seconds", options.seconds, "length of the measurement");
  app.add_option("--warm-up", options.warm_up_seconds, "seconds of rounds before it");
  app.add_option("--give-up", options.give_up_seconds, "seconds after which a start has failed");
}

/// One process's figures, written by it and read by the parent.
struct alignas(64) Slot {
  std::atomic<std::uint64_t> rounds{0}, delivered{0};
  std::atomic<std::uint32_t> ready{0}, port{0};
  // Rounds by the clock: when round 0 begins (CLOCK_MONOTONIC, s; written by the parent), and in the end how time was kept.
  std::atomic<double> start{0.0}, jitter_p50{0.0}, jitter_p99{0.0}, jitter_max{0.0};
  std::atomic<std::uint64_t> in_time{0}, left_out{0};
};

/// What the processes share. Made before the fork; waiting is done on pipes, so that a parent that dies ends its children.
class Swarm {
 public:
  explicit Swarm(const Options& options) : options_(options) {
    void* memory = mmap(nullptr, sizeof(Slot) * options.processes(), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::system_error(errno, std::generic_category(), "mmap");
    slots_ = static_cast<Slot*>(memory);
    for (std::uint32_t p = 0; p < options.processes(); ++p) new (&slots_[p]) Slot;
    for (auto* pair : {go_, stop_, said_})
      if (pipe(pair) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
  }

  // --- in a child -------------------------------------------------------------------------------------------------------
  Slot& slot(std::uint32_t process) { return slots_[process]; }
  /// Tells the parent; it counts.
  void say_ready(std::uint32_t process) {
    slots_[process].ready = 1;
    if (write(said_[1], "r", 1) != 1) std::_Exit(1);
  }
  /// Tells the parent that the last round by the clock is over.
  void say_over() {
    if (write(said_[1], "o", 1) != 1) std::_Exit(1);
  }
  /// Returns when everybody is ready.
  void wait_go() {
    char byte;
    if (read(go_[0], &byte, 1) < 0) std::_Exit(1);
  }
  int stop_descriptor() const { return stop_[0]; }
  /// Waits up to `milliseconds`; true when the measurement is over.
  bool stopped(int milliseconds) {
    pollfd descriptor{stop_[0], POLLIN, 0};
    return poll(&descriptor, 1, milliseconds) > 0;
  }

  // --- in the parent ----------------------------------------------------------------------------------------------------
  /// Runs `child(process)` in every process, measures, prints one JSON object; the exit code of the program.
  int run(const std::function<void(std::uint32_t)>& child) {
    const double begin = now();
    for (std::uint32_t p = 0; p < options_.processes(); ++p) children_.push_back(spawn(p, child));
    close_ends();
    const bool up = wait_all(options_.give_up_seconds);
    const double startup = now() - begin;
    if (!up) std::fprintf(stderr, "only some of %u processes were ready after %.1f s\n", options_.processes(), startup);
    const bool measured = up && (options_.rate > 0.0 ? measure_paced(startup) : measure(startup));
    end_children();
    return measured ? 0 : 1;
  }

 private:
  struct Reading {
    double time = 0.0, cpu = 0.0;
    std::uint64_t rounds = 0, delivered = 0;
  };

  static double seconds_of(clockid_t clock) {
    timespec time{};
    clock_gettime(clock, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }
  static double now() { return seconds_of(CLOCK_MONOTONIC); }

  pid_t spawn(std::uint32_t process, const std::function<void(std::uint32_t)>& child) {
    const pid_t parent = getpid();
    const pid_t pid = fork();
    if (pid < 0) throw std::system_error(errno, std::generic_category(), "fork");
    if (pid > 0) return pid;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) std::_Exit(1);
    close(go_[1]);
    close(stop_[1]);
    child(process);
    std::_Exit(0);
  }

  void close_ends() {
    close(go_[0]);
    close(stop_[0]);
    close(said_[1]);
  }

  bool measure(double startup) {
    close(go_[1]);
    pause(options_.warm_up_seconds);
    const Reading from = read_slots();
    pause(options_.seconds);
    print(from, read_slots(), startup);
    return true;
  }

  /// Every round is measured, the first included: the clock does not need to warm up.
  bool measure_paced(double startup) {
    constexpr double kUntilStart = 0.1;  // s: time to get everybody to the first instant
    const double start = now() + kUntilStart;
    for (std::uint32_t p = 0; p < options_.processes(); ++p) slots_[p].start = start;
    close(go_[1]);
    const Reading from = read_slots();
    const bool over = wait_all(options_.seconds + options_.give_up_seconds);
    if (over) print_paced(from, read_slots(), startup);
    return over;
  }

  /// Until every child has said something, once.
  bool wait_all(double limit_seconds) {
    const double begin = now();
    std::size_t ready = 0;
    std::vector<char> bytes(children_.size());
    while (ready < children_.size()) {
      const double left = limit_seconds - (now() - begin);
      pollfd descriptor{said_[0], POLLIN, 0};
      if (left <= 0 || poll(&descriptor, 1, static_cast<int>(left * 1e3) + 1) <= 0) return false;
      const ssize_t got = read(said_[0], bytes.data(), bytes.size());
      if (got <= 0) return false;  // every child has ended
      ready += static_cast<std::size_t>(got);
    }
    return true;
  }

  /// Lets time pass; the children measure themselves.
  static void pause(double seconds) { poll(nullptr, 0, static_cast<int>(seconds * 1e3)); }

  Reading read_slots() {
    Reading reading;
    reading.rounds = ~std::uint64_t{0};
    for (std::uint32_t p = 0; p < options_.processes(); ++p) {
      reading.rounds = std::min(reading.rounds, slots_[p].rounds.load(std::memory_order_relaxed));
      reading.delivered += slots_[p].delivered.load(std::memory_order_relaxed);
      clockid_t clock{};
      if (clock_getcpuclockid(children_[p], &clock) == 0) reading.cpu += seconds_of(clock);
    }
    reading.time = now();
    return reading;
  }

  /// Mean proportional set size of the processes, MB.
  double memory() const {
    double kilobytes = 0.0;
    for (const pid_t pid : children_) {
      std::ifstream file("/proc/" + std::to_string(pid) + "/smaps_rollup");
      for (std::string word; file >> word;) {
        double value = 0.0;
        if (word == "Pss:" && file >> value) kilobytes += value;
      }
    }
    return kilobytes / 1024.0 / static_cast<double>(children_.size());
  }

  void print(const Reading& from, const Reading& to, double startup) const {
    const double rounds = static_cast<double>(to.rounds - from.rounds);
    const double messages = static_cast<double>(to.delivered - from.delivered);
    std::printf(
        "{\"rounds_per_second\": %.1f, \"cpu_us_per_message\": %.3f, \"messages\": %.0f, \"startup_seconds\": %.4f, "
        "\"pss_mb_per_process\": %.3f}\n",
        rounds / (to.time - from.time), messages > 0 ? 1e6 * (to.cpu - from.cpu) / messages : 0.0, messages, startup, memory());
  }

  /// Jitter is that of the process where it is largest.
  void print_paced(const Reading& from, const Reading& to, double startup) const {
    std::uint64_t in_time = 0, left_out = 0;
    double p50 = 0.0, p99 = 0.0, largest = 0.0;
    for (std::uint32_t p = 0; p < options_.processes(); ++p) {
      in_time += slots_[p].in_time;
      left_out += slots_[p].left_out;
      p50 = std::max(p50, slots_[p].jitter_p50.load());
      p99 = std::max(p99, slots_[p].jitter_p99.load());
      largest = std::max(largest, slots_[p].jitter_max.load());
    }
    std::printf(
        "{\"rounds\": %u, \"messages_in_time\": %.0f, \"messages\": %.0f, \"rounds_left_out\": %.0f, \"jitter_p50\": %.9f, "
        "\"jitter_p99\": %.9f, \"jitter_max\": %.9f, \"cpu_seconds\": %.4f, \"startup_seconds\": %.4f}\n",
        options_.rounds(), static_cast<double>(in_time), static_cast<double>(to.delivered - from.delivered), static_cast<double>(left_out),
        p50, p99, largest, to.cpu - from.cpu, startup);
  }

  void end_children() {
    close(stop_[1]);
    const double deadline = now() + 10.0;
    for (const pid_t pid : children_) {
      while (waitpid(pid, nullptr, WNOHANG) == 0) {
        if (now() > deadline) {
          kill(pid, SIGKILL);
          waitpid(pid, nullptr, 0);
          break;
        }
        poll(nullptr, 0, 1);
      }
    }
  }

  Options options_;
  Slot* slots_ = nullptr;
  int go_[2]{}, stop_[2]{}, said_[2]{};
  std::vector<pid_t> children_;
};

}  // namespace consort::bench
