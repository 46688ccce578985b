#include "orchestrator/run/wiring.hpp"

#include "core/id_list.hpp"
#include "core/random.hpp"
#include "orchestrator/run/spread.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace consort {
namespace {

constexpr std::size_t kTunedFrom = 60;  // processes that all discover each other: slower acknowledgements halve the start-up

std::string socket_address(const std::string& address, std::uint16_t port) {
  return address.find(':') == std::string::npos ? fmt::format("{}:{}", address, port) : fmt::format("[{}]:{}", address, port);
}

}  // namespace

Placement place_for(const Experiment& experiment, const RunOptions& options) {
  Placement placement = place(experiment);
  placement.host_of = spread(experiment, placement, options.hosts);
  // Without a list of hosts, whoever is elsewhere is found by multicast.
  if (experiment.discovery == Discovery::automatic && (!options.hosts.empty() || options.expects_others()))
    placement.neighbour_discovery = !options.hosts.empty();
  if (options.open_domain) placement.neighbour_discovery = false;  // who looks on has no list of addresses
  if (placement.neighbour_discovery) placement.multicast_data = false;
  return placement;
}

Wiring Wiring::of(const Experiment& experiment, const RunOptions& options, const Placement& placement) {
  Wiring wiring;
  wiring.run = options.run_name;
  wiring.open_domain = options.open_domain;
  wiring.neighbours = placement.neighbour_discovery;
  wiring.multicast_data = placement.multicast_data;
  wiring.transmit_loss = experiment.transport.loss;
  wiring.processes = placement.processes.size() + (experiment.plant ? 1 : 0);
  wiring.interface = options.interface;
  wiring.by_hand = !options.external.empty() || options.external_plant ||
                   std::any_of(placement.host_of.begin(), placement.host_of.end(),
                               [&](std::size_t host) { return host != kHere && options.hosts[host].launcher == Launcher::manual; });
  if (!options.hosts.empty())
    for (const std::size_t host : placement.host_of)
      wiring.addresses.push_back(host == kHere ? options.interface : options.host_addresses.at(host));
  if (wiring.neighbours) {
    wiring.hubs = (wiring.processes + kProcessesPerHub - 1) / kProcessesPerHub;
    wiring.domain = options.domain < 0 ? 0 : static_cast<unsigned>(options.domain);
    return wiring;
  }
  wiring.tuned = wiring.processes > kTunedFrom;
  wiring.domain =
      options.domain < 0 ? static_cast<unsigned>(Purpose(options.run_name).hash % kDomains) : static_cast<unsigned>(options.domain);
  // `discovery: multicast` asks for the domain's well-known ports, where other programs may look on.
  wiring.own_ports =
      !options.open_domain && options.hosts.empty() && !options.expects_others() && experiment.discovery == Discovery::automatic;
  return wiring;
}

std::uint16_t Wiring::port(std::size_t slot) const { return static_cast<std::uint16_t>(first_port.value() + kPortsPerProcess * slot); }

std::vector<std::string> Wiring::arguments(const Placement& placement, std::size_t process) const {
  const bool plant = process == placement.processes.size();
  const auto address = [&](std::size_t of) { return addresses.empty() ? interface : addresses[of]; };
  const auto found_at = [&](const std::string& where, std::size_t slot) {
    return addresses.empty() ? std::to_string(port(slot)) : socket_address(where, port(slot));
  };
  std::vector<std::string> arguments{"--run", run, "--domain", std::to_string(domain), "--interface", address(process)};
  if (neighbours) {
    std::string listed = found_at(interface, hub_of(process));
    const auto add = [&](std::size_t other) { listed += "," + found_at(address(other), hubs + other); };
    for (std::size_t p = 0; plant && p < process; ++p) add(p);
    if (!plant)
      for (const std::size_t other : placement.processes[process].neighbours) add(other);
    if (!plant && processes > placement.processes.size()) add(placement.processes.size());
    arguments.insert(arguments.end(),
                     {"--discovery", "neighbours", "--port", std::to_string(port(hubs + process)), "--neighbour-ports", listed});
  } else {
    if (own_ports && first_port) arguments.insert(arguments.end(), {"--port", std::to_string(*first_port)});
    if (multicast_data) arguments.insert(arguments.end(), {"--data", "multicast"});
  }
  if (open_domain) arguments.emplace_back("--open-domain");
  if (tuned) arguments.emplace_back("--tuned");
  if (transmit_loss > 0.0) arguments.insert(arguments.end(), {"--transport-loss", std::to_string(transmit_loss)});
  if (plant) return arguments;
  std::vector<std::uint32_t> ids;
  for (const AgentId agent : placement.processes[process].agents) ids.push_back(agent.value);
  arguments.insert(arguments.begin(), {"--ids", to_text(ids)});
  return arguments;
}

}  // namespace consort
