#include "orchestrator/run/spread.hpp"

#include "core/counted.hpp"
#include "core/errors.hpp"
#include "core/id_list.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace consort {
namespace {

constexpr std::size_t kNowhere = kHere - 1;

bool has(const Host& host, std::uint32_t id) { return std::binary_search(host.agents.begin(), host.agents.end(), id); }

std::string ids_of(const ProcessPlan& process) {
  std::vector<std::uint32_t> ids;
  for (const AgentId agent : process.agents) ids.push_back(agent.value);
  return to_text(ids);
}

// Where the file says it.
void place_named(const Experiment& experiment, const Placement& placement, const std::vector<Host>& hosts, std::vector<std::size_t>& at) {
  for (std::size_t h = 0; h < hosts.size(); ++h) {
    const Host& host = hosts[h];
    if (!host.agents.empty() && host.agents.back() > experiment.agents)
      throw ConfigError(fmt::format("hosts: found agent {} on {}; allowed: 1 to {}", host.agents.back(), host.name, experiment.agents));
    if (has(host, 0) && !experiment.plant)
      throw ConfigError(fmt::format("hosts: found 0, the plant, on {}; allowed: agents only, the experiment has no plant", host.name));
    if (has(host, 0)) at.back() = h;
    for (std::size_t p = 0; p < placement.processes.size(); ++p) {
      const ProcessPlan& process = placement.processes[p];
      const auto here = std::count_if(process.agents.begin(), process.agents.end(), [&](AgentId agent) { return has(host, agent.value); });
      if (here == 0) continue;
      if (static_cast<std::size_t>(here) < process.agents.size())
        throw ConfigError(
            fmt::format("hosts: found a part of agents {} on {}; allowed: all of them or none, as they share a process "
                        "(`placement: {{agents_per_process: {}}}`)",
                        ids_of(process), host.name, experiment.agents_per_process));
      at[p] = h;
    }
  }
}

// How many of the processes that are left each host takes.
std::vector<std::size_t> capacities(const std::vector<Host>& hosts, std::size_t left) {
  std::vector<std::size_t> takes(hosts.size(), 0);
  std::size_t open = 0, wanted = left;
  const auto fills = [](const Host& host) { return host.agents.empty(); };
  for (std::size_t h = 0; h < hosts.size(); ++h) {
    if (!fills(hosts[h])) continue;
    if (!hosts[h].slots) {
      ++open;
      continue;
    }
    takes[h] = std::min(*hosts[h].slots, left);
    left -= takes[h];
  }
  for (std::size_t h = 0; h < hosts.size() && open > 0; ++h) {
    if (!fills(hosts[h]) || hosts[h].slots) continue;
    takes[h] = (left + open - 1) / open;
    left -= takes[h];
    --open;
  }
  if (left > 0)
    throw ConfigError(
        fmt::format("hosts: found slots for {} of {}; allowed: more slots, a host without a number of them, or more agents "
                    "in a process (--agents-per-process)",
                    wanted - left, counted(wanted, "process")));
  return takes;
}

// A block grows by whoever has most neighbours in it; the first of equals.
void fill(const Placement& placement, std::size_t host, std::size_t count, std::vector<std::size_t>& at) {
  std::vector<std::size_t> ties(placement.processes.size(), 0);
  for (; count > 0; --count) {
    std::optional<std::size_t> best;
    for (std::size_t p = 0; p < placement.processes.size(); ++p)
      if (at[p] == kNowhere && (!best || ties[p] > ties[*best])) best = p;
    if (!best) return;  // all have their place
    at[*best] = host;
    for (const std::size_t neighbour : placement.processes[*best].neighbours) ++ties[neighbour];
  }
}

}  // namespace

std::vector<std::size_t> spread(const Experiment& experiment, const Placement& placement, const std::vector<Host>& hosts) {
  std::vector<std::size_t> at(placement.processes.size(), hosts.empty() ? kHere : kNowhere);
  if (experiment.plant) at.push_back(kHere);
  if (hosts.empty()) return at;
  place_named(experiment, placement, hosts, at);
  const auto left = static_cast<std::size_t>(std::count(at.begin(), at.end(), kNowhere));
  const std::vector<std::size_t> takes = capacities(hosts, left);
  for (std::size_t h = 0; h < hosts.size(); ++h) fill(placement, h, takes[h], at);
  return at;
}

}  // namespace consort
