#include "orchestrator/run/fleet.hpp"

#include "core/errors.hpp"
#include "idl/card.hpp"
#include "idl/trust.hpp"
#include "orchestrator/run/commands.hpp"
#include "orchestrator/run/host.hpp"
#include "orchestrator/run/lending.hpp"
#include "orchestrator/run/ports.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <utility>

namespace consort {
namespace {

// What a host's build, or that it computes with other libraries or another processor, does to the run; throws if it does not fit.
void compare(const Host& host, const Lent& lent, const std::function<void(const std::string&)>& remark) {
  const wire::Build own = wire::Build::own(), theirs = wire::Build::from_word(lent.build);
  if (!theirs.fits(own))
    throw RunError(fmt::format("host {}: `{}` is {}, this one {}: install the same build on both", host.name, host.consort, theirs.text(),
                               own.text()));
  if (!theirs.same_sources(own))
    remark(fmt::format("host {}: `{}` is {}, this one {}: it may compute differently", host.name, host.consort, theirs.text(), own.text()));
  if (const std::string here = arithmetic_of_this_host(); lent.arithmetic != here)
    remark(
        fmt::format("host {} computes with {}, this one with {}: the last bits of results may differ", host.name, lent.arithmetic, here));
}

std::vector<std::uint16_t> ports_on(const Wiring& wiring, const Placement& placement, std::size_t host) {
  std::vector<std::uint16_t> ports;
  if (!wiring.neighbours || !wiring.first_port) return ports;
  for (std::size_t p = 0; p < placement.host_of.size(); ++p)
    if (placement.host_of[p] == host)
      for (const unsigned each : {0u, 1u}) ports.push_back(static_cast<std::uint16_t>(wiring.port(wiring.hubs + p) + each));
  return ports;
}

}  // namespace

Connections connect(const Experiment& experiment, RunOptions& options, const Placement& placement,
                    const std::function<void(const std::string&)>& remark) {
  Wiring wiring = Wiring::of(experiment, options, placement);
  if (options.ports) wiring.first_port = options.ports->first();
  Connections connections(options.hosts.size());
  for (std::size_t h = 0; h < options.hosts.size(); ++h) {
    const bool used = std::find(placement.host_of.begin(), placement.host_of.end(), h) != placement.host_of.end();
    if (used && is_connected(options.hosts[h].launcher))
      connections[h] = std::make_unique<Connection>(options.hosts[h].name, connection_to(options.hosts[h]), options.log_directory);
  }
  std::string refusals;
  for (std::size_t h = 0; h < connections.size(); ++h) {
    if (!connections[h]) continue;
    const Host& host = options.hosts[h];
    try {
      compare(host, connections[h]->lent(options.interrupt), remark);
      const std::string& asked = host.interface.empty() ? options.host_addresses[h] : host.interface;
      options.host_addresses[h] = connections[h]->use(asked, ports_on(wiring, placement, h));
    } catch (const RunError& refusal) {
      refusals += (refusals.empty() ? "" : "\n") + std::string(refusal.what());
    }
  }
  if (!refusals.empty()) throw RunError(refusals);
  return connections;
}

Fleet::~Fleet() {
  for (const auto& connection : connections_)
    if (connection) connection->leave();
}

void Fleet::start(const Process& process) {
  const char* program = process.plant ? "consort-plant" : "consort-agent";
  host_of_[process.name] = process.host;
  if (process.host != kHere) {
    connections_.at(process.host)->start(process.name, program, process.arguments, process.key);
    return;
  }
  std::vector<std::string> arguments = process.arguments;
  arguments.insert(arguments.end(), {"--orchestrator-pid", std::to_string(::getpid())});
  const auto executable = process.plant ? agent_executable_.parent_path() / program : agent_executable_;
  const pid_t pid = here_.start(process.name, executable, arguments, {{wire::RunKey::kVariable, process.key}});
  started_here_.push_back({process.name, host_name(), pid});
}

std::vector<Fleet::Started> Fleet::take_started() {
  std::vector<Started> all = std::exchange(started_here_, {});
  for (const auto& connection : connections_)
    if (connection)
      for (const auto& [name, pid] : connection->take_started())
        if (pid != 0) all.push_back({name, connection->host(), pid});
  return all;
}

void Fleet::signal(const std::string& name, int number) {
  const auto host = host_of_.find(name);
  if (host == host_of_.end()) return;
  if (host->second == kHere)
    here_.signal(name, number);
  else
    connections_.at(host->second)->signal(name, number);
}

void Fleet::wake_all() {
  here_.wake_all();
  for (const auto& [name, host] : host_of_)
    if (host != kHere) connections_.at(host)->signal(name, SIGCONT);
}

std::optional<Death> Fleet::next_death() {
  if (auto death = here_.next_death()) return death;
  for (const auto& connection : connections_)
    if (connection)
      if (auto death = connection->next_death()) return death;
  return std::nullopt;
}

std::size_t Fleet::alive() const {
  std::size_t count = here_.alive();
  for (const auto& connection : connections_) count += connection ? connection->alive() : 0;
  return count;
}

bool Fleet::wait_all(double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (alive() > 0 && std::chrono::steady_clock::now() < end)
    if (!next_death()) ::poll(nullptr, 0, 2);
  return alive() == 0;
}

}  // namespace consort
