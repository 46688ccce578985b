#include "orchestrator/run/processes.hpp"

#include "orchestrator/run/ending.hpp"
#include "orchestrator/run/spread.hpp"

#include <algorithm>

namespace consort {
namespace {

ProcessState state_of(const Experiment& experiment, const ProcessPlan& plan, const RunOptions& options) {
  ProcessState state;
  state.name = "agent-" + std::to_string(plan.agents.front().value);
  if (plan.agents.size() > 1) state.name += "-" + std::to_string(plan.agents.back().value);
  state.agents = plan.agents;
  state.external = options.by_hand(plan.agents);
  state.presence = plan.presence;
  const std::vector<Attendance> stays = plan.presence.stays();
  state.leaves = std::any_of(stays.begin(), stays.end(), [&](const Attendance& stay) {
    return stay.until <= experiment.rounds && !killed_in(experiment, plan.agents.front(), stay.until);
  });
  return state;
}

bool is_silent(const ProcessState& state) { return state.started && !state.status; }

}  // namespace

Processes::Processes(const Experiment& experiment, const Placement& placement, const RunOptions& options) {
  for (const ProcessPlan& plan : placement.processes) states_.push_back(state_of(experiment, plan, options));
  if (experiment.plant) {
    ProcessState plant;
    plant.name = "plant";
    plant.external = options.external_plant;
    states_.push_back(std::move(plant));
  }
  for (std::size_t p = 0; p < placement.host_of.size(); ++p) {
    const std::size_t host = placement.host_of[p];
    if (host == kHere || options.hosts[host].launcher == Launcher::local) continue;
    states_[p].host = host;
    states_[p].external = states_[p].external || options.hosts[host].launcher == Launcher::manual;
  }
}

std::size_t Processes::index_of_name(const std::string& name) const {
  const auto state = std::find_if(states_.begin(), states_.end(), [&](const ProcessState& each) { return each.name == name; });
  return static_cast<std::size_t>(state - states_.begin());
}

std::size_t Processes::count(const Which& which) const {
  return static_cast<std::size_t>(std::count_if(states_.begin(), states_.end(), which));
}

std::string Processes::names(const Which& which) const {
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

std::size_t Processes::agents_running() const {
  std::size_t agents = 0;
  for (const ProcessState& state : states_) agents += state.started ? state.agents.size() : 0;
  return agents;
}

void Processes::hears(std::size_t process, wire::Presence&& presence) {
  ProcessState& state = states_[process];
  state.found = true;
  state.where = "pid " + std::to_string(presence.pid) + " on " + presence.host;
  if (presence.state == wire::State::ready) {
    state.ready_epoch = presence.epoch;
    state.ready_until = presence.round;
  }
  if (presence.state == wire::State::status) state.status = std::move(presence);
}

void Processes::is_gone(std::size_t process) {
  ProcessState& state = states_[process];
  state.started = state.found = state.dying = false;
  state.ready_epoch = 0;
}

void Processes::give_up(std::size_t process) {
  const std::vector<AgentId>& agents = states_[process].agents;
  given_up_.insert(given_up_.end(), agents.begin(), agents.end());
  std::sort(given_up_.begin(), given_up_.end());
}

bool Processes::is_given_up(std::size_t process) const {
  const ProcessState& state = states_[process];
  return !state.is_plant() && std::binary_search(given_up_.begin(), given_up_.end(), state.agents.front());
}

std::vector<AgentId> Processes::back_in(Round round) const {
  std::vector<AgentId> back;
  for (const ProcessState& state : states_)
    for (const Attendance& stay : state.presence.again)
      if (stay.from == round) back.push_back(state.agents.front());
  return back;
}

void Processes::ready_at_most(Round round) {
  for (ProcessState& state : states_) state.ready_until = std::min(state.ready_until, round);
}

bool Processes::all_among(const std::set<std::uint32_t>& ids) const {
  return std::all_of(states_.begin(), states_.end(), [&](const ProcessState& state) { return !state.started || ids.contains(state.id()); });
}

Round Processes::least(const std::map<std::uint32_t, Round>& rounds) const {
  Round least = kNever;
  for (const ProcessState& state : states_) {
    if (!state.started) continue;
    const auto at = rounds.find(state.id());
    least = std::min(least, at == rounds.end() ? 0 : at->second);
  }
  return least;
}

void Processes::forget_status() {
  for (ProcessState& state : states_) state.status.reset();
}

std::string Processes::who_waits() const {
  constexpr std::size_t kLongest = 1000;
  std::string text;
  const auto add = [&text](const std::string& part) { text += (text.empty() ? "" : "; ") + part; };
  for (const ProcessState& state : states_) {
    if (state.status && !state.status->note.empty()) add(state.name + " " + state.status->note);
    if (!state.status || state.status->waiting_for.empty()) continue;
    std::string whom;
    for (const AgentId agent : state.status->waiting_for) whom += " " + std::to_string(agent.value);
    add("agent " + std::to_string(state.status->waiting_agent.value) + " waits in round " + std::to_string(state.status->round) + " for" +
        whom);
    if (text.size() <= kLongest) continue;
    add("...");
    break;
  }
  if (const std::string unanswered = names(is_silent); !unanswered.empty()) add("no answer from " + unanswered);
  return text.empty() ? "every process answers and none waits for a message" : text;
}

}  // namespace consort
