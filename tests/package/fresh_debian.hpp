#pragma once
/// A small Debian in a folder, made by mmdebstrap from where this machine gets its packages. Needs root; nothing of it outlives the test.

#include "tests/support/program.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>
#include <set>
#include <string>
#include <vector>

namespace consort::package {

class FreshDebian {
 public:
  /// With these of Debian's packages, and a user `reader`.
  FreshDebian(const Folder& folder, const std::set<std::string>& packages) : folder_(folder), root_(folder.path() / "debian") {
    make(packages);
  }

  /// Why there is none; empty: there is.
  [[nodiscard]] const std::string& missing() const { return missing_; }
  [[nodiscard]] const std::filesystem::path& root() const { return root_; }
  /// A shell's line in it, which sees no other processes, files or networks, and takes whatever it leaves running with it.
  [[nodiscard]] std::unique_ptr<Program> run(const std::string& user, const std::string& line) const {
    const std::string root = root_.string(),
                      begin = "ip link set lo up multicast on && exec chroot --userspec=$0:$0 " + root +
                              " env -i HOME=/home/reader LANG=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin sh -ec \"cd; $1\"";
    return std::make_unique<Program>(folder_, "/usr/bin/unshare",
                                     std::vector<std::string>{"--net", "--pid", "--fork", "--kill-child", "--mount-proc=" + root + "/proc",
                                                              "/bin/sh", "-c", begin, user, line});
  }
  /// Every file and folder with its kind, rights, owner and size, but for what users and dpkg's own diary hold.
  [[nodiscard]] std::set<std::string> files() const {
    const auto listed = here(fmt::format(
        "cd {} && find . '(' -path './proc/*' -o -path './tmp/*' -o -path './home/*' -o -path './var/log/*' -o -name '*-old' ')' -prune "
        "-o -printf '%P %y %m %u\\n'",
        root_.string()));
    EXPECT_EQ(listed->wait(), 0) << listed->err();
    std::istringstream in(listed->out());
    std::set<std::string> lines;
    for (std::string line; std::getline(in, line);) lines.insert(line);
    return lines;
  }

 private:
  void make(const std::set<std::string>& packages) {
    if (geteuid() != 0) return say("root: run as root");
    for (const char* program : {"/usr/bin/mmdebstrap", "/usr/sbin/ip", "/usr/bin/lintian", "/usr/bin/zsh", "/usr/bin/fish"})
      if (access(program, X_OK) != 0) return say(std::string(program) + ": deploy/setup.sh --list deploy/packages-package.txt installs it");
    // mmdebstrap lets dash write to a pipe of its own, which it can to one digit only: files that are open here are closed for it.
    // What apt of this machine is told of networks and where it looks holds for the new one; its user _apt comes in. Documents of others
    // are left out.
    const auto made = here(fmt::format(
        "exec 3>&- 4>&- 5>&- 6>&- 7>&- 8>&- 9>&-; cd {} && chmod 755 . && . /etc/os-release && apt-config dump --format '%F \"%v\";%n' "
        "Acquire >acquire && "
        "mmdebstrap --quiet --variant=apt --format=directory --include={} --aptopt=acquire --dpkgopt=force-unsafe-io "
        "--dpkgopt=path-exclude=/usr/share/doc/* --dpkgopt=path-exclude=/usr/share/man/* --dpkgopt=path-exclude=/usr/share/locale/* "
        "$VERSION_CODENAME {} $(find /etc/apt -name '*.sources' -o -name '*.list' | grep -v '/keyrings/') && "
        "rm {}/etc/dpkg/dpkg.cfg.d/99mmdebstrap && chroot {} useradd --create-home reader",
        folder_.path().string(), fmt::join(packages, ","), root_.string(), root_.string(), root_.string()));
    if (made->wait(900) != 0) say("a Debian of its own: " + made->out() + made->err());
  }
  [[nodiscard]] std::unique_ptr<Program> here(const std::string& line) const {
    return std::make_unique<Program>(folder_, "/bin/sh", std::vector<std::string>{"-c", line});
  }
  void say(const std::string& what) { missing_ = "these tests need " + what; }

  const Folder& folder_;
  std::filesystem::path root_;
  std::string missing_;
};

}  // namespace consort::package
