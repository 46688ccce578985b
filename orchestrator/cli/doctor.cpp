#include "orchestrator/cli/doctor.hpp"

#include "core/counted.hpp"
#include "core/errors.hpp"
#include "orchestrator/run/dds_configuration.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

namespace consort {
namespace {

constexpr std::uint64_t kProcesses = 1000;
constexpr std::uint64_t kThreadsPerProcess = 9;  // a participant has 8 with multicast, one more sends the reports
constexpr std::uint64_t kThreads = kProcesses * kThreadsPerProcess;
constexpr std::uint64_t kPortsPerProcess = 3;       // sockets of a participant with a port of their own choosing
constexpr std::uint64_t kOpenFiles = 4096;          // the orchestrator of a thousand children, with room
constexpr std::uint64_t kReceiveBuffer = 4u << 20;  // what Consort asks of Cyclone DDS for each socket
constexpr std::uint64_t kFirstOwnPort = 10'240;     // unicast discovery takes its ports between here and the kernel's range
constexpr auto kMulticastGroup = "239.255.0.1";     // where DDS participants announce themselves
constexpr int kPatienceMilliseconds = 2000;

std::uint64_t number_in(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::uint64_t number = 0;
  in >> number;
  return number;
}

std::string first_line(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

// A datagram socket that closes itself.
class Socket {
 public:
  Socket() : descriptor_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~Socket() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  [[nodiscard]] int get() const { return descriptor_; }

 private:
  int descriptor_;
};

std::uint64_t granted_receive_buffer() {
  const Socket socket;
  const int wanted = static_cast<int>(kReceiveBuffer);
  int granted = 0;
  socklen_t size = sizeof granted;
  ::setsockopt(socket.get(), SOL_SOCKET, SO_RCVBUF, &wanted, sizeof wanted);
  ::getsockopt(socket.get(), SOL_SOCKET, SO_RCVBUF, &granted, &size);
  return static_cast<std::uint64_t>(granted) / 2;  // the kernel reports twice what it grants, for its own book-keeping
}

// The tightest pids.max between this process's control group and the root, if any is set (version 2, or the pids controller of version 1).
void read_group_limit(HostLimits& limits) {
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    if (!controllers.empty() && controllers != "pids") continue;
    const std::filesystem::path root = controllers.empty() ? "/sys/fs/cgroup" : "/sys/fs/cgroup/pids";
    for (std::filesystem::path group = line.substr(second + 1);; group = group.parent_path()) {
      const auto file = root / group.relative_path() / "pids.max";
      const std::string text = first_line(file);
      if (!text.empty() && text != "max") {
        const std::uint64_t value = number_in(file);
        if (!limits.group_tasks || value < *limits.group_tasks) {
          limits.group_tasks = value;
          limits.group_file = file.string();
        }
      }
      if (group == group.root_path() || group.empty()) break;
    }
  }
}

// The command that raises a limit of this shell: alone if the hard limit allows it, else with the superuser's help.
std::string raise_limit(const char* flag, const char* name, std::uint64_t wanted, std::uint64_t hard) {
  if (hard >= wanted) return fmt::format("ulimit {} {}", flag, wanted);
  return fmt::format("sudo prlimit --pid $$ --{}={}:{}", name, wanted, wanted);
}

std::string amount(std::uint64_t number) { return number >= (std::uint64_t{1} << 62) ? "unlimited" : grouped(number); }

std::optional<std::string> parent_of(const std::filesystem::path& process) {
  // pid (comm) state ppid ...; comm may hold anything, so what counts begins after the last bracket.
  const std::string status = first_line(process / "stat");
  const std::size_t bracket = status.rfind(')');
  if (bracket == std::string::npos || bracket + 4 >= status.size() || status[bracket + 2] == 'Z')
    return {};  // Z: dead, only not yet noticed
  const std::size_t begin = bracket + 4;
  return status.substr(begin, status.find(' ', begin) - begin);
}

DoctorCheck check_leftovers() {
  DoctorCheck check{"leftover runs", true, "no agent or plant without its orchestrator", ""};
  const auto leftovers = leftover_processes();
  if (leftovers.empty()) return check;
  check.well = false;
  check.found = fmt::format("{} without orchestrator:", counted(leftovers.size(), "process"));
  check.remedy = "kill";
  for (const auto& leftover : leftovers) {
    check.found += fmt::format(" {} {}", leftover.name, leftover.pid);
    check.remedy += fmt::format(" {}", leftover.pid);
  }
  return check;
}

}  // namespace

HostLimits read_limits() {
  HostLimits limits;
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) == 0)
    std::tie(limits.open_files, limits.open_files_hard) = std::pair(limit.rlim_cur, limit.rlim_max);
  if (::getrlimit(RLIMIT_NPROC, &limit) == 0) std::tie(limits.tasks, limits.tasks_hard) = std::pair(limit.rlim_cur, limit.rlim_max);
  limits.privileged = ::geteuid() == 0;
  limits.threads_max = number_in("/proc/sys/kernel/threads-max");
  limits.pid_max = number_in("/proc/sys/kernel/pid_max");
  const std::string load = first_line("/proc/loadavg");  // 0.00 0.01 0.05 1/123 4567: the fourth is running/all threads
  const std::size_t slash = load.find('/');
  if (slash != std::string::npos) limits.tasks_running = std::strtoull(load.c_str() + slash + 1, nullptr, 10);
  read_group_limit(limits);
  std::ifstream ports("/proc/sys/net/ipv4/ip_local_port_range");
  ports >> limits.first_port >> limits.last_port;
  limits.receive_buffer = granted_receive_buffer();
  return limits;
}

std::vector<DoctorCheck> judge(const HostLimits& limits) {
  std::vector<DoctorCheck> checks;
  const auto add = [&checks](std::string name, bool well, std::string found, std::string remedy) {
    checks.push_back({std::move(name), well, std::move(found), well ? std::string() : std::move(remedy)});
  };
  add("receive buffer", limits.receive_buffer >= kReceiveBuffer,
      fmt::format("{} of {} bytes that Consort asks of Cyclone DDS", grouped(limits.receive_buffer), grouped(kReceiveBuffer)),
      fmt::format("sudo sysctl -w net.core.rmem_max={}", kReceiveBuffer));
  const std::uint64_t tasks = limits.tasks_running + kThreads;
  add("threads per user", limits.privileged || limits.tasks >= tasks,
      fmt::format("{} allowed{}; {} agents need {}", amount(limits.tasks), limits.privileged ? " (does not bind the superuser)" : "",
                  grouped(kProcesses), grouped(kThreads)),
      raise_limit("-u", "nproc", tasks, limits.tasks_hard));
  add("threads of the host", limits.threads_max >= tasks,
      fmt::format("{} allowed, {} running; {} agents need {}", grouped(limits.threads_max), grouped(limits.tasks_running),
                  grouped(kProcesses), grouped(kThreads)),
      fmt::format("sudo sysctl -w kernel.threads-max={}", 2 * tasks));
  add("process numbers", limits.pid_max >= tasks, fmt::format("{} allowed; every thread takes one", grouped(limits.pid_max)),
      fmt::format("sudo sysctl -w kernel.pid_max={}", 4 * tasks));
  if (limits.group_tasks)
    add("control group", *limits.group_tasks >= kThreads,
        fmt::format("{} {} allowed by {}", grouped(*limits.group_tasks), noun(*limits.group_tasks, "thread"), limits.group_file),
        fmt::format("echo max | sudo tee {}", limits.group_file));
  else
    add("control group", true, "no limit on processes or threads", "");
  add("open files", limits.open_files >= kOpenFiles, fmt::format("{} allowed; {} wanted", amount(limits.open_files), grouped(kOpenFiles)),
      raise_limit("-n", "nofile", kOpenFiles, limits.open_files_hard));
  const std::uint64_t ports = limits.last_port >= limits.first_port ? limits.last_port - limits.first_port + 1 : 0;
  const std::uint64_t wanted = kProcesses * kPortsPerProcess;
  add("ports", ports >= wanted && limits.first_port >= kFirstOwnPort + wanted,
      fmt::format("the kernel gives out {} to {}, unicast discovery uses {} up to there", limits.first_port, limits.last_port,
                  kFirstOwnPort),
      "sudo sysctl -w net.ipv4.ip_local_port_range=\"32768 60999\"");
  return checks;
}

std::vector<DoctorCheck> judge(const std::string& interface, const std::vector<NetworkInterface>& there) {
  std::vector<DoctorCheck> checks;
  const NetworkInterface* lo = find_interface("lo", there);
  const bool up = lo != nullptr && lo->up;
  const bool addressed = lo != nullptr && std::find(lo->addresses.begin(), lo->addresses.end(), "127.0.0.1") != lo->addresses.end();
  checks.push_back({"loopback interface", up && addressed,
                    up && addressed ? "lo is up and has the address 127.0.0.1"
                    : !up           ? "lo is not up: no process of this host reaches another"
                                    : "lo has no address 127.0.0.1: no process of this host reaches another",
                    up && addressed ? ""
                    : !up           ? "sudo ip link set dev lo up"
                                    : "sudo ip address add 127.0.0.1/8 dev lo"});
  if (interface == "lo") return checks;
  const std::string refusal = interface_refusal(interface, there);
  const NetworkInterface* found = find_interface(interface, there);
  checks.push_back({"interface", refusal.empty(), refusal.empty() ? fmt::format("{} is up and has an IPv4 address", interface) : refusal,
                    refusal.empty()                 ? ""
                    : found == nullptr || found->up ? "ip -brief address"
                                                    : fmt::format("sudo ip link set dev {} up", found->name)});
  return checks;
}

DoctorCheck judge_configuration(const std::string& uri, const std::vector<NetworkInterface>& there) {
  DoctorCheck check{"CYCLONEDDS_URI", true, "not set: nothing overrides the DDS configuration of a run", ""};
  if (uri.empty()) return check;
  const ConfigurationFaults faults = configuration_faults(uri, there);
  check.well = faults.refusals.empty() && !faults.no_multicast;
  check.remedy = check.well ? "" : "unset CYCLONEDDS_URI";
  check.found = check.well ? "set, and leaves a run what it needs" : "";
  for (const std::string& refusal : faults.refusals) check.found += (check.found.empty() ? "" : "; ") + refusal;
  if (faults.no_multicast)
    check.found += std::string(check.found.empty() ? "" : "; ") + "turns multicast off: processes that find each other by it never will";
  return check;
}

DoctorCheck check_dds(const std::string& interface) {
  constexpr std::string_view kVariable = "CYCLONEDDS_URI: ";
  try {
    try_domain(interface);
    return {"DDS", true, "a domain opens with the configuration of a run", ""};
  } catch (const ConfigError& refusal) {
    const std::string text = std::string(refusal.what()).substr(kVariable.size());
    return {"CYCLONEDDS_URI", false, text.substr(0, text.find("; allowed: ")), "unset CYCLONEDDS_URI"};
  } catch (const RunError& failure) {
    return {"DDS", false, failure.what(), "ip -brief address"};
  }
}

DoctorCheck check_multicast(const std::string& interface_name) {
  const std::string remedy = fmt::format("sudo ip link set dev {} up", interface_name);
  DoctorCheck check{interface_name == "lo" ? "loopback multicast" : "multicast", false, "", remedy};
  const auto failed = [&check](const char* doing) {
    check.found = fmt::format("{}: {}", doing, std::strerror(errno));
    return check;
  };
  const Socket receiver, sender;
  if (receiver.get() < 0 || sender.get() < 0) return failed("no UDP socket");
  sockaddr_in group{};
  group.sin_family = AF_INET;
  group.sin_addr.s_addr = ::inet_addr(kMulticastGroup);
  socklen_t size = sizeof group;
  if (::bind(receiver.get(), reinterpret_cast<const sockaddr*>(&group), sizeof group) != 0 ||
      ::getsockname(receiver.get(), reinterpret_cast<sockaddr*>(&group), &size) != 0)
    return failed("binding a port");
  ip_mreqn membership{};
  membership.imr_multiaddr = group.sin_addr;
  membership.imr_ifindex = static_cast<int>(::if_nametoindex(interface_name.c_str()));
  if (membership.imr_ifindex == 0) return failed("no such interface");
  if (::setsockopt(receiver.get(), IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0)
    return failed("joining the multicast group");
  if (::setsockopt(sender.get(), IPPROTO_IP, IP_MULTICAST_IF, &membership, sizeof membership) != 0)
    return failed("choosing the interface for sending");
  const std::string sent = fmt::format("consort doctor {}", ::getpid());
  if (::sendto(sender.get(), sent.data(), sent.size(), 0, reinterpret_cast<const sockaddr*>(&group), sizeof group) < 0)
    return failed("sending to 239.255.0.1");
  pollfd ready{receiver.get(), POLLIN, 0};
  std::string received(sent.size() + 1, '\0');
  if (::poll(&ready, 1, kPatienceMilliseconds) == 1)
    received.resize(static_cast<std::size_t>(std::max<ssize_t>(0, ::recv(receiver.get(), received.data(), received.size(), 0))));
  check.well = received == sent;
  check.found = check.well ? fmt::format("a datagram to 239.255.0.1 came back over {}", interface_name)
                           : fmt::format("a datagram to 239.255.0.1 over {} did not come back: a packet filter?", interface_name);
  check.remedy =
      check.well ? "" : fmt::format("sudo iptables -I INPUT -i {0} -j ACCEPT && sudo iptables -I OUTPUT -o {0} -j ACCEPT", interface_name);
  return check;
}

std::vector<Leftover> leftover_processes() {
  std::vector<Leftover> leftovers;
  for (const auto& process : std::filesystem::directory_iterator("/proc", std::filesystem::directory_options::skip_permission_denied)) {
    const std::string number = process.path().filename().string();
    if (number.find_first_not_of("0123456789") != std::string::npos) continue;
    const std::string name = first_line(process.path() / "comm");
    if (name != "consort-agent" && name != "consort-plant") continue;
    const auto parent = parent_of(process.path());
    if (!parent) continue;
    // An orphan is given to process 1, or to a session's systemd; one that was started by hand belongs to its shell.
    if (*parent != "1" && first_line(std::filesystem::path("/proc") / *parent / "comm") != "systemd") continue;
    leftovers.push_back({static_cast<pid_t>(std::stol(number)), name});
  }
  std::sort(leftovers.begin(), leftovers.end(), [](const auto& a, const auto& b) { return a.pid < b.pid; });
  return leftovers;
}

std::vector<DoctorCheck> examine_host(const std::string& interface) {
  const auto there = network_interfaces();
  const NetworkInterface* found = find_interface(interface, there);
  std::vector<DoctorCheck> checks = judge(interface, there);
  checks.push_back(judge_configuration(configuration_of_environment(), there));
  if (std::all_of(checks.begin(), checks.end(), [](const DoctorCheck& check) { return check.well; })) {
    const DoctorCheck dds = check_dds(interface);
    if (dds.name == checks.back().name) checks.pop_back();  // only DDS itself saw what is wrong with the user's configuration
    checks.push_back(dds);
  }
  checks.push_back(check_multicast());
  if (found != nullptr && found->name != "lo") checks.push_back(check_multicast(found->name));
  for (auto& check : judge(read_limits())) checks.push_back(std::move(check));
  checks.push_back(check_leftovers());
  return checks;
}

nlohmann::ordered_json to_json(const std::vector<DoctorCheck>& checks) {
  auto list = nlohmann::ordered_json::array();
  for (const DoctorCheck& check : checks) {
    nlohmann::ordered_json one{{"name", check.name}, {"well", check.well}, {"found", check.found}};
    if (!check.well) one["remedy"] = check.remedy;
    list.push_back(one);
  }
  return list;
}

std::string render(const std::vector<DoctorCheck>& checks, const TextStyle& style) {
  constexpr std::size_t kNameWidth = 20, kText = 4 + kNameWidth + 2;
  std::string out = "\n";
  for (const auto& check : checks) {
    const std::string mark = style.unicode ? (check.well ? "✓" : "✗") : (check.well ? "+" : "!");
    const auto lines = wrapped(check.found, std::max<std::size_t>(style.width, 60) - kText);
    out += fmt::format("  {} {:<{}}  {}\n", toned(mark, check.well ? Tone::good : Tone::bad, style), check.name, kNameWidth, lines.front());
    for (std::size_t i = 1; i < lines.size(); ++i) out += fmt::format("{}{}\n", std::string(kText, ' '), lines[i]);
    // The remedy is not wrapped: it is there to be copied.
    if (!check.well) out += fmt::format("      remedy: {}\n", toned(check.remedy, Tone::strong, style));
  }
  const auto failed = std::count_if(checks.begin(), checks.end(), [](const auto& check) { return !check.well; });
  if (failed == 0) return out + fmt::format("\n  {}\n", toned("All is well: this host can run 1000 agent processes.", Tone::good, style));
  return out + fmt::format("\n  {}\n", toned(fmt::format("{} of {} checks failed.", failed, checks.size()), Tone::bad, style));
}

}  // namespace consort
