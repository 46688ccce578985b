#include "orchestrator/run/host.hpp"

#include "core/build.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <sys/utsname.h>
#include <unistd.h>

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

}  // namespace consort
