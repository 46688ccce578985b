#include "orchestrator/run/hubs.hpp"

#include "core/errors.hpp"
#include "core/random.hpp"
#include "idl/dds_failure.hpp"
#include "idl/dds_log.hpp"

#include <unistd.h>

#include <chrono>

namespace consort {
namespace {

using std::chrono::milliseconds;

constexpr unsigned kDomains = 100;  // above, the ports of a domain would reach the kernel's ephemeral ones
constexpr unsigned kDomainIds = 230;
constexpr unsigned kDomainAttempts = 5;
constexpr unsigned kPortsPerProcess = 4;
constexpr std::size_t kProcessesPerHub = 20;
constexpr std::size_t kTunedFrom = 60;  // processes that all discover each other: slower acknowledgements halve the start-up
constexpr std::size_t kWriterMemory = std::size_t{1} << 30;  // bytes a writer may hold before a write would wait
constexpr milliseconds kAnnounceEvery{2000};  // neighbours mode: a first announcement may meet a process that is not there yet
constexpr milliseconds kExternalLease{2000};  // how fast an agent on another host notices a dead orchestrator, and the other way round

unsigned domain_of(const std::string& run_name) { return static_cast<unsigned>(Purpose(run_name).hash % kDomains); }

}  // namespace

Hubs::Hubs(const Experiment& experiment, const RunOptions& options, const Placement& placement, std::size_t processes,
           const Hub::Callbacks& callbacks)
    : options_(options), placement_(placement), processes_(processes) {
  wire::DdsLog::of_this_process();  // from here on DDS says to it what it has to say
  // `discovery: multicast` asks for the domain's well-known ports, where other programs may look on.
  private_ports_ = !options.expects_others() && experiment.discovery == Discovery::automatic && !placement.neighbour_discovery;
  if (!private_ports_ && !placement.neighbour_discovery) shared_.emplace();
  settings_.tag = options.run_name;
  settings_.interface = options.interface;
  settings_.writer_high_watermark = kWriterMemory;
  settings_.writer_linger = milliseconds(0);
  settings_.transmit_loss = experiment.transport.loss;
  const bool by_hand = !options.external.empty() || options.external_plant;
  settings_.lease_duration = by_hand ? kExternalLease : dds::configuration::kLongestLease;
  if (placement.neighbour_discovery)
    open_neighbours(callbacks);
  else
    open_multicast(callbacks);
}

// One hub: everybody finds everybody anyhow. A domain's ports may be somebody else's, so a derived domain has alternatives.
void Hubs::open_multicast(const Hub::Callbacks& callbacks) {
  settings_.data = placement_.multicast_data ? dds::configuration::Data::multicast : dds::configuration::Data::unicast;
  settings_.hears_multicast_data = false;  // every packet of the agents would wake this process
  settings_.tuned = processes_ > kTunedFrom;
  if (private_ports_) claim_private_ports();
  if (options_.interface != "lo" || settings_.transmit_loss > 0.0) settings_.spdp_interval = dds::configuration::kAnnounceAgain;
  const std::string configuration = dds::domain::with_user_configuration(xml(settings_));
  const bool derived = options_.domain < 0;
  const unsigned first = derived ? domain_of(options_.run_name) : static_cast<unsigned>(options_.domain);
  for (unsigned attempt = 0;; ++attempt) {
    domain_number_ = attempt == 0 ? first : (first + 7 * attempt) % kDomains;
    if (shared_) sole_.emplace(options_.run_name, options_.key, domain_number_);
    try {
      hubs_.push_back(std::make_unique<Hub>(domain_number_, configuration, wire::RunKey(options_.key), callbacks));
      if (shared_) shared_->enter(domain_number_);
      return;
    } catch (const dds::core::Exception& failure) {
      if (derived && attempt + 1 < kDomainAttempts) continue;
      wire::raise_no_domain(failure, "DDS domain " + std::to_string(domain_number_), "allowed: another --domain, or none");
    }
  }
}

// Runs that share a domain's ports cost each other: every packet of one's discovery wakes all processes of the others.
void Hubs::claim_private_ports() {
  try {
    ports_.emplace(kPortsPerProcess);
    settings_.port_base = ports_->first();
    if (!settings_.tuned) settings_.spdp_interval = kAnnounceEvery;
  } catch (const RunError&) {  // none is free: then those of the domain have to do
    private_ports_ = false;
  }
}

// Every hub and every process has a port of its own in one block, so all can share a domain.
void Hubs::open_neighbours(const Hub::Callbacks& callbacks) {
  const std::size_t hubs = (processes_ + kProcessesPerHub - 1) / kProcessesPerHub;
  ports_.emplace(kPortsPerProcess * (processes_ + hubs));
  domain_number_ = options_.domain < 0 ? 0 : static_cast<unsigned>(options_.domain);
  settings_.discovery = dds::configuration::Discovery::neighbours;
  settings_.spdp_interval = kAnnounceEvery;
  settings_.external_domain = domain_number_;
  for (std::size_t hub = 0; hub < hubs; ++hub) {
    settings_.port_base = static_cast<std::uint16_t>(port(hub) - dds::configuration::unicast_port(0));
    const std::string configuration = dds::domain::with_user_configuration(xml(settings_));
    try {
      hubs_.push_back(std::make_unique<Hub>((domain_number_ + static_cast<unsigned>(hub)) % kDomainIds, configuration,
                                            wire::RunKey(options_.key), callbacks));
    } catch (const dds::core::Exception& failure) {
      wire::raise_no_domain(failure, "discovery: neighbours", "start the run again: it looks for free ports anew");
    }
  }
}

std::size_t Hubs::hub_of(std::size_t process) const { return placement_.neighbour_discovery ? process / kProcessesPerHub : 0; }

std::uint16_t Hubs::port(std::size_t slot) const { return static_cast<std::uint16_t>(ports_->first() + kPortsPerProcess * slot); }

std::vector<std::string> Hubs::arguments(std::size_t process, const std::vector<std::size_t>& met) const {
  std::vector<std::string> arguments{"--run",       options_.run_name,        "--domain",           std::to_string(domain_number_),
                                     "--interface", options_.interface,       "--orchestrator-pid", std::to_string(getpid()),
                                     "--build",     wire::Build::own().word()};
  if (placement_.neighbour_discovery) {
    std::string listed = std::to_string(port(hub_of(process)));
    for (const std::size_t other : met) listed += "," + std::to_string(port(hubs_.size() + other));
    arguments.insert(arguments.end(),
                     {"--discovery", "neighbours", "--port", std::to_string(port(hubs_.size() + process)), "--neighbour-ports", listed});
  } else {
    if (settings_.port_base) arguments.insert(arguments.end(), {"--port", std::to_string(*settings_.port_base)});
    if (placement_.multicast_data) arguments.insert(arguments.end(), {"--data", "multicast"});
  }
  if (settings_.tuned) arguments.emplace_back("--tuned");
  if (settings_.transmit_loss > 0.0) arguments.insert(arguments.end(), {"--transport-loss", std::to_string(settings_.transmit_loss)});
  return arguments;
}

void Hubs::broadcast(const Grant& grant) const {
  for (const auto& hub : hubs_) hub->grants.write(grant);
}

void Hubs::broadcast(const wire::Command& command) const {
  for (const auto& hub : hubs_) hub->commands.write(command);
}

void Hubs::assign(const Assignments& assignments, Round now, const std::vector<AgentId>& gone) const {
  for (std::size_t hub = 0; hub < hubs_.size(); ++hub)
    for (const Assignment& part : assignments.agents([&](std::size_t process) { return hub_of(process) == hub; }, now, gone))
      hubs_[hub]->assignments.write(part);
}

void Hubs::assign_plant(const Assignments& assignments, std::size_t process) const {
  for (const PlantAssignment& part : assignments.plant()) hubs_[hub_of(process)]->plant_assignments.write(part);
}

void Hubs::let_commands_arrive() const {
  for (const auto& hub : hubs_) hub->commands.wait_for_acknowledgments(1.0);
}

std::vector<Refusal> Hubs::take_refusals() const {
  std::vector<Refusal> all;
  for (const auto& hub : hubs_)
    for (Refusal& refusal : hub->take_refusals()) all.push_back(std::move(refusal));
  return all;
}

}  // namespace consort
