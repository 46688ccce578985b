#include "orchestrator/run/session.hpp"

#include "core/errors.hpp"
#include "idl/dds_failure.hpp"
#include "idl/dds_log.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>

namespace consort {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr unsigned kDomains = 100;  // above, the ports of a domain would reach the kernel's ephemeral ones
constexpr unsigned kDomainIds = 230;
constexpr unsigned kDomainAttempts = 5;
constexpr std::uint32_t kPlant = 0;  // its name among the processes
constexpr unsigned kPortsPerProcess = 4;
constexpr std::size_t kProcessesPerHub = 20;
constexpr std::size_t kMembersPerPart = 200;
constexpr std::size_t kTunedFrom = 60;  // processes that all discover each other: slower acknowledgements halve the start-up
constexpr std::size_t kWriterMemory = std::size_t{1} << 30;  // bytes a writer may hold before a write would wait
constexpr milliseconds kAnnounceEvery{2000};  // neighbours mode: a first announcement may meet a process that is not there yet
constexpr milliseconds kExternalLease{2000};  // how fast an agent on another host notices a dead orchestrator, and the other way round
constexpr milliseconds kSecondLook{150};      // a silent process on another host may still be heard again
constexpr milliseconds kLookAround{20};       // how often children, interrupt and deadline are looked at

std::string remark_on(const Refusal& refusal) {
  const std::string writer =
      "participant " + (refusal.writer.empty() ? "unknown" : refusal.writer) + (refusal.who.empty() ? std::string() : ", " + refusal.who);
  if (refusal.reason == Refusal::Reason::malformed)
    return "packets arrive that DDS cannot read: another program uses these ports, or somebody forges them; they are left out and counted";
  if (refusal.reason == Refusal::Reason::key)
    return refusal.who + " has another key than this run: start it with the CONSORT_KEY of this one; what it writes is left out";
  if (refusal.reason == Refusal::Reason::build)
    return refusal.who + " and does not understand this run, which is " + wire::Build::own().text() +
           ": install the same build on both; what it writes is left out";
  if (refusal.reason == Refusal::Reason::bound)
    return "samples of " + refusal.topic + " by " + writer + " break a bound of the wire (" + refusal.field + ") and are left out";
  return "a stranger takes part, who does not know the run's key: " + writer + "; what it writes, first to " + refusal.topic +
         ", is left out and counted";
}

std::string host_name() {
  std::array<char, 64> name{};
  gethostname(name.data(), name.size() - 1);
  return name.data();
}

/// That this host is short of processor time, where it is.
std::string too_busy() {
  constexpr double kBusy = 2.0;  // of what its processors can do
  double load = 0.0;
  const auto processors = std::max(sysconf(_SC_NPROCESSORS_ONLN), 1L);
  if (getloadavg(&load, 1) != 1 || load < kBusy * static_cast<double>(processors)) return {};
  char text[160];
  std::snprintf(text, sizeof text,
                "; this host is busy (load %.0f on %ld processor%s): run less at once, or give it a later `stop: {deadline: ...}`", load,
                processors, processors == 1 ? "" : "s");
  return text;
}

unsigned domain_of(const std::string& run_name) { return static_cast<unsigned>(Purpose(run_name).hash % kDomains); }

}  // namespace

Session::Session(const Experiment& experiment, const RunOptions& options)
    : experiment_(experiment),
      options_(options),
      placement_(place(experiment)),
      deadline_(Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(experiment.deadline))) {
  for (std::size_t p = 0; p < placement_.processes.size(); ++p) {
    const ProcessPlan& plan = placement_.processes[p];
    ProcessState state;
    state.name = "agent-" + std::to_string(plan.agents.front().value);
    if (plan.agents.size() > 1) state.name += "-" + std::to_string(plan.agents.back().value);
    state.external = options_.by_hand(plan.agents);
    state.presence = plan.presence;
    states_.push_back(state);
    process_by_name_[plan.agents.front().value] = p;
  }
  if (has_plant()) {
    ProcessState state;
    state.name = "plant";
    state.external = options_.external_plant;
    states_.push_back(state);
    process_by_name_[kPlant] = plant();
  }
  std::vector<Roster::Place> places;
  for (std::size_t p = 0; p < slots(); ++p)
    places.push_back({states_[p].name, p == plant() ? std::vector<AgentId>{} : placement_.processes[p].agents, states_[p].external});
  roster_.emplace(std::move(places), host_name(), wire::Build::own().text());
  wire::DdsLog::of_this_process();  // from here on DDS says to it what it has to say
  if (options_.key.empty()) options_.key = wire::RunKey::random_secret();
  // Listed addresses are those of this host's processes: whoever is elsewhere is found by multicast.
  const bool elsewhere = !options_.external.empty() || options_.external_plant || options_.interface != "lo";
  if (elsewhere && experiment_.discovery == Discovery::automatic) placement_.neighbour_discovery = false;
  // `discovery: multicast` asks for the domain's well-known ports, where other programs may look on.
  private_ports_ = !elsewhere && experiment_.discovery == Discovery::automatic && !placement_.neighbour_discovery;
  if (!private_ports_ && !placement_.neighbour_discovery) shared_.emplace();
  open_hubs();
}

Session::~Session() = default;

void Session::open_hubs() {
  settings_.tag = options_.run_name;
  settings_.interface = options_.interface;
  settings_.writer_high_watermark = kWriterMemory;
  settings_.writer_linger = milliseconds(0);
  settings_.transmit_loss = experiment_.transport.loss;
  settings_.lease_duration = !options_.external.empty() || options_.external_plant ? kExternalLease : dds::configuration::kLongestLease;
  const Hub::Callbacks callbacks{[this](wire::Presence&& presence) { push(std::move(presence)); },
                                 [this](wire::Layouts&& layouts) { push(std::move(layouts)); },
                                 [this](wire::Telemetry&& telemetry) { push(std::move(telemetry)); },
                                 [this](const std::string& sender, bool alive) {
                                   push(Liveliness{sender, alive});
                                 }};
  if (placement_.neighbour_discovery)
    open_neighbour_hubs(callbacks);
  else
    open_multicast_hub(callbacks);
}

/// One hub: everybody finds everybody anyhow. A domain's ports may be somebody else's, so a derived domain has alternatives.
void Session::open_multicast_hub(const Hub::Callbacks& callbacks) {
  settings_.data = placement_.multicast_data ? dds::configuration::Data::multicast : dds::configuration::Data::unicast;
  settings_.hears_multicast_data = false;  // every packet of the agents would wake this process
  settings_.tuned = slots() > kTunedFrom;
  if (private_ports_) take_private_ports();
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

/// Runs that share a domain's ports cost each other: every packet of one's discovery wakes all processes of the others.
void Session::take_private_ports() {
  try {
    ports_.emplace(kPortsPerProcess);
    settings_.port_base = ports_->first();
    if (!settings_.tuned) settings_.spdp_interval = kAnnounceEvery;
  } catch (const RunError&) {  // none is free: then those of the domain have to do
    private_ports_ = false;
  }
}

/// Every hub and every process has a port of its own in one block, so all can share a domain.
void Session::open_neighbour_hubs(const Hub::Callbacks& callbacks) {
  const std::size_t hubs = (slots() + kProcessesPerHub - 1) / kProcessesPerHub;
  ports_.emplace(kPortsPerProcess * (slots() + hubs));
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

std::size_t Session::hub_of(std::size_t process) const { return placement_.neighbour_discovery ? process / kProcessesPerHub : 0; }

std::uint16_t Session::port(std::size_t slot) const { return static_cast<std::uint16_t>(ports_->first() + kPortsPerProcess * slot); }

void Session::broadcast(const wire::Grant& grant) {
  granted_ = true;
  for (const auto& hub : hubs_) hub->grants.write(grant);
}

void Session::broadcast(const wire::Command& command) {
  for (const auto& hub : hubs_) hub->commands.write(command);
}

void Session::push(News&& news) {
  const std::lock_guard lock(mutex_);
  news_.push_back(std::move(news));
  if (news_.size() == 1) arrived_.notify_one();
}

std::vector<std::string> Session::arguments_of(std::size_t process, Round now) const {
  std::vector<std::string> arguments{"--run",       options_.run_name,        "--domain",           std::to_string(domain_number_),
                                     "--interface", options_.interface,       "--orchestrator-pid", std::to_string(getpid()),
                                     "--build",     wire::Build::own().word()};
  std::vector<std::size_t> met;  // processes it meets
  if (process == plant()) {
    for (std::size_t p = 0; p < plant(); ++p) met.push_back(p);
  } else {
    const ProcessPlan& plan = placement_.processes[process];
    arguments.insert(arguments.end(),
                     {"--ids", std::to_string(plan.agents.front().value) + "-" + std::to_string(plan.agents.back().value)});
    met = plan.neighbours;
    if (has_plant()) met.push_back(plant());
  }
  if (placement_.neighbour_discovery) {
    std::string listed = std::to_string(port(hub_of(process)));
    for (const std::size_t other : met) listed += "," + std::to_string(port(hubs_.size() + other));
    arguments.insert(arguments.end(),
                     {"--discovery", "neighbours", "--port", std::to_string(port(hubs_.size() + process)), "--neighbour-ports", listed});
  } else {
    if (settings_.port_base) arguments.insert(arguments.end(), {"--port", std::to_string(*settings_.port_base)});
    if (placement_.multicast_data) arguments.insert(arguments.end(), {"--data", "multicast"});
  }
  for (const Attendance& stay : states_[process].presence.again)
    if (stay.holds(now))
      arguments.insert(arguments.end(), {"--first-epoch", std::to_string(epoch_), "--first-round", std::to_string(stay.from)});
  if (settings_.tuned) arguments.emplace_back("--tuned");
  if (settings_.transmit_loss > 0.0) arguments.insert(arguments.end(), {"--transport-loss", std::to_string(settings_.transmit_loss)});
  return arguments;
}

bool Session::all_among(const std::set<std::uint32_t>& names) const {
  return std::all_of(process_by_name_.begin(), process_by_name_.end(),
                     [&](const auto& process) { return !states_[process.second].started || names.contains(process.first); });
}

Round Session::least(const std::map<std::uint32_t, Round>& rounds) const {
  Round least = Attendance{}.until;
  for (const auto& [name, index] : process_by_name_) {
    if (!states_[index].started) continue;
    const auto at = rounds.find(name);
    least = std::min(least, at == rounds.end() ? 0 : at->second);
  }
  return least;
}

std::size_t Session::processes() const {
  return count([](const ProcessState& state) { return state.started; });
}

void Session::start(std::size_t process, Round now) {
  ProcessState& state = states_[process];
  if (state.started) return;
  state.started = true;
  if (state.external) return;
  const auto executable = process == plant() ? options_.agent_executable.parent_path() / "consort-plant" : options_.agent_executable;
  const pid_t pid = children_->start(state.name, executable, arguments_of(process, now), {{wire::RunKey::kVariable, options_.key}});
  roster_->launched(process, static_cast<std::uint64_t>(pid));
}

void Session::launch(RunObserver& observer) {
  children_.emplace(options_.log_directory);
  const std::size_t total = count([](const ProcessState& state) { return state.presence.from == 0; });
  observer.launching(0, 0, total);
  for (std::size_t p = 0; p < slots(); ++p) {
    if (states_[p].presence.from == 0) start(p);
    if (interrupted()) return;
  }
  const auto found = [](const ProcessState& state) { return state.found; };
  auto told = Clock::now();
  while (count(found) < total && !interrupted()) {
    step({});
    tell_remarks(observer);
    if (Clock::now() - told >= std::chrono::duration<double>(options_.tell_awaited_seconds)) {
      told = Clock::now();
      tell_awaited(observer);
    }
    observer.launching(count(found), 0, total);
  }
}

void Session::call(Round first) {
  std::vector<AgentId> back;
  for (std::size_t p = 0; p < slots(); ++p)
    for (const Attendance& stay : states_[p].presence.again)
      if (stay.from == first) back.push_back(placement_.processes[p].agents.front());
  for (std::size_t hub = 0; hub < hubs_.size(); ++hub)  // whoever joins is told who is there by now
    for (const wire::Assignment& part : assignments(hub, first)) hubs_[hub]->assignments.write(part);
  if (!back.empty()) {
    for (ProcessState& state : states_) state.ready_until = std::min(state.ready_until, first);
    broadcast(wire::Command{epoch_, wire::Order::come_back, back, first});
  }
  start_present(first);
  if (!gone_.empty()) broadcast(wire::Command{epoch_, wire::Order::departed, gone_});  // whoever joins was not there to hear it
}

bool Session::is_lost(std::size_t process) const {
  return process != plant() && std::binary_search(gone_.begin(), gone_.end(), placement_.processes[process].agents.front());
}

void Session::start_present(Round k) {
  for (std::size_t p = 0; p < slots(); ++p)
    if (states_[p].presence.holds(k) && !is_lost(p)) start(p, k);
}

void Session::start_for(AgentId agent, Round k) {
  const std::size_t process = placement_.process_of[index_of(agent)];
  if (!is_lost(process)) start(process, k);
}

void Session::join(Round first, const std::function<void(wire::Telemetry&&)>& on_telemetry) {
  call(first);
  const auto waits = [&](const ProcessState& state) {
    return state.started && (state.ready_epoch != epoch_ || state.ready_until <= first);
  };
  while (count(waits) > 0 && !interrupted()) {
    step(on_telemetry);
    start_present(first);
  }
}

void Session::kill(AgentId agent, const std::function<void(wire::Telemetry&&)>& on_telemetry) {
  ProcessState& state = states_[placement_.process_of[index_of(agent)]];
  state.dying = true;
  children_->signal(state.name, SIGKILL);
  while (state.started && !interrupted()) step(on_telemetry);
}

void Session::stop(AgentId agent, Seconds duration) {
  const std::string& name = states_[placement_.process_of[index_of(agent)]].name;
  children_->signal(name, SIGSTOP);
  stopped_.push_back({name, Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(duration))});
}

void Session::wake_stopped(bool all) {
  std::erase_if(stopped_, [&](const Stopped& stopped) {
    if (!all && Clock::now() < stopped.until) return false;
    children_->signal(stopped.process, SIGCONT);
    return true;
  });
}

bool Session::killed_in(AgentId agent, Round round) const {
  return std::any_of(experiment_.faults.begin(), experiment_.faults.end(),
                     [&](const Fault& fault) { return fault.kind == Fault::Kind::kill && fault.agent == agent && fault.round == round; });
}

wire::Delivery Session::delivery() const {
  constexpr double kDeadlineRounds = 3.0;
  const Transport& transport = experiment_.transport;
  return {transport.reliable, transport.history, transport.lifespan.value_or(experiment_.dt),
          transport.dds_deadline.value_or(kDeadlineRounds * experiment_.dt), transport.liveliness_lease};
}

wire::Member Session::member_of(AgentId agent, Round now) const {
  const std::size_t process = placement_.process_of[index_of(agent)];
  wire::Member member;
  member.agent = agent;
  member.process = placement_.processes[process].agents.front().value;
  member.initial = experiment_.initial_of(agent, job_.seed);
  if (const auto own = experiment_.overrides.find(agent); own != experiment_.overrides.end()) member.parameters = own->second.parameters;
  member.hears_everyone = hears_everyone(placement_, agent);
  if (!member.hears_everyone) {
    for (const Neighbour& neighbour : placement_.support.in_neighbours(agent)) member.in_neighbours.push_back(neighbour.id);
  }
  const std::vector<Attendance> stays = experiment_.presence_of(agent).stays();
  const auto stay = std::find_if(stays.begin(), stays.end(), [now](const Attendance& each) { return each.until > now; });
  member.presence = stay == stays.end() ? stays.back() : *stay;
  if (killed_in(agent, member.presence.until)) member.presence.until = Attendance{}.until;  // nobody knows the hour
  const Round begins = std::max(now, placement_.processes[process].presence.from);          // of its process
  for (const std::size_t reader : placement_.readers[index_of(agent)])
    for (const Attendance& there : placement_.processes[reader].presence.stays()) {
      if (there.from > begins)
        member.late_readers.push_back(there.from);
      else if (there.until > begins)
        ++member.remote_readers;
    }
  std::sort(member.late_readers.begin(), member.late_readers.end());
  if (const auto& physics = maker_->physics()) {
    member.model = physics->knowledge(agent);
    member.measurements = static_cast<std::uint32_t>(physics->measurement_size(agent));
    member.distances = static_cast<std::uint32_t>(physics->distance_count(agent));
  }
  if (!told_.empty()) member.told = told_[index_of(agent)];
  member.link_changes = experiment_.links_of(experiment_.protocols[job_.protocol]).changes_into(agent);
  return member;
}

/// What one hub's processes are told: its agents only, in parts of bounded size.
std::vector<wire::Assignment> Session::assignments(std::size_t hub, Round now) const {
  const ProtocolChoice& protocol = experiment_.protocols[job_.protocol];
  wire::Assignment common;
  common.epoch = epoch_;
  common.seed = job_.seed;
  common.protocol = protocol.name;
  common.agents = static_cast<std::uint32_t>(experiment_.agents);
  common.dt = experiment_.dt;
  common.rounds = experiment_.rounds;
  common.report_interval = experiment_.report_interval();
  common.window = wire::largest_window(common.report_interval);
  common.parameters = protocol.parameters;
  const LinkModel& links = experiment_.links_of(protocol);
  common.standard_link = links.standard;
  for (const LinkModel::Change& change : links.changes)
    if (!change.edge) common.link_changes.push_back(change);
  if (maker_->physics()) common.largest_state = static_cast<std::uint32_t>(maker_->physics()->state_layout().size());
  common.largest_control = static_cast<std::uint32_t>(maker_->largest_control());
  common.relays = need_relays(told_, placement_.support, experiment_.presence);
  common.plant = has_plant();
  common.steers = steers_;
  common.recorded = experiment_.recording.state;
  common.realtime = experiment_.mode == Mode::realtime;
  common.tells_links = common.realtime || experiment_.on_agent_loss == AgentLoss::go_on;
  common.delivery = delivery();
  for (const auto& [agent, presence] : experiment_.presence)
    if (!presence.holds(now)) common.joining.emplace(agent, presence.next(now));
  for (const AgentId agent : gone_) common.joining[agent] = kNever;
  std::vector<wire::Assignment> parts;
  for (std::size_t index = 0; index < experiment_.agents; ++index) {
    if (hub_of(placement_.process_of[index]) != hub) continue;
    if (parts.empty() || parts.back().members.size() == kMembersPerPart) {
      parts.push_back(common);
      parts.back().part = static_cast<std::uint32_t>(parts.size() - 1);
    }
    parts.back().members.push_back(member_of(agent_at(index), now));
  }
  for (wire::Assignment& part : parts) part.parts = static_cast<std::uint32_t>(parts.size());
  return parts;
}

/// What the plant is told, in parts of bounded size.
std::vector<wire::PlantAssignment> Session::plant_assignments(const Job& job, std::uint32_t epoch) const {
  PlantTask task = plant_task(experiment_, job.seed);
  std::vector<PlantPart> all = std::exchange(task.parts, {});
  std::vector<wire::PlantAssignment> parts;
  for (std::size_t index = 0; index < all.size(); ++index) {
    if (parts.empty() || parts.back().agents.size() == kMembersPerPart) {
      wire::PlantAssignment part;
      part.part = static_cast<std::uint32_t>(parts.size());
      part.epoch = epoch;
      part.rounds = experiment_.rounds;
      part.report_interval = experiment_.report_interval();
      part.steered = steers_;
      part.realtime = experiment_.mode == Mode::realtime;
      part.delivery = delivery();
      part.task = task;
      parts.push_back(std::move(part));
    }
    parts.back().agents.push_back(agent_at(index));
    parts.back().process_of.push_back(placement_.processes[placement_.process_of[index]].agents.front().value);
    parts.back().task.parts.push_back(std::move(all[index]));
  }
  for (wire::PlantAssignment& part : parts) part.parts = static_cast<std::uint32_t>(parts.size());
  return parts;
}

void Session::assign(const Job& job, std::uint32_t epoch, RunObserver& observer) {
  if (interrupted()) return;
  epoch_ = epoch;
  job_ = job;
  layouts_.clear();
  granted_ = false;
  gone_.clear();
  roster_->open_all();
  maker_.emplace(experiment_, experiment_.protocols[job_.protocol], job.seed);
  protocol_ = &find_protocol(experiment_.protocols[job_.protocol].name);
  told_.clear();
  if (protocol_->announces) told_ = announcements(placement_.support, experiment_.presence);
  steers_ = has_plant() && maker_->make(agent_at(0))->control_size() > 0;
  for (std::size_t hub = 0; hub < hubs_.size(); ++hub) {
    for (const wire::Assignment& part : assignments(hub, 0)) hubs_[hub]->assignments.write(part);
  }
  if (has_plant())
    for (const wire::PlantAssignment& part : plant_assignments(job, epoch)) hubs_[hub_of(plant())]->plant_assignments.write(part);
  const auto ready = [&](const ProcessState& state) { return state.started && state.ready_epoch == epoch; };
  const auto expected = [this] {
    std::size_t agents = 0;
    for (std::size_t p = 0; p < plant(); ++p) agents += states_[p].started ? placement_.processes[p].agents.size() : 0;
    return agents;
  };
  while (!interrupted()) {
    for (std::size_t p = 0; p < slots(); ++p)
      if (states_[p].presence.from == 0) start(p);  // who left or died in the job before is needed again, and may be ending only now
    if (count(ready) == processes() && layouts_.size() >= expected()) break;
    step({});
    if (job.number == 0) tell_remarks(observer);
    if (job.number == 0) observer.launching(processes(), count(ready), processes());
  }
}

void Session::step(const std::function<void(wire::Telemetry&&)>& on_telemetry) {
  std::deque<News> news;
  {
    std::unique_lock lock(mutex_);
    arrived_.wait_for(lock, kLookAround, [&] { return !news_.empty(); });
    news.swap(news_);
  }
  for (News& item : news) {
    if (auto* telemetry = std::get_if<wire::Telemetry>(&item)) {
      note(std::exchange(telemetry->refusals, {}));
      if (on_telemetry) on_telemetry(std::move(*telemetry));
    } else if (auto* layouts = std::get_if<wire::Layouts>(&item)) {
      if (layouts->epoch == epoch_) layouts_[layouts->agent] = std::move(*layouts);
    } else if (const auto* liveliness = std::get_if<Liveliness>(&item)) {
      if (const auto process = roster_->place_of(liveliness->sender))
        states_[*process].silent_since = liveliness->alive ? std::nullopt : std::optional(Clock::now());
    } else {
      handle(std::move(std::get<wire::Presence>(item)));
    }
  }
  watch_children();
  watch_external();
  wake_stopped(false);
  if (!leaving_ && !failed_ && Clock::now() > deadline_) time_out();
}

std::optional<std::size_t> Session::admit(const wire::Presence& presence) {
  const std::optional<wire::Card>& card = presence.sender.card;
  const wire::Build own = wire::Build::own();
  const Roster::Verdict verdict = roster_->judge({presence.sender.guid, presence.agents, presence.host, presence.pid,
                                                  !card || card->build.fits(own), card ? card->build.text() : std::string()});
  const std::string who = "pid " + std::to_string(presence.pid) + " on " + presence.host;
  if (verdict.standing == Roster::Standing::member && verdict.first) warn_of_sources(presence);
  switch (verdict.standing) {
    case Roster::Standing::former:
      return std::nullopt;
    case Roster::Standing::member:
      if (presence.state == wire::State::hello && states_[verdict.place].external)
        answer({epoch_, wire::Order::welcome, {}, 0, presence.sender.guid});
      return verdict.place;
    case Roster::Standing::refused:
      break;
  }
  if (verdict.first) remarks_.push_back("a process (" + who + ") may not take part: " + verdict.why);
  if (presence.state == wire::State::hello) answer({epoch_, wire::Order::refused, {}, 0, presence.sender.guid, verdict.why});
  return std::nullopt;
}

/// It understands this run, and is let in.
void Session::warn_of_sources(const wire::Presence& presence) {
  const std::optional<wire::Card>& card = presence.sender.card;
  const wire::Build own = wire::Build::own();
  if (!card || own.same_sources(card->build) || !other_sources_.emplace(card->build.commit, presence.host).second) return;
  remarks_.push_back(presence.sender.who + " is built of commit " + card->build.commit + ", this run of " + own.commit +
                     ": they understand each other, but may compute differently; build or install all programs together (others of that " +
                     "commit on that host are not named)");
}

/// Who comes late is given the newest command alone, so who is gone has to be said again.
void Session::answer(const wire::Command& command) {
  broadcast(command);
  if (!gone_.empty()) broadcast(wire::Command{epoch_, wire::Order::departed, gone_});
}

void Session::handle(wire::Presence&& presence) {
  const auto process = admit(presence);
  if (!process) return;
  ProcessState& state = states_[*process];
  state.found = true;
  state.where = "pid " + std::to_string(presence.pid) + " on " + presence.host;
  switch (presence.state) {
    case wire::State::hello:
      break;
    case wire::State::ready:
      state.ready_epoch = presence.epoch;
      state.ready_until = presence.round;
      break;
    case wire::State::status:
      state.status = std::move(presence);
      break;
    case wire::State::failed:
      if (failed_ || may_lose(*process)) break;  // its process ends by itself
      throw RunError(state.name + " (" + state.where + ") failed: " + presence.note);
    case wire::State::leaving:
      if (!leaving_ && !failed_ && !leaves(*process) && !may_lose(*process))
        throw RunError(state.name + " (" + state.where + ") left in round " + std::to_string(presence.round));
      if (state.external) {
        state.started = state.found = false;
        state.ready_epoch = 0;
        roster_->vacate(*process, Roster::Departure::left);
      }
      break;
  }
}

void Session::watch_children() {
  if (!children_ || leaving_) return;
  while (const auto death = children_->next_death()) {
    const auto state = std::find_if(states_.begin(), states_.end(), [&](const ProcessState& each) { return each.name == death->name; });
    const auto process = static_cast<std::size_t>(state - states_.begin());
    const bool left = state->dying || (death->signal == 0 && death->exit_code == 0 && leaves(process));
    roster_->vacate(process, state->dying ? Roster::Departure::killed : left ? Roster::Departure::left : Roster::Departure::died);
    state->started = state->found = state->dying = false;
    state->ready_epoch = 0;
    if (left || failed_) continue;
    if (!may_lose(process)) throw RunError(death->text());
    lose(process, death->text());
  }
}

/// Who is not launched from here, and silent, is dead; but not if this very host has slept, which a moment shows.
void Session::watch_external() {
  if (leaving_) return;
  for (std::size_t p = 0; p < slots(); ++p) {
    ProcessState& state = states_[p];
    if (!state.external || !state.started || !state.silent_since || Clock::now() - *state.silent_since < kSecondLook) continue;
    const std::string text = state.name + " (" + state.where + ") gives no sign of life any more";
    state.silent_since.reset();
    roster_->vacate(p, Roster::Departure::died);
    state.started = state.found = false;
    state.ready_epoch = 0;
    if (failed_) continue;
    if (!may_lose(p)) throw RunError(text);
    lose(p, text);
  }
}

/// The process ends by itself in the course of the run.
bool Session::leaves(std::size_t process) const {
  const std::vector<Attendance> stays = states_[process].presence.stays();
  return process != plant() && std::any_of(stays.begin(), stays.end(), [&](const Attendance& stay) {
           return stay.until <= experiment_.rounds && !killed_in(placement_.processes[process].agents.front(), stay.until);
         });
}

/// The run goes on without this process, if it dies now.
bool Session::may_lose(std::size_t process) const {
  return experiment_.on_agent_loss == AgentLoss::go_on && granted_ && process != plant();
}

void Session::lose(std::size_t process, const std::string& text) {
  const std::vector<AgentId>& agents = placement_.processes[process].agents;
  roster_->close(process);
  gone_.insert(gone_.end(), agents.begin(), agents.end());
  std::sort(gone_.begin(), gone_.end());
  losses_.push_back({agents, text});
  if (count([](const ProcessState& state) { return state.started; }) <= (has_plant() ? 1u : 0u))
    throw RunError("every agent is gone; the last one: " + text);
  broadcast(wire::Command{epoch_, wire::Order::departed, gone_});
}

std::string Session::names(const std::function<bool(const ProcessState&)>& which) const {
  constexpr std::size_t kNamed = 12;
  std::string text;
  std::size_t found = 0;
  for (const ProcessState& state : states_) {
    if (!which(state)) continue;
    if (++found <= kNamed) text += (text.empty() ? "" : ", ") + state.name;
  }
  if (found > kNamed) text += " and " + std::to_string(found - kNamed) + " more";
  return text;
}

std::size_t Session::count(const std::function<bool(const ProcessState&)>& which) const {
  return static_cast<std::size_t>(std::count_if(states_.begin(), states_.end(), which));
}

std::string Session::who_waits() {
  for (ProcessState& state : states_) state.status.reset();
  leaving_ = true;  // no second deadline or death report from within this one
  broadcast(wire::Command{epoch_, wire::Order::status});
  const auto until = Clock::now() + std::chrono::seconds(1);
  const auto silent = [](const ProcessState& state) { return state.started && !state.status; };
  std::vector<wire::Telemetry> kept;
  while (count(silent) > 0 && Clock::now() < until) step([&](wire::Telemetry&& telemetry) { kept.push_back(std::move(telemetry)); });
  leaving_ = false;
  {
    const std::lock_guard lock(mutex_);
    for (auto item = kept.rbegin(); item != kept.rend(); ++item) news_.emplace_front(std::move(*item));
  }
  std::string text;
  const auto add = [&text](const std::string& part) { text += (text.empty() ? "" : "; ") + part; };
  for (const ProcessState& state : states_) {
    if (state.status && !state.status->note.empty()) add(state.name + " " + state.status->note);
    if (!state.status || state.status->waiting_for.empty()) continue;
    std::string whom;
    for (const AgentId agent : state.status->waiting_for) whom += " " + std::to_string(agent.value);
    add("agent " + std::to_string(state.status->waiting_agent.value) + " waits in round " + std::to_string(state.status->round) + " for" +
        whom);
    if (text.size() > 1000) {
      add("...");
      break;
    }
  }
  if (const std::string unanswered = names(silent); !unanswered.empty()) add("no answer from " + unanswered);
  return text.empty() ? "every process answers and none waits for a message" : text;
}

/// Whoever waits for a long time is told for whom, and what can be done about it.
void Session::tell_awaited(RunObserver& observer) const {
  const auto absent = [](const ProcessState& state) { return state.started && !state.found; };
  const std::string by_hand = names([&](const ProcessState& state) { return absent(state) && state.external; });
  const std::string launched = names([&](const ProcessState& state) { return absent(state) && !state.external; });
  if (!by_hand.empty()) observer.remark("still waiting for " + by_hand + ", to be started by hand, by the lines that this run has printed");
  if (!launched.empty()) observer.remark("still waiting for " + launched + ", which this run has started");
}

void Session::time_out() {
  char limit[32];
  std::snprintf(limit, sizeof limit, "%g s", experiment_.deadline);
  std::string text = "deadline of " + std::string(limit) + " passed";
  const auto absent = [](const ProcessState& state) { return state.started && !state.found; };
  const std::string lost = names(absent);
  const bool nobody_started_them = !lost.empty() && std::all_of(states_.begin(), states_.end(), [&](const ProcessState& state) {
    return !absent(state) || state.external;
  });
  const std::string unready = names([&](const ProcessState& state) { return state.started && state.ready_epoch != epoch_; });
  if (!lost.empty())
    text += " before everybody was there; never appeared: " + lost;
  else if (!unready.empty())
    text += "; these did not meet their neighbours: " + unready + "; " + who_waits();
  else
    text += "; " + who_waits();
  if (granted_) early_remarks_.clear();
  for (std::string& remark : take_remarks()) early_remarks_.push_back(std::move(remark));
  for (const std::string& remark : early_remarks_) text += "; " + remark;
  if (nobody_started_them)
    text += "; to be started by hand (--external), by the lines that this run has printed";
  else if (shared_ && shared_->with_others())
    text += "; other runs on this host use DDS domain " + std::to_string(domain_number_) +
            " and cost this one time: give each a --domain of its own, or leave out --domain and `discovery: multicast`";
  else
    text += too_busy();
  throw TimeoutError(text);
}

RunLayouts Session::layouts() const {
  RunLayouts expected = layouts_of(experiment_, experiment_.protocols[job_.protocol], *maker_);
  for (const auto& [agent, layouts] : layouts_)
    if (layouts.estimate != expected.estimate || layouts.recorded != expected.recorded)
      throw RunError("agent " + std::to_string(agent.value) + " estimates other quantities than agent 1; all agents of a run must have the " +
                     "same dimension");
  return expected;
}

/// Adds to what was refused; the first time that somebody's samples are, it is worth a remark.
void Session::note(std::vector<Refusal> refusals) {
  for (Refusal& refusal : refusals) {
    const auto known = std::find_if(refusals_.begin(), refusals_.end(), [&](const Refusal& each) { return each.same(refusal); });
    if (known != refusals_.end()) {
      known->samples += refusal.samples;
      continue;
    }
    const bool is_new = std::none_of(refusals_.begin(), refusals_.end(),
                                     [&](const Refusal& each) { return each.writer == refusal.writer && each.reason == refusal.reason; });
    if (is_new) remarks_.push_back(remark_on(refusal));
    refusals_.push_back(std::move(refusal));
  }
}

std::vector<std::string> Session::take_remarks() {
  for (const auto& hub : hubs_) note(hub->take_refusals());
  return std::exchange(remarks_, {});
}

void Session::tell_remarks(RunObserver& observer) {
  constexpr std::size_t kMost = 10;
  for (std::string& remark : take_remarks()) {
    observer.remark(remark);
    if (early_remarks_.size() < kMost) early_remarks_.push_back(std::move(remark));
  }
}

void Session::shut_down() {
  leaving_ = true;
  children_->wake_all();  // who is asleep, whoever put it there, cannot leave
  broadcast(wire::Command{epoch_, wire::Order::shutdown});
  const bool elsewhere = count([](const ProcessState& state) { return state.external && state.started; }) > 0;
  for (const auto& hub : hubs_)
    if (elsewhere) hub->commands.wait_for_acknowledgments(1.0);
  children_->wait_all(interrupted() ? 1.0 : 10.0);
}

}  // namespace consort
