#include "orchestrator/run/placement.hpp"

#include <algorithm>
#include <set>
#include <utility>

namespace consort {
namespace {

// Where everybody-finds-everybody discovery stops paying: its cost grows with the square of the processes (about 0.6 ms per ordered pair).
constexpr std::size_t kSmall = 30;
// A message that at least this share of the other processes reads goes out once for all. With fewer readers, waking everybody costs more.
constexpr double kDense = 0.5;

// Who hears whom, as processes: fills readers and the processes' neighbours.
void connect(Placement& placement) {
  const std::size_t n = placement.process_of.size(), processes = placement.processes.size();
  // Processes are numbered as their agents are: receivers ascend, and so do the readers of each message.
  placement.readers.resize(n);
  for (std::size_t i = 0; i < n; ++i)
    for (const Neighbour& sender : placement.support->in_neighbours(agent_at(i))) {
      auto& readers = placement.readers[index_of(sender.id)];
      const std::size_t to = placement.process_of[i];
      if (to != placement.process_of[index_of(sender.id)] && (readers.empty() || readers.back() != to)) readers.push_back(to);
    }
  std::vector<std::size_t> met_by(processes, processes);
  for (std::size_t p = 0; p < processes; ++p) {
    std::vector<std::size_t>& met = placement.processes[p].neighbours;
    met_by[p] = p;
    const auto meet = [&](std::size_t other) {
      if (std::exchange(met_by[other], p) != p) met.push_back(other);
    };
    for (const AgentId agent : placement.processes[p].agents) {
      for (const std::size_t reader : placement.readers[index_of(agent)]) meet(reader);
      for (const Neighbour& sender : placement.support->in_neighbours(agent)) meet(placement.process_of[index_of(sender.id)]);
    }
    if (!std::is_sorted(met.begin(), met.end())) std::sort(met.begin(), met.end());
  }
}

}  // namespace

std::vector<ProcessPlan> processes_of(const Experiment& experiment) {
  std::vector<ProcessPlan> processes;
  std::set<AgentId> struck;
  for (const Fault& fault : experiment.faults) struck.insert(fault.agent);
  std::size_t room = 0;  // in the newest process
  for (std::size_t index = 0; index < experiment.agents; ++index) {
    const Attendance presence = experiment.presence_of(agent_at(index));
    // Whoever joins together may share a process; nobody shares one with somebody who is there earlier, or whose process meets a fate of
    // its own.
    const bool alone = !presence.again.empty() || struck.contains(agent_at(index));
    if (room == 0 || alone || processes.back().presence.from != presence.from) {
      processes.push_back({{}, {}, presence});
      room = alone ? 1 : experiment.agents_per_process;
    }
    --room;
    Round& until = processes.back().presence.until;
    until = std::max(until, presence.until);
    processes.back().agents.push_back(agent_at(index));
  }
  return processes;
}

Placement place(const Experiment& experiment) {
  Placement placement;
  placement.processes = processes_of(experiment);
  placement.support = experiment.schedule(experiment.seed).support(experiment.rounds);
  const std::size_t processes = placement.processes.size();
  for (std::size_t p = 0; p < processes; ++p)
    placement.process_of.insert(placement.process_of.end(), placement.processes[p].agents.size(), p);
  connect(placement);
  std::size_t reader_count = 0, senders = 0, met = 0;
  for (const auto& readers : placement.readers) {
    reader_count += readers.size();
    senders += readers.empty() ? 0 : 1;
  }
  for (const ProcessPlan& process : placement.processes) met += process.neighbours.size();
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
  return placement.support->in_degree(agent) + 1 == placement.support->agents();
}

}  // namespace consort
