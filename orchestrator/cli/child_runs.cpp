#include "orchestrator/cli/child_runs.hpp"

#include "core/errors.hpp"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <map>
#include <utility>

namespace consort {
namespace {

using Clock = std::chrono::steady_clock;

// What a process writes, kept in memory.
class Paper {
 public:
  Paper() : file_(::memfd_create("consort-said", MFD_CLOEXEC)) {
    if (file_ < 0) throw RunError(fmt::format("no memory for the words of a process: {}", std::strerror(errno)));
  }
  ~Paper() {
    if (file_ >= 0) ::close(file_);
  }
  Paper(Paper&& other) noexcept : file_(std::exchange(other.file_, -1)) {}
  Paper& operator=(Paper&&) = delete;
  [[nodiscard]] int file() const { return file_; }
  [[nodiscard]] std::string text() const {
    std::string text;
    char buffer[1 << 16];
    for (ssize_t got = 0; (got = ::pread(file_, buffer, sizeof buffer, static_cast<off_t>(text.size()))) > 0;)
      text.append(buffer, static_cast<std::size_t>(got));
    return text;
  }

 private:
  int file_;
};

struct Running {
  std::size_t number = 0;
  Paper out, err;
  Clock::time_point begin = Clock::now();
};

// The signals that are waited for instead of interrupting; as they were before, once this is gone.
class Blocked {
 public:
  Blocked() {
    ::signal(SIGCHLD, SIG_DFL);  // whoever started this may have ignored it, and then nobody would be told
    sigemptyset(&signals_);
    for (const int number : {SIGCHLD, SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals_, number);
    ::pthread_sigmask(SIG_BLOCK, &signals_, &before_);
  }
  ~Blocked() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  Blocked(const Blocked&) = delete;
  Blocked& operator=(const Blocked&) = delete;
  [[nodiscard]] int wait() const {
    int number = 0;
    sigwait(&signals_, &number);
    return number;
  }
  [[nodiscard]] const sigset_t& before() const { return before_; }

 private:
  sigset_t signals_{}, before_{};
};

pid_t start(const std::vector<std::string>& arguments, const Running& child, bool keep_err, const sigset_t& signals) {
  std::vector<std::string> words{"consort"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  const pid_t parent = ::getpid(), pid = ::fork();
  if (pid < 0) throw RunError(fmt::format("no process could be started: {}", std::strerror(errno)));
  if (pid > 0) return pid;
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != parent) ::_exit(127);
  ::dup2(child.out.file(), STDOUT_FILENO);
  if (keep_err) ::dup2(child.err.file(), STDERR_FILENO);
  ::pthread_sigmask(SIG_SETMASK, &signals, nullptr);
  ::execv("/proc/self/exe", pointers.data());
  ::_exit(127);
}

}  // namespace

int run_children(std::span<const std::vector<std::string>> commands, const ChildOptions& options,
                 const std::function<void(std::size_t, const ChildAnswer&)>& ended) {
  const Blocked blocked;
  std::map<pid_t, Running> running;
  std::size_t next = 0;
  int caught = 0;
  const auto more = [&] { return caught == 0 && next < commands.size() && (!options.go_on || options.go_on()); };
  while (!running.empty() || more()) {
    while (more() && running.size() < options.jobs) {
      Running child{next, {}, {}};
      const pid_t pid = start(commands[next++], child, options.keep_err, blocked.before());
      running.emplace(pid, std::move(child));
    }
    if (const int signal = blocked.wait(); signal != SIGCHLD) {
      caught = signal;
      for (const auto& [pid, child] : running) ::kill(pid, signal);
      continue;
    }
    int status = 0;
    for (pid_t pid = 0; (pid = ::waitpid(-1, &status, WNOHANG)) > 0;) {  // several may have ended by one signal
      const auto found = running.find(pid);
      if (found == running.end()) continue;
      const Running child = std::move(found->second);
      running.erase(found);
      ended(child.number, {WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status), child.out.text(), child.err.text(),
                           std::chrono::duration<double>(Clock::now() - child.begin).count()});
    }
  }
  return caught;
}

}  // namespace consort
