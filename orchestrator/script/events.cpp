#include "orchestrator/script/events.hpp"

#include "core/counted.hpp"
#include "orchestrator/script/disturbances.hpp"
#include "orchestrator/script/settings.hpp"
#include "orchestrator/script/wording.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace consort::script {
namespace {

const std::set<std::string> kProcessEvents{"join", "leave", "kill", "restart", "stop", "continue"};
const std::vector<std::string> kEvents{"cut", "heal", "set_link", "degrade", "join", "leave", "kill", "restart", "stop", "continue"};

// What may happen next to an agent that is in some condition, and what that makes of it.
enum class Condition { before, there, left, killed, stopped };
std::optional<Condition> after(Condition now, const std::string& kind) {
  if (kind == "join") return now == Condition::before || now == Condition::left ? std::optional(Condition::there) : std::nullopt;
  if (kind == "restart") return now == Condition::killed ? std::optional(Condition::there) : std::nullopt;
  if (kind == "continue") return now == Condition::stopped ? std::optional(Condition::there) : std::nullopt;
  if (now != Condition::there) return std::nullopt;
  return kind == "leave" ? Condition::left : kind == "kill" ? Condition::killed : Condition::stopped;
}

const std::map<std::string, Fault::Kind> kFaults{
    {"kill", Fault::Kind::kill}, {"restart", Fault::Kind::restart}, {"stop", Fault::Kind::stop}, {"continue", Fault::Kind::proceed}};
const std::map<Condition, std::string> kAllowed{{Condition::before, "join"},
                                                {Condition::there, "leave, kill or stop"},
                                                {Condition::left, "join"},
                                                {Condition::killed, "restart"},
                                                {Condition::stopped, "continue"}};

}  // namespace

void Events::read(const YAML::Node& node) {
  if (!node.IsSequence()) {
    mistakes_.add(node, fmt::format("events: found {}; allowed: a list such as [{{round: 150, cut: [1 -> 2]}}]", describe(node)));
    return;
  }
  for (std::size_t i = 0; i < node.size(); ++i) {
    const std::string what = fmt::format("events[{}]", i);
    const Section section(mistakes_, node[i], what, "/definitions/event");
    if (!section.is_map()) continue;
    const auto round = read_round(section, node[i], what);
    std::vector<std::string> found;
    for (const std::string& key : kEvents)
      if (present(section.find(key))) found.emplace_back(key);
    if (found.size() != 1) {
      mistakes_.add(node[i], fmt::format("{}: found {}; allowed: exactly one of {}", what, listed(found), listed(kEvents)));
      continue;
    }
    const YAML::Node value = section.find(found[0]);
    if (kProcessEvents.contains(found[0]))
      read_process_event(value, section.path(found[0]), round, found[0]);
    else if (!round)
      continue;
    else if (found[0] == "set_link")
      link_changes_.read(mistakes_, value, section.path(found[0]), *round, out_);
    else if (found[0] == "degrade")
      degradations_.push_back({value, section.path(found[0]), *round});
    else
      out_.link_events.push_back(read_link_event(mistakes_, value, section.path(found[0]), *round, found[0] == "heal", out_.agents));
  }
  order_process_events(node);
  link_changes_.apply(out_.links);
  check_presence(node);
}

// In which round an event is; nothing where that is a mistake, which is told.
std::optional<Round> Events::read_round(const Section& section, const YAML::Node& node, const std::string& what) {
  const auto round = section.find("round"), time = section.find("time");
  if (present(round) == present(time)) {
    mistakes_.add(node, fmt::format("{}: found {}; allowed: exactly one of 'round' and 'time'", what,
                                    present(round) ? "both 'round' and 'time'" : "neither 'round' nor 'time'"));
    return std::nullopt;
  }
  if (present(round)) {
    const auto value = read_whole(mistakes_, round, what + ".round", 0, last_);
    return value ? std::optional(static_cast<Round>(*value)) : std::nullopt;
  }
  const auto seconds = read_duration(mistakes_, time, what + ".time", true);
  const auto at = seconds ? whole_rounds(mistakes_, time, what + ".time", first_round_from(*seconds / out_.dt), 0, out_.dt) : std::nullopt;
  if (!at || *at <= last_) return at;
  mistakes_.add(time, fmt::format("{}: found {}, which is round {}; allowed: within the run's {}", what + ".time", describe(time), *at,
                                  counted(out_.rounds, "round")));
  return std::nullopt;
}

// `join: 5` or `leave: [2, 3]`.
void Events::read_process_event(const YAML::Node& node, const std::string& what, std::optional<Round> round, const std::string& kind) {
  const YAML::Node list = node.IsSequence() ? node : YAML::Node(std::vector<YAML::Node>{node});
  for (const auto& entry : list) {
    const auto id = whole_number(entry);
    if (!id || *id < 1 || *id > out_.agents) {
      mistakes_.add(node,
                    fmt::format("{}: found {}; allowed: an agent from 1 to {}, or a list of agents", what, describe(entry), out_.agents));
      continue;
    }
    const AgentId agent{static_cast<std::uint32_t>(*id)};
    if (round == Round{0})
      mistakes_.add(node, fmt::format("{}: found agent {} in round 0; allowed: after round 0", what, *id));
    else if (round)
      process_events_[agent].push_back({*round, kind, node});
    if (!round || *round == 0) unordered_.insert(agent);
  }
}

// Each agent's events in order become its stays and what happens to its process.
void Events::order_process_events(const YAML::Node& node) {
  for (auto& [agent, events] : process_events_)
    // Where an event of its own has a mistake, nobody knows whether the others follow from it.
    if (!unordered_.contains(agent)) follow(agent, events, node);
  std::stable_sort(out_.faults.begin(), out_.faults.end(), [](const Fault& a, const Fault& b) { return a.round < b.round; });
}

void Events::follow(AgentId agent, std::vector<EventOfProcess>& events, const YAML::Node& node) {
  std::stable_sort(events.begin(), events.end(), [](const auto& a, const auto& b) { return a.round < b.round; });
  Condition now = events.front().kind == "join" ? Condition::before : Condition::there;
  std::vector<Attendance> stays;
  if (now == Condition::there) stays.push_back({});
  Round last = 0;
  for (const auto& event : events) {
    const auto next = after(now, event.kind);
    if (!next || event.round == last) {
      mistakes_.add(
          event.node,
          fmt::format("events: found '{}' of agent {} in round {}{}; allowed: {}, in a later round than what happened to it before",
                      event.kind, agent.value, event.round, next ? ", where something else happens to it" : "", kAllowed.at(now)));
      return;
    }
    if (*next == Condition::there && now != Condition::stopped) {
      // Whoever would come as the run ends (it was shortened on the command line) has no round to take part in, and does not come.
      const bool too_late = event.round == out_.rounds;
      stays.push_back({event.round + (too_late ? 1u : 0u), Attendance{}.until});
    }
    if (*next == Condition::left || *next == Condition::killed) stays.back().until = event.round;
    if (const auto fault = kFaults.find(event.kind); fault != kFaults.end()) out_.faults.push_back({event.round, agent, fault->second});
    now = *next;
    last = event.round;
  }
  if (now == Condition::stopped)
    mistakes_.add(node,
                  fmt::format("events: found that agent {0} is stopped and never goes on; allowed: a later `continue: {0}`", agent.value));
  if (stays.size() == 1 && stays.front() == Attendance{}) return;
  Attendance& presence = out_.presence[agent] = stays.front();
  presence.again.assign(stays.begin() + 1, stays.end());
}

void Events::check_presence(const YAML::Node& node) {
  const bool someone = std::any_of(out_.presence.begin(), out_.presence.end(), [](const auto& item) { return item.second.from == 0; });
  if (!out_.presence.empty() && out_.presence.size() == out_.agents && !someone)
    mistakes_.add(node, "events: found that every agent joins later; allowed: at least one agent is there from the start");
}

void Events::read_degradations(const std::filesystem::path& directory, Places& places) {
  for (const auto& [node, what, round] : degradations_) read_degradation(mistakes_, node, what, round, directory, out_, places);
}

}  // namespace consort::script
