#include "io/interfaces.hpp"

#include "core/errors.hpp"
#include "core/nearest.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>

namespace consort {
namespace {

struct FreeInterfaces {
  void operator()(ifaddrs* list) const { ::freeifaddrs(list); }
};

std::string told(const NetworkInterface& interface) {
  return fmt::format("{} ({}{})", interface.name,
                     interface.addresses.empty() ? "no IPv4 address" : fmt::format("{}", fmt::join(interface.addresses, ", ")),
                     interface.up ? "" : ", down");
}

}  // namespace

std::vector<NetworkInterface> network_interfaces() {
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) throw RunError(fmt::format("the network interfaces of this host: {}", std::strerror(errno)));
  const std::unique_ptr<ifaddrs, FreeInterfaces> owner(list);
  std::vector<NetworkInterface> out;
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    auto it = std::find_if(out.begin(), out.end(), [entry](const NetworkInterface& one) { return one.name == entry->ifa_name; });
    if (it == out.end()) it = out.insert(out.end(), NetworkInterface{entry->ifa_name, (entry->ifa_flags & IFF_UP) != 0, {}});
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(entry->ifa_addr)->sin_addr, text.data(), text.size());
    it->addresses.emplace_back(text.data());
  }
  return out;
}

const NetworkInterface* find_interface(const std::string& wanted, const std::vector<NetworkInterface>& there) {
  const auto it = std::find_if(there.begin(), there.end(), [&wanted](const NetworkInterface& one) {
    return one.name == wanted || std::find(one.addresses.begin(), one.addresses.end(), wanted) != one.addresses.end();
  });
  return it == there.end() ? nullptr : &*it;
}

std::string interface_refusal(const std::string& wanted, const std::vector<NetworkInterface>& there) {
  const NetworkInterface* found = find_interface(wanted, there);
  std::vector<std::string> names, all;
  for (const NetworkInterface& one : there) {
    names.push_back(one.name);
    all.push_back(told(one));
  }
  if (found == nullptr) {
    constexpr std::size_t kMistyped = 2;  // letters
    const std::string meant = nearest(wanted, names);
    return fmt::format("found '{}', which this host does not have; allowed: {}{}", wanted, fmt::join(all, ", "),
                       wanted.size() > kMistyped && edit_distance(wanted, meant) <= kMistyped ? "; did you mean '" + meant + "'?" : "");
  }
  if (!found->up || found->addresses.empty())
    return fmt::format("found {}; allowed: one that is up and has an IPv4 address, of {}", told(*found), fmt::join(all, ", "));
  return "";
}

}  // namespace consort
