#pragma once
/// The user's own DDS configuration (CYCLONEDDS_URI), which wins over that of a run: what in it keeps a run from working.

#include "io/interfaces.hpp"

#include <string>
#include <vector>

namespace consort {

/// Of `uri`, as CYCLONEDDS_URI has it (XML, or names of files, separated by commas), or of the environment's. Nothing: no objection.
struct ConfigurationFaults {
  std::vector<std::string> refusals;  ///< no process could start with it: a file that cannot be read, an interface that is not there
  bool no_multicast = false;          ///< processes that find each other by multicast never will
};
ConfigurationFaults configuration_faults(const std::string& uri, const std::vector<NetworkInterface>& there = network_interfaces());
/// Opens a domain as a run over `interface` does. Throws ConfigError that begins "CYCLONEDDS_URI: " if the user's configuration keeps it
/// from that, else RunError.
void try_domain(const std::string& interface);
std::string configuration_of_environment();  ///< CYCLONEDDS_URI; empty if it is not set

}  // namespace consort
