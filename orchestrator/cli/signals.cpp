#include "orchestrator/cli/signals.hpp"

#include <csignal>

namespace consort {
namespace {

std::atomic<int> g_signal{0};
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler may only touch a lock-free atomic");

// The number is all a handler may leave; the drivers look at it. Closing the terminal ends a run like SIGTERM.
extern "C" void keep_signal(int number) { g_signal.store(number == SIGHUP ? SIGTERM : number); }

}  // namespace

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = keep_signal;  // without SA_RESTART: whoever waits in a system call wakes up
  for (const int number : {SIGINT, SIGTERM}) ::sigaction(number, &action, nullptr);
  // Whoever starts a run with nohup wants it to outlive the terminal.
  struct sigaction inherited {};
  if (::sigaction(SIGHUP, nullptr, &inherited) == 0 && inherited.sa_handler != SIG_IGN) ::sigaction(SIGHUP, &action, nullptr);
}

const std::atomic<int>& caught_signal() { return g_signal; }

Exit interrupted_exit(int signal) { return signal == SIGINT ? Exit::interrupted : Exit::terminated; }

}  // namespace consort
