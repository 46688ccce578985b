#pragma once
/// Is this host fit for runs of up to a thousand agent processes? Each check says what it found and the exact command that mends it.

#include "io/interfaces.hpp"
#include "orchestrator/report/terminal.hpp"
#include "orchestrator/script/hosts.hpp"

#include <sys/types.h>
#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
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

/// What this host has of `interface` (a name or an address), and its `lo`; pure.
std::vector<DoctorCheck> judge(const std::string& interface, const std::vector<NetworkInterface>& there);
/// What `uri` (as CYCLONEDDS_URI has it) keeps a run from; pure, but for the files it names.
DoctorCheck judge_configuration(const std::string& uri, const std::vector<NetworkInterface>& there);
/// Opens a domain as a run does; what fails because of CYCLONEDDS_URI has its name.
DoctorCheck check_dds(const std::string& interface);
DoctorCheck check_multicast(const std::string& interface_name = "lo");  ///< sends a datagram to 239.255.0.1 and waits for it

struct Leftover {
  pid_t pid = 0;
  std::string name;
};
/// Agents and plants whose orchestrator is gone, ascending by pid.
std::vector<Leftover> leftover_processes();

std::vector<DoctorCheck> examine_host(const std::string& interface = "lo");  ///< all of the above, for runs over `interface`
/// By host of a list: whether there is a connection, whether its build and its clock are those of this host, and what it finds itself.
std::vector<std::pair<std::string, std::vector<DoctorCheck>>> examine_over_connections(const std::vector<Host>& hosts);
nlohmann::ordered_json to_json(const std::vector<DoctorCheck>& checks);
std::string render(const std::vector<DoctorCheck>& checks, const TextStyle& style);

}  // namespace consort
