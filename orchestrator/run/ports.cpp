#include "orchestrator/run/ports.hpp"

#include "core/errors.hpp"
#include "core/random.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <utility>

namespace consort {
namespace {

constexpr std::uint16_t kFirstPort = 10'240;  // below are well-known services, from 32768 on the kernel's own ephemeral ports
constexpr std::size_t kUnit = 256;            // ports one lock file stands for
constexpr std::size_t kUnits = (32'768 - kFirstPort) / kUnit;
constexpr const char* kLockDirectory = "/tmp/consort-ports";

void make_lock_directory() {
  mkdir(kLockDirectory, 0777);
  chmod(kLockDirectory, 01777);
}

}  // namespace

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

PortBlock::PortBlock(std::size_t ports, std::uint16_t first) : first_(first) {
  for (std::size_t port = first; port < first + ports; ++port)
    if (port > 65'535 || !port_is_free(static_cast<std::uint16_t>(port)))
      throw ConfigError("--ports: found " + std::to_string(first) + ", from which on " + std::to_string(ports) + " UDP ports are needed; " +
                        (port > 65'535 ? "there are 65535" : std::to_string(port) + " is taken on this host") + "; allowed: another");
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
