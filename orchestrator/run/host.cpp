#include "orchestrator/run/host.hpp"

#include "core/build.hpp"
#include "core/errors.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <thread>

namespace consort {

nlohmann::ordered_json host_facts(const Experiment& experiment, const std::vector<std::string>& command_line) {
  utsname system{};
  ::uname(&system);
  nlohmann::ordered_json facts;
  facts["began"] = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  facts["seed"] = experiment.seed.value;
  facts["command_line"] = command_line;
  facts["versions"] = {{"consort", kBuild.version},    {"commit", kBuild.commit}, {"build", kBuild.type},
                       {"cyclonedds", kBuild.cyclone}, {"eigen", kBuild.eigen},   {"sqlite", sqlite3_libversion()},
                       {"compiler", kBuild.compiler}};
  facts["kernel"] = fmt::format("{} {} {}", system.sysname, system.release, system.machine);
  facts["host"] = system.nodename;
  facts["cores"] = std::thread::hardware_concurrency();
  facts["memory_bytes"] = static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  return facts;
}

std::string host_name() {
  utsname system{};
  ::uname(&system);
  return system.nodename;
}

std::filesystem::path program_folder() {
  std::error_code failure;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", failure);
  if (failure) throw RunError(fmt::format("cannot find where consort itself lies: {}", failure.message()));
  return self.parent_path();
}

std::string too_busy() {
  constexpr double kBusy = 2.0;  // of what its processors can do
  double load = 0.0;
  const auto processors = std::max(::sysconf(_SC_NPROCESSORS_ONLN), 1L);
  if (::getloadavg(&load, 1) != 1 || load < kBusy * static_cast<double>(processors)) return {};
  return fmt::format("this host is busy (load {:.0f} on {} processor{}): run less at once, or give it a later `stop: {{deadline: ...}}`",
                     load, processors, processors == 1 ? "" : "s");
}

}  // namespace consort
