#include "orchestrator/cli/doctor.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>

namespace consort {
namespace {

HostLimits ample() {
  HostLimits limits;
  limits.open_files = limits.open_files_hard = 20'000;
  limits.tasks = limits.tasks_hard = 60'000;
  limits.threads_max = 100'000;
  limits.pid_max = 100'000;
  limits.tasks_running = 300;
  limits.first_port = 32'768;
  limits.last_port = 60'999;
  limits.receive_buffer = 4u << 20;
  return limits;
}

std::vector<std::string> remedies(const HostLimits& limits) {
  std::vector<std::string> result;
  for (const auto& check : judge(limits)) {
    EXPECT_EQ(check.well, check.remedy.empty()) << check.name;
    EXPECT_FALSE(check.found.empty()) << check.name;
    if (!check.well) result.push_back(check.remedy);
  }
  return result;
}

TEST(Doctor, AmpleHostIsWell) { EXPECT_TRUE(remedies(ample()).empty()); }

TEST(Doctor, EachShortageHasItsRemedy) {
  struct Case {
    void (*spoil)(HostLimits&);
    std::string remedy;
  };
  const std::vector<Case> cases{
      {[](HostLimits& l) { l.receive_buffer = 212'992; }, "sudo sysctl -w net.core.rmem_max=4194304"},
      {[](HostLimits& l) { l.open_files = 1024; }, "ulimit -n 4096"},
      {[](HostLimits& l) { l.open_files = l.open_files_hard = 1024; }, "sudo prlimit --pid $$ --nofile=4096:4096"},
      {[](HostLimits& l) { l.tasks = 4096; }, "ulimit -u 9300"},
      {[](HostLimits& l) { l.tasks = l.tasks_hard = 4096; }, "sudo prlimit --pid $$ --nproc=9300:9300"},
      {[](HostLimits& l) { l.threads_max = 8000; }, "sudo sysctl -w kernel.threads-max=18600"},
      {[](HostLimits& l) { l.pid_max = 8192; }, "sudo sysctl -w kernel.pid_max=37200"},
      {[](HostLimits& l) { l.group_tasks = 2000, l.group_file = "/sys/fs/cgroup/box/pids.max"; },
       "echo max | sudo tee /sys/fs/cgroup/box/pids.max"},
      {[](HostLimits& l) { l.last_port = 33'000; }, "sudo sysctl -w net.ipv4.ip_local_port_range=\"32768 60999\""},
      {[](HostLimits& l) { l.first_port = 1024; }, "sudo sysctl -w net.ipv4.ip_local_port_range=\"32768 60999\""}};
  for (const auto& [spoil, remedy] : cases) {
    SCOPED_TRACE(remedy);
    HostLimits limits = ample();
    spoil(limits);
    EXPECT_EQ(remedies(limits), std::vector<std::string>{remedy});
  }
}

TEST(Doctor, LimitOnThreadsDoesNotBindTheSuperuser) {
  HostLimits limits = ample();
  limits.tasks = limits.tasks_hard = 100;
  limits.privileged = true;
  EXPECT_TRUE(remedies(limits).empty());
}

TEST(Doctor, ReadsTheLimitsThatHold) {
  rlimit limit{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &limit), 0);
  const HostLimits limits = read_limits();
  EXPECT_EQ(limits.open_files, limit.rlim_cur);
  EXPECT_GT(limits.threads_max, 0u);
  EXPECT_GT(limits.pid_max, 0u);
  EXPECT_GT(limits.tasks_running, 0u);
  EXPECT_GT(limits.receive_buffer, 0u);
  EXPECT_GT(limits.last_port, limits.first_port);
}

const std::vector<NetworkInterface> kTwo{{"lo", true, {"127.0.0.1"}}, {"eth0", true, {"10.0.0.1"}}, {"eth1", false, {"10.0.1.1"}}};

/// "check: remedy" of what is not well.
std::vector<std::string> ailing(const std::vector<DoctorCheck>& checks) {
  std::vector<std::string> out;
  for (const auto& check : checks)
    if (!check.well) out.push_back(check.name + ": " + check.remedy);
  return out;
}
using Ailing = std::vector<std::string>;

TEST(Doctor, TheInterfaceOfARunIsThereAndUp) {
  EXPECT_EQ(ailing(judge("lo", kTwo)), Ailing{});
  EXPECT_EQ(ailing(judge("eth0", kTwo)), Ailing{});
  EXPECT_EQ(ailing(judge("10.0.0.1", kTwo)), Ailing{});
  EXPECT_EQ(ailing(judge("eth1", kTwo)), Ailing{"interface: sudo ip link set dev eth1 up"});
  EXPECT_EQ(ailing(judge("eht0", kTwo)), Ailing{"interface: ip -brief address"});
  EXPECT_EQ(judge("eht0", kTwo).back().found,
            "found 'eht0', which this host does not have; allowed: lo (127.0.0.1), eth0 (10.0.0.1), eth1 (10.0.1.1, down); did you mean "
            "'eth0'?");
}

TEST(Doctor, LoopbackIsUpAndHasItsAddress) {
  EXPECT_EQ(ailing(judge("lo", {{"lo", true, {}}})), Ailing{"loopback interface: sudo ip address add 127.0.0.1/8 dev lo"});
  EXPECT_EQ(ailing(judge("lo", {{"lo", false, {"127.0.0.1"}}})), Ailing{"loopback interface: sudo ip link set dev lo up"});
  EXPECT_EQ(ailing(judge("lo", {})), Ailing{"loopback interface: sudo ip link set dev lo up"});
}

TEST(Doctor, TheUsersDdsConfigurationIsRead) {
  const auto found = [](const std::string& uri) {
    const DoctorCheck check = judge_configuration(uri, kTwo);
    EXPECT_EQ(check.remedy, check.well ? "" : "unset CYCLONEDDS_URI");
    return check.well ? "" : check.found;
  };
  const std::string none = "turns multicast off: processes that find each other by it never will";
  EXPECT_EQ(found(""), "");
  EXPECT_EQ(found("<Discovery><LeaseDuration>1s</LeaseDuration></Discovery>"), "");
  EXPECT_EQ(found("<General><AllowMulticast>spdp</AllowMulticast></General>"), "");
  EXPECT_EQ(found("<General><AllowMulticast> false </AllowMulticast></General>"), none);
  EXPECT_EQ(found("<!-- <AllowMulticast>false</AllowMulticast> -->"), "");
  EXPECT_EQ(found("<Discovery/>,<Interfaces><NetworkInterface name='lo' multicast='false'/></Interfaces>"), none);
  EXPECT_EQ(found("<Interfaces><NetworkInterface name=\"eth0\"/></Interfaces>"), "");
  EXPECT_EQ(found("<Interfaces><NetworkInterface name=\"nix0\"/></Interfaces>").find("found 'nix0', which this host does not have"), 0u);
  EXPECT_EQ(found("<NetworkInterfaceAddress>10.9.9.9</NetworkInterfaceAddress>").find("found '10.9.9.9'"), 0u);
  EXPECT_EQ(found("<Discovery/>,file:///nowhere/c.xml").find("found '/nowhere/c.xml', which cannot be read (No such file"), 0u);
  EXPECT_EQ(found("/dev/zero").find("found '/dev/zero', which is a device"), 0u);
}

/// The variable for as long as it lives.
struct UserConfiguration {
  explicit UserConfiguration(const char* uri) { ::setenv("CYCLONEDDS_URI", uri, 1); }
  ~UserConfiguration() { ::unsetenv("CYCLONEDDS_URI"); }
  UserConfiguration(const UserConfiguration&) = delete;
  UserConfiguration& operator=(const UserConfiguration&) = delete;
};

TEST(Doctor, WhatDdsRefusesInTheUsersConfigurationIsOneFaultOfTheVariable) {
  for (const auto& [uri, words] : std::vector<std::pair<const char*, std::string>>{
           {"<CycloneDDS><Domain", "found broken XML in line 1"},
           {"<General><Foo>1</Foo></General>", "found the element 'Foo' in CycloneDDS/Domain/General, which Cyclone DDS"},
           {"<General><AllowMulticast>maybe</AllowMulticast></General>", "found 'maybe' in CycloneDDS/Domain/General/AllowMulticast"}}) {
    SCOPED_TRACE(uri);
    const UserConfiguration set(uri);
    const DoctorCheck check = check_dds("lo");
    EXPECT_EQ(check.name, "CYCLONEDDS_URI");
    EXPECT_FALSE(check.well);
    EXPECT_EQ(check.found.find(words), 0u) << check.found;
    EXPECT_EQ(check.found.find("allowed"), std::string::npos) << "the remedy stands below";
    EXPECT_EQ(check.remedy, "unset CYCLONEDDS_URI");
    const auto checks = examine_host();
    EXPECT_EQ(std::count_if(checks.begin(), checks.end(), [](const auto& each) { return each.name == "CYCLONEDDS_URI"; }), 1);
    EXPECT_TRUE(std::none_of(checks.begin(), checks.end(), [](const auto& each) { return each.name == "DDS"; }));
  }
}

TEST(Doctor, MulticastOverLoopbackReallyTravels) {
  const DoctorCheck check = check_multicast();
  EXPECT_TRUE(check.well) << check.found << "; " << check.remedy;
}

TEST(Doctor, FindsAnAgentWhoseOrchestratorIsGone) {
  // A child starts a grandchild named as an agent and dies: the grandchild is an orphan, as after a killed orchestrator.
  int pipe_ends[2];
  ASSERT_EQ(::pipe(pipe_ends), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const pid_t orphan = ::fork();
    if (orphan == 0) {
      ::close(pipe_ends[0]);
      ::prctl(PR_SET_NAME, "consort-agent");
      ::alarm(120);  // ends by itself if the test does not
      const pid_t self = ::getpid();
      while (::getppid() == child) ::sched_yield();
      if (::write(pipe_ends[1], &self, sizeof self) != sizeof self) ::_exit(1);
      for (;;) ::pause();
    }
    ::_exit(0);
  }
  ::close(pipe_ends[1]);
  ::waitpid(child, nullptr, 0);
  pid_t orphan = 0;
  ASSERT_EQ(::read(pipe_ends[0], &orphan, sizeof orphan), static_cast<ssize_t>(sizeof orphan));
  ::close(pipe_ends[0]);
  const auto found = leftover_processes();
  const bool listed =
      std::any_of(found.begin(), found.end(), [&](const Leftover& l) { return l.pid == orphan && l.name == "consort-agent"; });
  const auto checks = examine_host();
  const auto& last = checks.back();
  ::kill(orphan, SIGKILL);
  EXPECT_TRUE(listed);
  EXPECT_FALSE(last.well);
  EXPECT_NE(last.remedy.find(std::to_string(orphan)), std::string::npos) << last.remedy;
  EXPECT_TRUE(last.remedy.starts_with("kill ")) << last.remedy;
}

TEST(Doctor, RemedyStandsBelowTheCheckThatFailed) {
  HostLimits limits = ample();
  limits.open_files = 1024;
  const std::string text = render(judge(limits), {false, false, false, 80});
  EXPECT_NE(text.find("! open files"), std::string::npos) << text;
  EXPECT_NE(text.find("\n      remedy: ulimit -n 4096\n"), std::string::npos) << text;
  EXPECT_NE(text.find("1 of 7 checks failed."), std::string::npos) << text;
}

}  // namespace
}  // namespace consort
