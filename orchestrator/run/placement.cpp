#include "orchestrator/run/placement.hpp"

#include <algorithm>
#include <set>

namespace consort {
namespace {

// Where everybody-finds-everybody discovery stops paying: its cost grows with the square of the processes (about 0.6 ms per ordered pair).
constexpr std::size_t kSmall = 30;
// A message that at least this share of the other processes reads goes out once for all. With fewer readers, waking everybody costs more.
constexpr double kDense = 0.5;

}  // namespace

Placement place(const Experiment& experiment) {
  Placement placement;
  const std::size_t n = experiment.agents;
  placement.support = experiment.schedule(experiment.seed).support(experiment.rounds);
  placement.process_of.resize(n);
  std::set<AgentId> struck;
  for (const Fault& fault : experiment.faults) struck.insert(fault.agent);
  std::size_t room = 0;  // in the newest process
  for (std::size_t index = 0; index < n; ++index) {
    const Attendance presence = experiment.presence_of(agent_at(index));
    // Whoever joins together may share a process; nobody shares one with somebody who is there earlier, or whose process meets a fate of
    // its own.
    const bool alone = !presence.again.empty() || struck.contains(agent_at(index));
    if (room == 0 || alone || placement.processes.back().presence.from != presence.from) {
      placement.processes.push_back({{}, {}, presence});
      room = alone ? 1 : experiment.agents_per_process;
    }
    --room;
    Round& until = placement.processes.back().presence.until;
    until = std::max(until, presence.until);
    placement.processes.back().agents.push_back(agent_at(index));
    placement.process_of[index] = placement.processes.size() - 1;
  }
  const std::size_t processes = placement.processes.size();
  std::vector<std::set<std::size_t>> readers(n), meets(processes);
  for (const auto& [edge, weight] : placement.support.edges()) {
    const std::size_t from = placement.process_of[index_of(edge.from)], to = placement.process_of[index_of(edge.to)];
    if (from == to) continue;
    readers[index_of(edge.from)].insert(to);
    meets[from].insert(to);
    meets[to].insert(from);
  }
  std::size_t reader_count = 0, senders = 0;
  for (const auto& set : readers) {
    placement.readers.emplace_back(set.begin(), set.end());
    reader_count += set.size();
    senders += set.empty() ? 0 : 1;
  }
  std::size_t met = 0;
  for (std::size_t p = 0; p < processes; ++p) {
    placement.processes[p].neighbours.assign(meets[p].begin(), meets[p].end());
    met += meets[p].size();
  }
  const double others = static_cast<double>(processes) - 1.0;
  const bool sparse = static_cast<double>(met) < kDense * others * static_cast<double>(processes);
  switch (experiment.discovery) {
    case Discovery::multicast:
      placement.neighbour_discovery = false;
      break;
    case Discovery::neighbours:
      placement.neighbour_discovery = true;
      break;
    case Discovery::automatic:
      placement.neighbour_discovery = processes > kSmall && sparse;
      break;
  }
  placement.multicast_data = !placement.neighbour_discovery && processes > 3 && senders > 0 &&
                             static_cast<double>(reader_count) >= kDense * others * static_cast<double>(senders);
  return placement;
}

bool hears_everyone(const Placement& placement, AgentId agent) {
  return placement.support.in_degree(agent) + 1 == placement.support.agents();
}

}  // namespace consort
