#include "orchestrator/run/launch.hpp"

#include "core/errors.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/personality.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <deque>
#include <fstream>
#include <utility>

namespace consort {
namespace {

constexpr std::size_t kTailLines = 12;
constexpr double kGraceSeconds = 1.0;

const char* signal_name(int signal) {
  const char* name = sigabbrev_np(signal);
  return name ? name : "?";
}

// While it lives, this thread starts children without address space randomisation. Processes that all run the same code then also share
// the branch predictor's and the instruction cache's memory of it from one to the next, which nearly doubles the rounds per second of
// fifty agents on two cores. Where the system forbids it, children start as usual.
class SameAddresses {
 public:
  SameAddresses() { personality(static_cast<unsigned long>(before_) | ADDR_NO_RANDOMIZE); }
  ~SameAddresses() { personality(static_cast<unsigned long>(before_)); }
  SameAddresses(const SameAddresses&) = delete;
  SameAddresses& operator=(const SameAddresses&) = delete;

 private:
  int before_ = personality(0xffffffff);  // asks only
};

void pause_ms(int milliseconds) { poll(nullptr, 0, milliseconds); }

}  // namespace

std::string tail_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::deque<std::string> lines;
  for (std::string line; std::getline(in, line);) {
    lines.push_back(line);
    if (lines.size() > kTailLines) lines.pop_front();
  }
  std::string tail;
  for (const std::string& line : lines) tail += "    " + line + "\n";
  return tail;
}

std::string Death::text() const {
  std::string out = name + (pid == 0 ? "" : " (pid " + std::to_string(pid) + (host.empty() ? "" : " on " + host) + ")") + " ";
  if (!how.empty()) return out + (how.starts_with("could not") ? how : "is out of reach: " + how);
  out += signal ? "was killed by signal " + std::to_string(signal) + " (SIG" + signal_name(signal) + ")"
                : "exited with code " + std::to_string(exit_code);
  return out + (log_tail.empty() ? "; its log is empty" : "; the last lines of its log:\n" + log_tail);
}

namespace {

// This process's environment with some variables changed, or without those that are to be empty, each "NAME=value".
std::vector<std::string> environment_with(const std::map<std::string, std::string>& changes) {
  std::vector<std::string> result;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text(*entry);
    if (!changes.contains(std::string(text.substr(0, text.find('='))))) result.emplace_back(text);
  }
  for (const auto& [name, value] : changes)
    if (!value.empty()) result.push_back(name + "=" + value);
  return result;
}

}  // namespace

pid_t spawn(const std::vector<std::string>& command, const std::map<std::string, std::string>& environment, const ChildFiles& files,
            pid_t group) {
  std::vector<char*> argv;
  for (const std::string& word : command) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  std::vector<std::string> variables = environment_with(environment);
  std::vector<char*> envp;
  for (std::string& variable : variables) envp.push_back(variable.data());
  envp.push_back(nullptr);
  // posix_spawn does not copy this process's page tables, which a fork for each of a thousand children would.
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (files.in >= 0)
    posix_spawn_file_actions_adddup2(&actions, files.in, STDIN_FILENO);
  else
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  if (files.out >= 0) posix_spawn_file_actions_adddup2(&actions, files.out, STDOUT_FILENO);
  if (!files.error.empty())
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, files.error.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
  if (files.out < 0) posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
  if (files.error.empty()) posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setpgroup(&attributes, group);
  pid_t pid = 0;
  const int failure = posix_spawnp(&pid, argv.front(), &actions, &attributes, argv.data(), envp.data());
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (failure != 0)
    throw RunError("cannot start " + command.front() + ": " + std::strerror(failure) + "; `consort doctor` checks the limits");
  return pid;
}

std::string said_by(const std::vector<std::string>& command) {
  std::array<int, 2> ends{};
  std::string text;
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return text;
  try {
    const pid_t pid = spawn(command, {}, {-1, ends[1], "/dev/null"}, 0);
    ::close(std::exchange(ends[1], -1));
    std::array<char, 4096> bytes{};
    for (ssize_t got = 0; (got = ::read(ends[0], bytes.data(), bytes.size())) > 0;)
      text.append(bytes.data(), static_cast<std::size_t>(got));
    ::waitpid(pid, nullptr, 0);
  } catch (const RunError&) {
  }
  for (const int end : ends)
    if (end >= 0) ::close(end);
  return text;
}

pid_t Children::start(const std::string& name, const std::filesystem::path& executable, const std::vector<std::string>& arguments,
                      const std::map<std::string, std::string>& environment, ChildFiles files) {
  std::vector<std::string> command{executable.string()};
  command.insert(command.end(), arguments.begin(), arguments.end());
  if (access(command.front().c_str(), X_OK) != 0) throw RunError("cannot start " + command.front() + ": " + std::strerror(errno));
  if (files.out < 0) files.error = (log_directory_ / (name + ".log")).string();
  if (alive_ == 0) group_ = 0;
  const SameAddresses same_addresses;
  const pid_t pid = spawn(command, environment, files, group_);
  if (group_ == 0) group_ = pid;
  children_.push_back({name, pid});
  ++alive_;
  return pid;
}

void Children::signal(const std::string& name, int signal) {
  const auto child = std::find_if(children_.rbegin(), children_.rend(), [&](const Child& c) { return c.name == name && !c.ended; });
  if (child != children_.rend()) kill(child->pid, signal);
}

std::optional<Death> Children::next_death() {
  if (alive_ == 0) return std::nullopt;
  int status = 0;
  const pid_t pid = waitpid(-group_, &status, WNOHANG);
  if (pid <= 0) return std::nullopt;
  const auto child = std::find_if(children_.begin(), children_.end(), [&](const Child& c) { return c.pid == pid; });
  if (child == children_.end()) return std::nullopt;
  child->ended = true;
  --alive_;
  return Death{.name = child->name,
               .pid = pid,
               .signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0,
               .exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 0,
               .log_tail = tail_of(log_directory_ / (child->name + ".log"))};
}

bool Children::wait_all(double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (alive_ > 0 && std::chrono::steady_clock::now() < end) {
    if (!next_death()) pause_ms(2);
  }
  return alive_ == 0;
}

void Children::signal_all(int signal) const {
  for (const Child& child : children_) {
    if (!child.ended) kill(child.pid, signal);
  }
}

void Children::wake_all() const { signal_all(SIGCONT); }

Children::~Children() {
  if (alive_ == 0) return;
  signal_all(SIGTERM);
  signal_all(SIGCONT);  // who is stopped cannot end
  if (wait_all(kGraceSeconds)) return;
  signal_all(SIGKILL);
  for (Child& child : children_) {
    if (!child.ended) waitpid(child.pid, nullptr, 0);
  }
}

}  // namespace consort
