#pragma once
/// Is this host fit for runs of up to a thousand agent processes? Each check says what it found and the exact command that mends it.

#include "orchestrator/terminal.hpp"

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace consort {

struct DoctorCheck {
  std::string name;
  bool well = true;
  std::string found;
  std::string remedy;  ///< a command for the shell; empty if all is well
};

/// The limits of this host and of this process.
struct HostLimits {
  std::uint64_t open_files = 0, open_files_hard = 0;  ///< RLIMIT_NOFILE
  std::uint64_t tasks = 0, tasks_hard = 0;            ///< RLIMIT_NPROC: threads of this user
  bool privileged = false;                            ///< RLIMIT_NPROC does not bind the superuser
  std::uint64_t threads_max = 0, pid_max = 0;         ///< kernel.threads-max, kernel.pid_max
  std::uint64_t tasks_running = 0;                    ///< threads on this host now
  std::optional<std::uint64_t> group_tasks;           ///< pids.max of the control group, if it has one
  std::string group_file;                             ///< where that limit is set
  std::uint64_t first_port = 0, last_port = 0;        ///< net.ipv4.ip_local_port_range
  std::uint64_t receive_buffer = 0;                   ///< bytes the kernel grants when kReceiveBuffer is asked for
};
HostLimits read_limits();
std::vector<DoctorCheck> judge(const HostLimits& limits);  ///< pure

DoctorCheck check_loopback_multicast();  ///< sends a datagram to 239.255.0.1 over lo and waits for it

struct Leftover {
  pid_t pid = 0;
  std::string name;
};
/// Agents and plants whose orchestrator is gone, ascending by pid.
std::vector<Leftover> leftover_processes();

std::vector<DoctorCheck> examine_host();  ///< all of the above
std::string render(const std::vector<DoctorCheck>& checks, const TextStyle& style);

}  // namespace consort
