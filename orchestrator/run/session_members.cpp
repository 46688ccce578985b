// Who comes into a session, and how it goes: the part of it that admits, answers, watches and gives up.

#include "core/errors.hpp"
#include "orchestrator/run/host.hpp"
#include "orchestrator/run/session.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace consort {
namespace {

bool is_awaited(const ProcessState& state) { return state.started && !state.found; }

}  // namespace

std::optional<std::size_t> Session::admit(const wire::Presence& presence) {
  const std::optional<wire::Card>& card = presence.sender.card;
  const Roster::Verdict verdict = roster_.judge({presence.sender.guid, presence.agents, presence.host, presence.pid,
                                                 !card || card->build.fits(wire::Build::own()), card ? card->build.text() : std::string()});
  const std::string who = fmt::format("pid {} on {}", presence.pid, presence.host);
  const bool says_hello = presence.state == wire::State::hello;
  switch (verdict.standing) {
    case Roster::Standing::former:
      return std::nullopt;
    case Roster::Standing::member:
      if (verdict.first && card) remarks_.let_in(card->build, presence.sender.who, presence.host);
      if (says_hello && processes_[verdict.place].external) answer({epoch_, wire::Order::welcome, {}, 0, presence.sender.guid});
      return verdict.place;
    case Roster::Standing::refused:
      break;
  }
  if (verdict.first) remarks_.add("a process (" + who + ") may not take part: " + verdict.why);
  if (says_hello) answer({epoch_, wire::Order::refused, {}, 0, presence.sender.guid, verdict.why});
  return std::nullopt;
}

// Who comes late is given the newest command alone, so who is gone has to be said again.
void Session::answer(const wire::Command& command) {
  hubs_.broadcast(command);
  broadcast_given_up();
}

void Session::broadcast_given_up() {
  if (!processes_.given_up().empty()) hubs_.broadcast(wire::Command{epoch_, wire::Order::departed, processes_.given_up()});
}

void Session::handle(wire::Presence&& presence) {
  const auto process = admit(presence);
  if (!process) return;
  const wire::State said = presence.state;
  const std::string note = presence.note;
  const Round round = presence.round;
  processes_.hears(*process, std::move(presence));
  const ProcessState& state = processes_[*process];
  const bool may_fail = failed_ || may_lose(*process);
  if (said == wire::State::failed && !may_fail)  // else its process ends by itself
    throw RunError(fmt::format("{} ({}) failed: {}", state.name, state.where, note));
  if (said != wire::State::leaving) return;
  if (!leaving_ && !state.leaves && !may_fail) {
    const std::string text = fmt::format("{} ({}) left in round {}", state.name, state.where, round);
    if (state.external) throw RunError(text);
    early_.try_emplace(*process, Clock::now(), text);
  }
  if (state.external) is_gone(*process, Roster::Departure::left);
}

void Session::is_gone(std::size_t process, Roster::Departure how) {
  roster_.vacate(process, how);
  processes_.is_gone(process);
  silent_.erase(process);
}

void Session::watch_children() {
  if (!fleet_ || leaving_) return;
  constexpr std::chrono::seconds kPatience{2};  // who has said that it leaves is about to end; how it does, or its connection, says why
  for (const auto& [process, word] : early_)
    if (Clock::now() - word.first > kPatience) throw RunError(word.second);
  while (const auto death = fleet_->next_death()) {
    const std::size_t process = processes_.index_of_name(death->name);
    const bool killed = processes_[process].dying;
    const bool left = death->signal == 0 && death->exit_code == 0 && processes_[process].leaves;
    is_gone(process, killed ? Roster::Departure::killed : left ? Roster::Departure::left : Roster::Departure::died);
    if (killed || left) continue;
    const auto said = early_.find(process);
    lose(process, said != early_.end() && death->how.empty() ? said->second.second : death->text());
  }
}

// Who is not launched from here, and silent for longer than the run allows, is dead. DDS has told of the silence when it had lasted for a
// lease of its Presence.
void Session::watch_external() {
  if (leaving_) return;
  const Seconds silence = experiment_.transport.silence;
  for (std::size_t p = 0; p < processes_.size(); ++p) {
    const ProcessState& state = processes_[p];
    const auto silent = silent_.find(p);
    if (!state.external || !state.started || silent == silent_.end() ||
        Clock::now() - silent->second < std::chrono::duration<double>(silence - wire::kSignOfLifeLease))
      continue;
    is_gone(p, Roster::Departure::died);
    lose(p, fmt::format("{} ({}) has given no sign of life for {:g} s (transport.silence)", state.name, state.where, silence));
  }
}

// The run goes on without this process, if it dies now.
bool Session::may_lose(std::size_t process) const {
  return experiment_.on_agent_loss == AgentLoss::go_on && granted_ && !processes_[process].is_plant();
}

// A process has died unplanned.
void Session::lose(std::size_t process, const std::string& text) {
  if (failed_) return;
  if (!may_lose(process)) throw RunError(text);
  roster_.close(process);
  processes_.give_up(process);
  losses_.push_back({processes_[process].agents, text});
  if (processes_.running() <= (experiment_.plant ? 1u : 0u)) throw RunError("every agent is gone; the last one: " + text);
  broadcast_given_up();
}

void Session::tell_remarks(RunObserver& observer) {
  constexpr std::size_t kMost = 10;
  for (std::string& remark : take_remarks()) {
    observer.remark(remark);
    if (early_remarks_.size() < kMost) early_remarks_.push_back(std::move(remark));
  }
}

// Whoever waits for a long time is told for whom, and what can be done about it.
void Session::tell_awaited(RunObserver& observer) const {
  const std::string by_hand = processes_.names([](const ProcessState& state) { return is_awaited(state) && state.external; });
  const std::string launched = processes_.names([](const ProcessState& state) { return is_awaited(state) && !state.external; });
  if (!by_hand.empty()) observer.remark("still waiting for " + by_hand + ", to be started by hand, by the lines that this run has printed");
  if (!launched.empty()) observer.remark("still waiting for " + launched + ", which this run has started");
}

void Session::time_out() {
  std::string text = fmt::format("deadline of {:g} s passed", experiment_.deadline);
  const std::string absent = processes_.names(is_awaited);
  const std::string launched = processes_.names([](const ProcessState& state) { return is_awaited(state) && !state.external; });
  const std::string unready = processes_.names([&](const ProcessState& state) { return state.started && state.ready_epoch != epoch_; });
  if (!absent.empty())
    text += " before everybody was there; never appeared: " + absent;
  else if (!unready.empty())
    text += "; these did not meet their neighbours: " + unready + "; " + who_waits();
  else
    text += "; " + who_waits();
  if (granted_) early_remarks_.clear();
  for (std::string& remark : take_remarks()) early_remarks_.push_back(std::move(remark));
  for (const std::string& remark : early_remarks_) text += "; " + remark;
  if (!absent.empty() && launched.empty())
    text += "; to be started by hand (--external), by the lines that this run has printed";
  else if (hubs_.share_domain())
    text += fmt::format(
        "; other runs on this host use DDS domain {} and cost this one time: give each a --domain of its own, or leave out --domain and "
        "`discovery: multicast`",
        hubs_.domain());
  else if (const std::string busy = too_busy(); !busy.empty())
    text += "; " + busy;
  throw TimeoutError(text);
}

}  // namespace consort
