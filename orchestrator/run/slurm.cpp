#include "orchestrator/run/slurm.hpp"

#include "core/errors.hpp"
#include "core/number_text.hpp"
#include "orchestrator/run/host.hpp"
#include "orchestrator/run/launch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <string_view>

namespace consort {
namespace {

constexpr const char* kTasks = "SLURM_TASKS_PER_NODE";
constexpr std::size_t kMostNodes = 100'000;

}  // namespace

std::vector<std::size_t> tasks_per_node(const std::string& variable, const std::string& text) {
  std::vector<std::size_t> tasks;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const std::size_t bracket = part.find("(x");
    const auto count = parse_number<std::size_t>(std::string_view(part).substr(0, bracket));
    const auto times = bracket == std::string::npos ? 1
                       : part.ends_with(')')        ? parse_number<std::size_t>(part.substr(bracket + 2, part.size() - bracket - 3))
                                                    : std::nullopt;
    if (!count || !times || *count < 1 || *times > kMostNodes)
      throw ConfigError(fmt::format("{}: found '{}'; allowed: numbers of tasks as Slurm says them, such as 2(x3),1", variable, text));
    tasks.insert(tasks.end(), *times, *count);
  }
  return tasks;
}

std::vector<Host> hosts_of_allocation() {
  const char* nodes = std::getenv("SLURM_JOB_NODELIST");
  if (nodes == nullptr)
    throw ConfigError(
        "--launcher slurm: found no allocation (SLURM_JOB_NODELIST is not set); allowed: within sbatch or salloc, see "
        "deploy/slurm/run.sbatch");
  std::istringstream names(said_by({"scontrol", "show", "hostnames", nodes}));
  std::vector<Host> hosts;
  for (std::string name; names >> name;)
    hosts.push_back({.name = name, .address = name, .launcher = Launcher::slurm, .consort = (program_folder() / "consort").string()});
  if (hosts.empty())
    throw ConfigError(fmt::format("--launcher slurm: found nodes '{}', which `scontrol show hostnames` does not list", nodes));
  const char* text = std::getenv(kTasks);
  const auto tasks = text == nullptr ? std::vector<std::size_t>() : tasks_per_node(kTasks, text);
  for (std::size_t h = 0; h < std::min(hosts.size(), tasks.size()); ++h) hosts[h].slots = tasks[h];
  return hosts;
}

}  // namespace consort
