#pragma once
/// Which process hosts whom, whom it must meet, and how the processes find each other. Pure: a function of the experiment alone.

#include "core/experiment.hpp"

#include <memory>
#include <vector>

namespace consort {

struct ProcessPlan {
  std::vector<AgentId> agents;          ///< hosted, ascending; the first one names the process
  std::vector<std::size_t> neighbours;  ///< indices of processes it exchanges Information with, ascending
  Attendance presence;                  ///< when somebody of it takes part
};

struct Placement {
  std::vector<ProcessPlan> processes;
  std::vector<std::size_t> process_of;            ///< by agent index
  std::shared_ptr<const Graph> support;           ///< every edge any round of any job may use
  std::vector<std::vector<std::size_t>> readers;  ///< by agent index: other processes in which somebody may hear it, ascending
  std::vector<std::size_t> host_of = {};          ///< by process, see spread(); the plant last, if there is one
  bool neighbour_discovery = false;               ///< unicast along the edges; else multicast, everybody finds everybody
  bool multicast_data = false;                    ///< one packet for all: most processes read each message
};

/// Who is hosted with whom; without neighbours, which the graphs decide.
std::vector<ProcessPlan> processes_of(const Experiment& experiment);

Placement place(const Experiment& experiment);

/// May agent i hear every other agent?
bool hears_everyone(const Placement& placement, AgentId agent);

}  // namespace consort
