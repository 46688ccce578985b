#pragma once
/// What starts the processes of a run on each host, as a person would enter it. Pure.

#include "orchestrator/run/wiring.hpp"

#include <string>
#include <vector>

namespace consort {

/// As one word of a shell's line.
std::string shell_word(const std::string& text);
std::string shell_line(const std::vector<std::string>& words);

/// Opens the one connection to a host that ssh or Slurm leads to.
std::vector<std::string> connection_to(const Host& host);
/// The line that starts a process by hand, key and all; `key` as the shell is to read it.
std::string line_by_hand(const RunOptions& options, const Placement& placement, const Wiring& wiring, std::size_t process,
                         const std::string& key);
/// Every command of every host, a line each, under the host's name; `wiring` has its ports.
std::string all_commands(const RunOptions& options, const Placement& placement, const Wiring& wiring);

}  // namespace consort
