#pragma once
/// The network interfaces of this host.

#include <string>
#include <vector>

namespace consort {

struct NetworkInterface {
  std::string name;
  bool up = false;
  std::vector<std::string> addresses;  ///< IPv4
};
std::vector<NetworkInterface> network_interfaces();

/// The one that is called `wanted`, by name or IPv4 address; nullptr if there is none.
const NetworkInterface* find_interface(const std::string& wanted, const std::vector<NetworkInterface>& there);

/// Why no run can use `wanted` (a name or an IPv4 address), with the interfaces there are; empty if one can.
std::string interface_refusal(const std::string& wanted, const std::vector<NetworkInterface>& there = network_interfaces());

}  // namespace consort
