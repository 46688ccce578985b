#pragma once
/// Which process of a run is found where, and with what options it finds the run and the processes it meets. Pure.

#include "orchestrator/run/placement.hpp"
#include "orchestrator/run/run.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace consort {

struct Wiring {
  static constexpr unsigned kDomains = 100;  ///< above, the ports of a domain would reach the kernel's ephemeral ones
  static constexpr unsigned kPortsPerProcess = 4;
  static constexpr std::size_t kProcessesPerHub = 20;

  std::string run;
  unsigned domain = 0;
  bool neighbours = false;      ///< unicast along the edges; else multicast, everybody finds everybody
  bool multicast_data = false;  ///< one packet for all
  bool own_ports = false;       ///< multicast, on ports of this run alone
  bool open_domain = false;     ///< no discovery tag
  bool tuned = false;
  bool by_hand = false;  ///< somebody is started by a person
  double transmit_loss = 0.0;
  std::size_t hubs = 1, processes = 0;        ///< the orchestrator's ends of the wire; the plant, which is the last process, counts
  std::string interface = "lo";               ///< of whoever is on this host
  std::vector<std::string> addresses = {};    ///< by process, of its host; empty: all are on this one
  std::optional<std::uint16_t> first_port{};  ///< neighbours: of hub 0, then come the others, then the processes; own_ports: of all

  /// Without ports, which are claimed, and with the domain that the run's name gives, where none is asked for.
  static Wiring of(const Experiment& experiment, const RunOptions& options, const Placement& placement);
  /// How many it takes, if it does.
  [[nodiscard]] std::size_t ports() const { return neighbours ? kPortsPerProcess * (hubs + processes) : own_ports ? kPortsPerProcess : 0; }
  /// Of hub `slot`, then of process `slot - hubs`.
  [[nodiscard]] std::uint16_t port(std::size_t slot) const;
  [[nodiscard]] std::size_t hub_of(std::size_t process) const { return neighbours ? process / kProcessesPerHub : 0; }
  /// Options of a process's command line; whom it hosts is among them.
  [[nodiscard]] std::vector<std::string> arguments(const Placement& placement, std::size_t process) const;
};

/// How processes are placed and find each other with these options: on several hosts by listed addresses, which no network has to help
/// with.
Placement place_for(const Experiment& experiment, const RunOptions& options);

}  // namespace consort
