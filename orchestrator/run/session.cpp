#include "orchestrator/run/session.hpp"

#include "core/errors.hpp"
#include "orchestrator/run/host.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <csignal>

namespace consort {
namespace {

constexpr std::chrono::milliseconds kLookAround{20};  // how often children, interrupt and deadline are looked at

RunOptions with_key(RunOptions options) {
  if (options.key.empty()) options.key = wire::RunKey::random_secret();
  return options;
}

Roster roster_of(const Processes& processes) {
  std::vector<Roster::Place> places;
  for (std::size_t p = 0; p < processes.size(); ++p) places.push_back({processes[p].name, processes[p].agents, processes[p].external});
  return {std::move(places), host_name(), wire::Build::own().text()};
}

std::chrono::steady_clock::duration seconds(double count) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(count));
}

}  // namespace

Session::Session(const Experiment& experiment, const RunOptions& options)
    : experiment_(experiment),
      options_(with_key(options)),
      placement_(place_for(experiment, options_)),
      deadline_(Clock::now() + seconds(experiment.deadline)),
      processes_(experiment, placement_, options_),
      roster_(roster_of(processes_)),
      connections_(connect(experiment, options_, placement_, [this](const std::string& remark) { remarks_.add(remark); })),
      hubs_(experiment, options_, placement_, callbacks()) {}

Session::~Session() = default;

Hub::Callbacks Session::callbacks() {
  return {[this](wire::Presence&& presence) { news_.push(std::move(presence)); },
          [this](Layouts&& layouts) { news_.push(std::move(layouts)); },
          [this](wire::Telemetry&& telemetry) { news_.push(std::move(telemetry)); },
          [this](const std::string& sender, bool alive) {
            news_.push(Liveliness{sender, alive});
          }};
}

void Session::grant(const Grant& grant) {
  granted_ = true;
  newest_grant_ = grant;
  hubs_.broadcast(grant);
}

void Session::grant_again() {
  if (granted_ && newest_grant_.start_ns == 0) hubs_.broadcast(newest_grant_);
}

std::vector<std::string> Session::arguments_of(std::size_t process, Round now) const {
  const ProcessState& state = processes_[process];
  std::vector<std::string> arguments = hubs_.wiring().arguments(placement_, process);
  arguments.insert(arguments.end(), {"--build", wire::Build::own().word()});
  for (const Attendance& stay : state.presence.again)
    if (stay.holds(now))
      arguments.insert(arguments.end(), {"--first-epoch", std::to_string(epoch_), "--first-round", std::to_string(stay.from)});
  return arguments;
}

void Session::start(std::size_t process, Round now) {
  ProcessState& state = processes_[process];
  if (state.started) return;
  state.started = true;
  if (state.external) return;
  fleet_->start({state.name, state.host, state.is_plant(), arguments_of(process, now), options_.key});
}

// Before anything is heard of them.
void Session::note_started() {
  for (const Fleet::Started& started : fleet_->take_started())
    roster_.launched(processes_.index_of_name(started.name), static_cast<std::uint64_t>(started.pid), started.host);
}

// Those that are there from the first round on.
void Session::start_first() {
  for (std::size_t p = 0; p < processes_.size() && !interrupted(); ++p)
    if (processes_[p].presence.from == 0) start(p);
  note_started();
}

void Session::launch(RunObserver& observer) {
  fleet_.emplace(options_.log_directory, options_.agent_executable, connections_);
  const std::size_t total = processes_.count([](const ProcessState& state) { return state.presence.from == 0; });
  observer.launching(0, 0, total);
  start_first();
  auto told = Clock::now();
  const auto found = [this] { return processes_.count([](const ProcessState& state) { return state.found; }); };
  while (found() < total && !interrupted()) {
    step({});
    tell_remarks(observer);
    if (Clock::now() - told >= seconds(options_.tell_awaited_seconds)) {
      told = Clock::now();
      tell_awaited(observer);
    }
    observer.launching(found(), 0, total);
  }
}

void Session::call(Round first) {
  hubs_.assign(*assignments_, first, processes_.given_up());  // whoever joins is told who is there by now
  if (const std::vector<AgentId> back = processes_.back_in(first); !back.empty()) {
    processes_.ready_at_most(first);
    hubs_.broadcast(wire::Command{epoch_, wire::Order::come_back, back, first});
  }
  start_present(first);
  broadcast_given_up();  // whoever joins was not there to hear it
}

void Session::start_present(Round k) {
  for (std::size_t p = 0; p < processes_.size(); ++p)
    if (processes_[p].presence.holds(k) && !processes_.is_given_up(p)) start(p, k);
  note_started();
}

void Session::start_for(AgentId agent, Round k) {
  const std::size_t process = placement_.process_of[index_of(agent)];
  if (!processes_.is_given_up(process)) start(process, k);
  note_started();
}

void Session::join(Round first, const OnTelemetry& on_telemetry) {
  call(first);
  const auto waits = [&](const ProcessState& state) {
    return state.started && (state.ready_epoch != epoch_ || state.ready_until <= first);
  };
  while (processes_.count(waits) > 0 && !interrupted()) {
    step(on_telemetry);
    start_present(first);
  }
}

void Session::kill(AgentId agent, const OnTelemetry& on_telemetry) {
  ProcessState& state = processes_[placement_.process_of[index_of(agent)]];
  state.dying = true;
  fleet_->signal(state.name, SIGKILL);
  while (state.started && !interrupted()) step(on_telemetry);
}

void Session::stop(AgentId agent, Seconds duration) {
  const std::string& name = processes_[placement_.process_of[index_of(agent)]].name;
  fleet_->signal(name, SIGSTOP);
  stopped_.push_back({name, Clock::now() + seconds(duration)});
}

void Session::wake_stopped(bool all) {
  std::erase_if(stopped_, [&](const Stopped& stopped) {
    if (!all && Clock::now() < stopped.until) return false;
    fleet_->signal(stopped.process, SIGCONT);
    return true;
  });
}

void Session::assign(const Job& job, std::uint32_t epoch, RunObserver& observer) {
  if (interrupted()) return;
  epoch_ = epoch;
  layouts_.clear();
  granted_ = false;
  processes_.begin_job();
  roster_.open_all();
  assignments_.emplace(experiment_, placement_, job, epoch);
  hubs_.assign(*assignments_, 0, {});
  if (experiment_.plant) hubs_.assign_plant(*assignments_, placement_.processes.size());
  const auto ready = [this] {
    return processes_.count([this](const ProcessState& state) { return state.started && state.ready_epoch == epoch_; });
  };
  while (!interrupted()) {
    start_first();  // who left or died in the job before is needed again, and may be ending only now
    if (ready() == processes_.running() && layouts_.size() >= processes_.agents_running()) break;
    step({});
    if (job.number > 0) continue;
    tell_remarks(observer);
    observer.launching(processes_.running(), ready(), processes_.running());
  }
}

void Session::step(const OnTelemetry& on_telemetry) {
  for (Word& word : news_.take(kLookAround)) {
    if (auto* telemetry = std::get_if<wire::Telemetry>(&word)) {
      remarks_.refused(std::exchange(telemetry->refusals, {}));
      if (on_telemetry) on_telemetry(std::move(*telemetry));
    } else if (auto* layouts = std::get_if<Layouts>(&word)) {
      if (layouts->epoch == epoch_) layouts_[layouts->agent] = std::move(*layouts);
    } else if (const auto* liveliness = std::get_if<Liveliness>(&word)) {
      const auto process = roster_.place_of(liveliness->sender);
      if (process && liveliness->alive)
        silent_.erase(*process);
      else if (process)
        silent_[*process] = Clock::now();
    } else {
      handle(std::move(std::get<wire::Presence>(word)));
    }
  }
  watch_children();
  watch_external();
  wake_stopped(false);
  if (!leaving_ && !failed_ && Clock::now() > deadline_) time_out();
}

std::string Session::who_waits() {
  processes_.forget_status();
  leaving_ = true;  // no second deadline or death report from within this one
  hubs_.broadcast(wire::Command{epoch_, wire::Order::status});
  const auto until = Clock::now() + seconds(1.0);
  const auto silent = [](const ProcessState& state) { return state.started && !state.status; };
  std::vector<wire::Telemetry> kept;
  while (processes_.count(silent) > 0 && Clock::now() < until)
    step([&](wire::Telemetry&& telemetry) { kept.push_back(std::move(telemetry)); });
  leaving_ = false;
  news_.give_back(std::move(kept));
  return processes_.who_waits();
}

const Trace& Session::outline() const {
  const Trace& expected = assignments_->outline();
  for (const auto& [agent, layouts] : layouts_)
    if (layouts.estimate != expected.estimate_layout || layouts.recorded != expected.recorded_layout)
      throw RunError(
          fmt::format("agent {} estimates other quantities than agent 1; all agents of a run must have the same dimension", agent.value));
  return expected;
}

std::vector<std::string> Session::take_remarks() {
  remarks_.refused(hubs_.take_refusals());
  return remarks_.take();
}

void Session::shut_down() {
  leaving_ = true;
  fleet_->wake_all();  // who is asleep, whoever put it there, cannot leave
  hubs_.broadcast(wire::Command{epoch_, wire::Order::shutdown});
  const bool elsewhere = processes_.count([](const ProcessState& state) { return state.external && state.started; }) > 0;
  if (elsewhere) hubs_.let_commands_arrive();
  fleet_->wait_all(interrupted() ? 1.0 : 10.0);
}

}  // namespace consort
