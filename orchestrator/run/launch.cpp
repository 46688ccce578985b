#include "orchestrator/run/launch.hpp"

#include "core/errors.hpp"
#include "core/random.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <spawn.h>
#include <sys/file.h>
#include <sys/personality.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstring>
#include <deque>
#include <fstream>
#include <utility>

namespace consort {
namespace {

constexpr std::size_t kTailLines = 12;
constexpr double kGraceSeconds = 1.0;

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

std::string Death::text() const {
  std::string out = name + " (pid " + std::to_string(pid) + ") ";
  out += signal ? "was killed by signal " + std::to_string(signal) + " (SIG" + signal_name(signal) + ")"
                : "exited with code " + std::to_string(exit_code);
  return out + (log_tail.empty() ? "; its log is empty" : "; the last lines of its log:\n" + log_tail);
}

namespace {

// This process's environment with some variables changed, each "NAME=value".
std::vector<std::string> environment_with(const std::map<std::string, std::string>& changes) {
  std::vector<std::string> result;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text(*entry);
    if (!changes.contains(std::string(text.substr(0, text.find('='))))) result.emplace_back(text);
  }
  for (const auto& [name, value] : changes) result.push_back(name + "=" + value);
  return result;
}

}  // namespace

pid_t Children::start(const std::string& name, const std::filesystem::path& executable, const std::vector<std::string>& arguments,
                      const std::map<std::string, std::string>& environment) {
  const std::string program = executable.string(), log = (log_directory_ / (name + ".log")).string();
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  std::vector<std::string> variables = environment_with(environment);
  std::vector<char*> envp;
  for (std::string& variable : variables) envp.push_back(variable.data());
  envp.push_back(nullptr);
  if (access(program.c_str(), X_OK) != 0) throw RunError("cannot start " + program + ": " + std::strerror(errno));
  // posix_spawn does not copy this process's page tables, which a fork for each of a thousand children would.
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
  posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  if (alive_ == 0) group_ = 0;
  posix_spawnattr_setpgroup(&attributes, group_);
  const SameAddresses same_addresses;
  pid_t pid = 0;
  const int failure = posix_spawn(&pid, program.c_str(), &files, &attributes, argv.data(), envp.data());
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (failure != 0) throw RunError("cannot start " + name + ": " + std::strerror(failure) + "; `consort doctor` checks the limits");
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

// --- ports ------------------------------------------------------------------------------------------------------------

namespace {

constexpr std::uint16_t kFirstPort = 10'240;  // below are well-known services, from 32768 on the kernel's own ephemeral ports
constexpr std::size_t kUnit = 256;            // ports one lock file stands for
constexpr std::size_t kUnits = (32'768 - kFirstPort) / kUnit;
constexpr const char* kLockDirectory = "/tmp/consort-ports";

void make_lock_directory() {
  mkdir(kLockDirectory, 0777);
  chmod(kLockDirectory, 01777);
}

bool port_is_free(std::uint16_t port) {
  const int socket_fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket_fd < 0) return false;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_ANY);
  const bool is_free = bind(socket_fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  close(socket_fd);
  return is_free;
}

}  // namespace

bool PortBlock::reserve(std::size_t unit, std::size_t units, std::size_t ports) {
  for (std::size_t u = unit; u < unit + units; ++u) {
    const std::string file = std::string(kLockDirectory) + "/" + std::to_string(kFirstPort + u * kUnit);
    const int lock = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (lock < 0) return false;
    locks_.push_back(lock);
    if (flock(lock, LOCK_EX | LOCK_NB) != 0) return false;
  }
  first_ = static_cast<std::uint16_t>(kFirstPort + unit * kUnit);
  for (std::size_t p = 0; p < ports; ++p) {
    if (!port_is_free(static_cast<std::uint16_t>(first_ + p))) return false;
  }
  return true;
}

void PortBlock::release() {
  for (const int lock : locks_) close(lock);  // closing gives the lock back; the file stays, an unlink would race with another's open
  locks_.clear();
}

PortBlock::PortBlock(std::size_t ports) {
  make_lock_directory();
  const std::size_t units = (ports + kUnit - 1) / kUnit;
  for (std::size_t unit = 0; unit + units <= kUnits; ++unit) {
    if (reserve(unit, units, ports)) return;
    release();
  }
  throw RunError("no block of " + std::to_string(ports) + " free UDP ports between " + std::to_string(kFirstPort) +
                 " and 32767; other runs may hold them (lock files in " + kLockDirectory + "), or set `discovery: multicast`");
}

PortBlock::~PortBlock() { release(); }

void DomainShare::enter(unsigned domain) {
  make_lock_directory();
  const std::string file = std::string(kLockDirectory) + "/domain-" + std::to_string(domain);
  lock_ = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock_ < 0) lock_ = open(file.c_str(), O_RDONLY | O_CLOEXEC);  // another user's
  if (lock_ >= 0) flock(lock_, LOCK_SH | LOCK_NB);
}

bool DomainShare::with_others() const {
  if (lock_ < 0) return false;
  const bool alone = flock(lock_, LOCK_EX | LOCK_NB) == 0;
  flock(lock_, LOCK_SH | LOCK_NB);
  return !alone;
}

DomainShare::~DomainShare() {
  if (lock_ >= 0) close(lock_);
}

// A socket in the abstract name space: the kernel forgets it with the process, and it reaches as far as the loopback interface does.
SoleRun::SoleRun(const std::string& name, const std::string& key, unsigned domain) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string path = "consort-run-" + std::to_string(Purpose(std::to_string(domain) + " " + name + " " + key).hash);
  path.copy(address.sun_path + 1, sizeof address.sun_path - 1);
  const auto* where = reinterpret_cast<const sockaddr*>(&address);
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + path.size());
  socket_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket_ < 0) return;
  if (bind(socket_, where, length) == 0) {
    listen(socket_, 1);
    return;
  }
  const bool taken = errno == EADDRINUSE;
  ucred other{};
  socklen_t size = sizeof other;
  const bool known = taken && connect(socket_, where, length) == 0 && getsockopt(socket_, SOL_SOCKET, SO_PEERCRED, &other, &size) == 0;
  close(std::exchange(socket_, -1));
  if (taken)
    throw ConfigError("--name: found " + name + ", as which a run with the same key goes on in DDS domain " + std::to_string(domain) +
                      " on this host" + (known ? ", pid " + std::to_string(other.pid) : std::string()) +
                      "; allowed: another --name, or to wait for its end");
}

SoleRun::~SoleRun() {
  if (socket_ >= 0) close(socket_);
}

}  // namespace consort
