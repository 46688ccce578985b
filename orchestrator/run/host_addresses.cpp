#include "orchestrator/run/host_addresses.hpp"

#include "core/errors.hpp"
#include "io/interfaces.hpp"
#include "orchestrator/run/launch.hpp"
#include "orchestrator/run/spread.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <memory>
#include <sstream>

namespace consort {
namespace {

struct FreeAddresses {
  void operator()(addrinfo* list) const { ::freeaddrinfo(list); }
};
using Addresses = std::unique_ptr<addrinfo, FreeAddresses>;

Addresses looked_up(const std::string& machine, int family, int flags = 0) {
  addrinfo wanted{};
  wanted.ai_family = family;
  wanted.ai_socktype = SOCK_DGRAM;
  wanted.ai_flags = flags;
  addrinfo* found = nullptr;
  return Addresses(::getaddrinfo(machine.c_str(), "9", &wanted, &found) == 0 ? found : nullptr);
}

std::string text_of(const sockaddr* address, socklen_t length) {
  std::array<char, NI_MAXHOST> text{};
  const int failure = ::getnameinfo(address, length, text.data(), text.size(), nullptr, 0, NI_NUMERICHOST);
  return failure == 0 ? std::string(text.data()) : std::string();
}

bool is_numeric(const std::string& address) { return looked_up(address, AF_UNSPEC, AI_NUMERICHOST) != nullptr; }
bool is_ipv6(const std::string& address) { return address.find(':') != std::string::npos; }

// Behind an alias of the user's ssh configuration, which is asked without a connection.
std::string machine_of(const Host& host) {
  if (host.launcher != Launcher::ssh) return host.machine();
  std::istringstream lines(said_by({"ssh", "-G", host.address}));
  for (std::string key, value; lines >> key && std::getline(lines >> std::ws, value);)
    if (key == "hostname") return value;
  return host.machine();
}

}  // namespace

std::string address_of(const std::string& machine) {
  const Addresses found = looked_up(machine, AF_INET);
  return found ? text_of(found->ai_addr, found->ai_addrlen) : std::string();
}

std::string numeric_address(const Host& host) {
  if (is_numeric(host.interface)) return host.interface;
  if (!host.interface.empty() && host.launcher == Launcher::manual)
    throw ConfigError(
        fmt::format("hosts: found interface '{}' of {}, which is started by hand; allowed: the address of that interface, "
                    "which the others need",
                    host.interface, host.name));
  const std::string found = address_of(machine_of(host));
  if (found.empty())
    throw ConfigError(
        fmt::format("hosts: found address '{}' of {}, which is unknown here; allowed: a name or an address that this host "
                    "finds, or its network address as `interface`",
                    host.machine(), host.name));
  return found;
}

std::string address_towards(const std::string& address) {
  const Addresses there = looked_up(address, AF_UNSPEC, AI_NUMERICHOST);
  if (!there) return {};
  const int connection = ::socket(there->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);  // sends nothing
  if (connection < 0) return {};
  sockaddr_storage here{};
  socklen_t length = sizeof here;
  auto* own = reinterpret_cast<sockaddr*>(&here);
  const bool found = ::connect(connection, there->ai_addr, there->ai_addrlen) == 0 && ::getsockname(connection, own, &length) == 0;
  ::close(connection);
  return found ? text_of(own, length) : std::string();
}

void find_addresses(RunOptions& options, const Placement& placement) {
  options.host_addresses.assign(options.hosts.size(), "");
  std::string first;
  for (std::size_t h = 0; h < options.hosts.size(); ++h) {
    const bool used = std::find(placement.host_of.begin(), placement.host_of.end(), h) != placement.host_of.end();
    if (!used || options.hosts[h].launcher == Launcher::local) continue;
    options.host_addresses[h] = numeric_address(options.hosts[h]);
    if (first.empty()) first = options.host_addresses[h];
  }
  if (first.empty()) {
    options.hosts.clear();
    options.host_addresses.clear();
    return;
  }
  if (options.interface == "lo") {
    options.interface = address_towards(first);
    if (options.interface.empty())
      throw ConfigError(
          fmt::format("hosts: found {}, to which no interface of this host leads; allowed: hosts on a network of this host", first));
  } else if (!is_numeric(options.interface)) {
    const auto there = network_interfaces();
    options.interface = find_interface(options.interface, there)->addresses.front();
  }
  for (std::size_t h = 0; h < options.hosts.size(); ++h) {
    std::string& address = options.host_addresses[h];
    if (options.hosts[h].launcher == Launcher::local) address = options.interface;
    if (is_ipv6(address))
      throw ConfigError(fmt::format("hosts: found {} of {}; allowed: addresses of IPv4, which runs use", address, options.hosts[h].name));
  }
}

}  // namespace consort
