#include "orchestrator/run/hubs.hpp"

#include "core/errors.hpp"
#include "idl/dds_failure.hpp"
#include "idl/dds_log.hpp"

#include <chrono>
#include <cmath>

namespace consort {
namespace {

using std::chrono::milliseconds;

constexpr unsigned kDomainIds = 230;
constexpr unsigned kDomainAttempts = 5;
constexpr std::size_t kWriterMemory = std::size_t{1} << 30;  // bytes a writer may hold before a write would wait
constexpr milliseconds kAnnounceEvery{2000};  // neighbours mode: a first announcement may meet a process that is not there yet

}  // namespace

Hubs::Hubs(const Experiment& experiment, const RunOptions& options, const Placement& placement, const Hub::Callbacks& callbacks)
    : options_(options), wiring_(Wiring::of(experiment, options, placement)) {
  wire::DdsLog::of_this_process();  // from here on DDS says to it what it has to say
  if (!wiring_.own_ports && !wiring_.neighbours) shared_.emplace();
  if (!wiring_.open_domain) settings_.tag = options.run_name;
  settings_.interface = options.interface;
  settings_.writer_high_watermark = kWriterMemory;
  settings_.writer_linger = milliseconds(0);
  settings_.transmit_loss = wiring_.transmit_loss;
  // So fast an agent that was started by hand notices a dead orchestrator.
  const milliseconds silence(std::llround(1e3 * experiment.transport.silence));
  settings_.lease_duration = wiring_.by_hand ? silence : dds::configuration::kLongestLease;
  if (wiring_.neighbours)
    open_neighbours(callbacks);
  else
    open_multicast(callbacks);
}

// One hub: everybody finds everybody anyhow. A domain's ports may be somebody else's, so a derived domain has alternatives.
void Hubs::open_multicast(const Hub::Callbacks& callbacks) {
  settings_.data = wiring_.multicast_data ? dds::configuration::Data::multicast : dds::configuration::Data::unicast;
  settings_.hears_multicast_data = false;  // every packet of the agents would wake this process
  settings_.tuned = wiring_.tuned;
  if (wiring_.own_ports) claim_own_ports();
  if (options_.interface != "lo" || settings_.transmit_loss > 0.0) settings_.spdp_interval = dds::configuration::kAnnounceAgain;
  const std::string configuration = dds::domain::with_user_configuration(xml(settings_));
  const bool derived = options_.domain < 0;
  const unsigned first = wiring_.domain;
  for (unsigned attempt = 0;; ++attempt) {
    wiring_.domain = attempt == 0 ? first : (first + 7 * attempt) % Wiring::kDomains;
    if (shared_) sole_.emplace(options_.run_name, options_.key, wiring_.domain);
    try {
      hubs_.push_back(std::make_unique<Hub>(wiring_.domain, configuration, wire::RunKey(options_.key), callbacks));
      if (shared_) shared_->enter(wiring_.domain);
      return;
    } catch (const dds::core::Exception& failure) {
      if (derived && attempt + 1 < kDomainAttempts) continue;
      wire::raise_no_domain(failure, "DDS domain " + std::to_string(wiring_.domain), "allowed: another --domain, or none");
    }
  }
}

// Runs that share a domain's ports cost each other: every packet of one's discovery wakes all processes of the others.
void Hubs::claim_own_ports() {
  try {
    ports_.emplace(wiring_.ports());
    settings_.port_base = wiring_.first_port = ports_->first();
    if (!settings_.tuned) settings_.spdp_interval = kAnnounceEvery;
  } catch (const RunError&) {  // none is free: then those of the domain have to do
    wiring_.own_ports = false;
  }
}

// Every hub and every process has a port of its own in one block, so all can share a domain.
void Hubs::open_neighbours(const Hub::Callbacks& callbacks) {
  if (!options_.ports) ports_.emplace(wiring_.ports());
  wiring_.first_port = options_.ports ? options_.ports->first() : ports_->first();
  settings_.discovery = dds::configuration::Discovery::neighbours;
  settings_.spdp_interval = kAnnounceEvery;
  settings_.external_domain = wiring_.domain;
  for (std::size_t hub = 0; hub < wiring_.hubs; ++hub) {
    settings_.port_base = static_cast<std::uint16_t>(wiring_.port(hub) - dds::configuration::unicast_port(0));
    const std::string configuration = dds::domain::with_user_configuration(xml(settings_));
    try {
      hubs_.push_back(std::make_unique<Hub>((wiring_.domain + static_cast<unsigned>(hub)) % kDomainIds, configuration,
                                            wire::RunKey(options_.key), callbacks));
    } catch (const dds::core::Exception& failure) {
      wire::raise_no_domain(failure, "discovery: neighbours", "start the run again: it looks for free ports anew");
    }
  }
}

void Hubs::broadcast(const Grant& grant) const {
  for (const auto& hub : hubs_) hub->grants.write(grant);
}

void Hubs::broadcast(const wire::Command& command) const {
  for (const auto& hub : hubs_) hub->commands.write(command);
}

void Hubs::assign(const Assignments& assignments, Round now, const std::vector<AgentId>& gone) const {
  for (std::size_t hub = 0; hub < hubs_.size(); ++hub)
    for (const Assignment& part : assignments.agents([&](std::size_t process) { return wiring_.hub_of(process) == hub; }, now, gone))
      hubs_[hub]->assignments.write(part);
}

void Hubs::assign_plant(const Assignments& assignments, std::size_t process) const {
  for (const PlantAssignment& part : assignments.plant()) hubs_[wiring_.hub_of(process)]->plant_assignments.write(part);
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
