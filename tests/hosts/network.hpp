#pragma once
/// Four hosts in network namespaces of the test's own, joined by a bridge, a real sshd in each. Needs root; nothing of it outlives the
/// test, and no network of the machine's is touched.

#include "tests/support/program.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

namespace consort::hosts {

/// Of host 1 to 4; 254 is the test's own end of the bridge.
inline std::string address(int host) { return fmt::format("10.77.0.{}", host); }

class Network {
 public:
  static constexpr int kHosts = 4;
  static Network& instance() {
    static Network network;
    return network;
  }
  /// Why there is none; empty: there is.
  [[nodiscard]] const std::string& missing() const { return missing_; }
  /// The folder in which scripts of a test's own may lie.
  [[nodiscard]] const Folder& folder() const { return folder_; }
  /// A shell's line, on a host (0: on the test's own).
  [[nodiscard]] std::unique_ptr<Program> on(int host, const std::string& line) const {
    if (host == 0) return std::make_unique<Program>(folder_, "/bin/sh", std::vector<std::string>{"-c", line});
    return std::make_unique<Program>(folder_, "/usr/sbin/ip",
                                     std::vector<std::string>{"netns", "exec", fmt::format("h{}", host), "/bin/sh", "-c", line});
  }

  /// Is it, as /proc/PID/ns/net, that of one of the hosts or the test's?
  [[nodiscard]] bool has(const std::string& network) const {
    struct stat found {};
    return stat(network.c_str(), &found) == 0 && std::find(networks_.begin(), networks_.end(), found.st_ino) != networks_.end();
  }

 private:
  Network() { make(); }
  void make() {
    if (geteuid() != 0) return say("root: run as root");
    if (unshare(CLONE_NEWNET | CLONE_NEWNS) != 0)
      return say(std::string("network namespaces (") + std::strerror(errno) + "): run where root may make them");
    mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr);
    for (const char* place : {"/run/netns", "/run/sshd"}) {
      mkdir(place, 0755);
      mount("tmpfs", place, "tmpfs", 0, "mode=755");
    }
    for (const char* program : {"/usr/sbin/ip", "/usr/sbin/sshd", "/usr/bin/ssh", "/usr/bin/ssh-keygen"})
      if (access(program, X_OK) != 0) return say(std::string(program) + ": deploy/setup.sh --list deploy/packages-hosts.txt installs it");
    std::string script =
        "set -e\nip link set lo up\nip link set lo multicast on\nip link add br0 type bridge\nip addr add 10.77.0.254/24 dev br0\n"
        "ip link set br0 up\n";
    for (int h = 1; h <= kHosts; ++h)
      script += fmt::format(
          "ip netns add h{0}\nip link add v{0} type veth peer name eth0 netns h{0}\nip link set v{0} master br0 up\n"
          "ip -n h{0} addr add {1}/24 dev eth0\nip -n h{0} link set lo up\n"
          "ip -n h{0} link set eth0 up\n",
          h, address(h));
    const std::string dir = folder_.path().string();
    script += "ssh-keygen -q -t ed25519 -N '' -f " + dir + "/host_key\nssh-keygen -q -t ed25519 -N '' -f " + dir + "/id\ncp " + dir +
              "/id.pub " + dir + "/authorized_keys\n";
    const auto made = on(0, script);
    if (made->wait() != 0) return say("a bridge between namespaces: " + made->err());
    know("/proc/self/ns/net");
    for (int h = 1; h <= kHosts; ++h) know(fmt::format("/run/netns/h{}", h));
    std::string config =
        "Host *\n User root\n IdentityFile " + dir + "/id\n UserKnownHostsFile /dev/null\n StrictHostKeyChecking no\n LogLevel ERROR\n";
    for (int h = 1; h <= kHosts; ++h) {
      config += fmt::format("Host node{}\n HostName {}\n", h, address(h));
      folder_.write(fmt::format("sshd{}", h),
                    fmt::format("ListenAddress {}\nHostKey {}/host_key\nAuthorizedKeysFile {}/authorized_keys\nStrictModes no\nUsePAM no\n"
                                "PidFile none\nMaxStartups 200\nPermitRootLogin prohibit-password\n",
                                address(h), dir, dir));
      servers_.push_back(on(h, fmt::format("exec /usr/sbin/sshd -D -e -f {}/sshd{}", dir, h)));
    }
    folder_.write("ssh_config", config);
    mkdir((dir + "/bin").c_str(), 0755);
    folder_.write("bin/ssh", "#!/bin/sh\nexec /usr/bin/ssh -F " + dir + "/ssh_config \"$@\"\n");
    chmod((dir + "/bin/ssh").c_str(), 0755);
    setenv("PATH", (dir + "/bin:" + std::string(kBinDir) + ":" + std::getenv("PATH")).c_str(), 1);
    for (int h = 1; h <= kHosts; ++h)
      if (!eventually([&] { return on(0, fmt::format("ssh -oBatchMode=yes node{} true", h))->wait() == 0; }))
        return say("an sshd that answers: " + servers_[static_cast<std::size_t>(h) - 1]->err());
  }
  void know(const std::string& network) {
    struct stat found {};
    if (stat(network.c_str(), &found) == 0) networks_.push_back(found.st_ino);
  }
  void say(const std::string& what) { missing_ = "these tests need " + what; }

  Folder folder_;
  std::string missing_;
  std::vector<ino_t> networks_;
  std::vector<std::unique_ptr<Program>> servers_;
};

}  // namespace consort::hosts
