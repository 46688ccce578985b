#pragma once
/// Runs a program to its end: what it printed, how it ended, the CPU time of it and of everything it waited for.

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <string>
#include <system_error>
#include <vector>

namespace consort::bench {

struct Outcome {
  std::string output;        ///< standard output; standard error goes where ours goes
  int exit_code = -1;        ///< -1: ended by a signal or out of time
  double cpu_seconds = 0.0;  ///< user and system, all processes it waited for included
};

namespace detail {

[[noreturn]] inline void execute(const std::vector<std::string>& command, int output) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  dup2(output, STDOUT_FILENO);
  std::vector<char*> arguments;
  for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  execv(arguments[0], arguments.data());
  std::_Exit(127);
}

/// Reads until the other end closes. `watch(pid)` is called about five times a second. False when time is up.
inline bool collect(int input, pid_t pid, double limit_seconds, const std::function<void(pid_t)>& watch, std::string& output) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(limit_seconds);
  char buffer[4096];
  while (Clock::now() < end) {
    pollfd descriptor{input, POLLIN, 0};
    if (poll(&descriptor, 1, 200) > 0) {
      const ssize_t got = read(input, buffer, sizeof buffer);
      if (got == 0) return true;
      if (got > 0) output.append(buffer, static_cast<std::size_t>(got));
    } else if (watch) {
      watch(pid);
    }
  }
  return false;
}

}  // namespace detail

/// `command[0]` is a path. A program that takes longer than `limit_seconds` is asked to end, then made to.
inline Outcome run_command(const std::vector<std::string>& command, double limit_seconds, const std::function<void(pid_t)>& watch = {}) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
  const pid_t pid = fork();
  if (pid < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (pid == 0) detail::execute(command, ends[1]);
  close(ends[1]);
  Outcome outcome;
  if (!detail::collect(ends[0], pid, limit_seconds, watch, outcome.output)) {
    kill(pid, SIGTERM);
    std::string rest;
    if (!detail::collect(ends[0], pid, 15.0, {}, rest)) kill(pid, SIGKILL);
  }
  close(ends[0]);
  int status = 0;
  rusage usage{};
  wait4(pid, &status, 0, &usage);
  if (WIFEXITED(status)) outcome.exit_code = WEXITSTATUS(status);
  const auto seconds = [](const timeval& time) { return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec); };
  outcome.cpu_seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  return outcome;
}

}  // namespace consort::bench
