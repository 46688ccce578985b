#pragma once
/// Under which addresses the processes of a run find each other, where they are on several hosts.

#include "orchestrator/run/placement.hpp"
#include "orchestrator/run/run.hpp"

#include <string>

namespace consort {

/// The numeric address (IPv4) that a name or a number leads to. Empty: nobody here knows it.
std::string address_of(const std::string& machine);
/// Of a host of a list. Throws ConfigError where it has to be named.
std::string numeric_address(const Host& host);
/// The address of this host from which packets to a numeric `address` leave. Empty: there is no way to it.
std::string address_towards(const std::string& address);

/// Fills `host_addresses`, and puts a numeric address for the interface: that of the named one, else the one that leads to the first of the
/// other hosts. Only hosts that have processes count; where all processes are here, there are no hosts. Throws ConfigError.
void find_addresses(RunOptions& options, const Placement& placement);

}  // namespace consort
