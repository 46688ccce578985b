#include "process/meeting.hpp"

#include "core/counted.hpp"

#include <algorithm>
#include <iterator>

namespace consort {
namespace {

void add(std::string& text, const std::string& what) { text += (text.empty() ? "" : ", ") + what; }

}  // namespace

std::vector<AgentId> AgentsMeeting::begin(const Assignment& run, std::span<const MemberTask> tasks) {
  needs_.clear();
  joining_ = run.joining;
  plant_ = run.plant;
  gone_.clear();
  announced_.clear();
  acts_ = acts_ || (run.plant && run.steers);
  std::set<AgentId> wanted;
  for (const MemberTask& task : tasks) {
    const Round first = task.presence.from, last = task.late_readers.empty() ? first : std::max(first, task.late_readers.back());
    needs_.push_back({task.agent, first, last, task.remote_readers, task.told});
    has_readers_ = has_readers_ || task.remote_readers + task.late_readers.size() > 0;
    wanted.insert(task.in_neighbours.begin(), task.in_neighbours.end());
    for (std::uint32_t id = 1; task.hears_everyone && id <= run.agents; ++id) wanted.insert(AgentId{id});
  }
  std::vector<AgentId> added;
  const auto known = [this](AgentId id) { return here(id) || std::binary_search(heard_.begin(), heard_.end(), id); };
  std::copy_if(wanted.begin(), wanted.end(), std::back_inserter(added), [&](AgentId id) { return !known(id); });
  heard_.insert(heard_.end(), added.begin(), added.end());
  std::sort(heard_.begin(), heard_.end());
  return added;
}

bool AgentsMeeting::greeted_by(AgentId agent) {
  const bool wanted = std::binary_search(heard_.begin(), heard_.end(), agent);
  if (wanted) greeted_by_.insert(agent);
  return wanted;
}

void AgentsMeeting::departed(std::span<const AgentId> agents) {
  gone_.insert(agents.begin(), agents.end());
  for (const AgentId agent : agents) greeted_by_.erase(agent);
}

void AgentsMeeting::comes_back(std::span<const AgentId> agents, Round round) {
  for (const AgentId agent : agents) {
    gone_.erase(agent);
    greeted_by_.erase(agent);
    joining_[agent] = round;
  }
}

std::size_t AgentsMeeting::readers_of(AgentId agent) const {
  const auto readers = readers_of_.find(agent);
  return readers == readers_of_.end() ? 0 : readers->second;
}

bool AgentsMeeting::may_greet() const {
  if (needs_.empty() || !greets() || (acts_ && !plant_found_)) return false;
  if (!gone_.empty()) return true;
  return std::all_of(needs_.begin(), needs_.end(), [this](const Need& need) { return readers_of(need.agent) >= need.readers; });
}

bool AgentsMeeting::greeting_needed(Round granted_until) const {
  return greets() && std::any_of(needs_.begin(), needs_.end(), [granted_until](const Need& need) { return need.last >= granted_until; });
}

bool AgentsMeeting::lacks(const Told& told) const {
  return !here(told.from) && !gone_.contains(told.from) && !announced_.contains(told.from);
}

Round AgentsMeeting::met_until() const {
  if (needs_.empty() || (greets() && !may_greet()) || (plant_ && !greeted_by_plant_)) return 0;
  Round until = kNever, first = kNever;  // of this process
  for (const Need& need : needs_) first = std::min(first, need.first);
  for (const Need& need : needs_) {
    for (const Told& told : need.told) {
      if (!lacks(told)) continue;
      if (told.since <= first) return 0;
      until = std::min(until, told.since);
    }
  }
  if (greeted_by_.size() == heard_.size()) return until;
  for (const AgentId agent : heard_) {
    if (!awaits(agent)) continue;
    const auto joining = joining_.find(agent);
    if (joining == joining_.end() || joining->second <= first) return 0;
    until = std::min(until, joining->second);
  }
  return until;
}

std::string AgentsMeeting::unmet() const {
  if (needs_.empty()) return "has no assignment yet";
  std::string text;
  for (const Need& need : needs_) {
    if (const std::size_t found = readers_of(need.agent); gone_.empty() && found < need.readers)
      add(text, "has found " + std::to_string(found) + " of " + counted(need.readers, "reader") + " of agent " +
                    std::to_string(need.agent.value));
    for (const Told& told : need.told)
      if (lacks(told)) add(text, "lacks the announcement of agent " + std::to_string(told.from.value));
  }
  for (const AgentId agent : heard_)
    if (awaits(agent)) add(text, "is not greeted by agent " + std::to_string(agent.value));
  if (acts_ && !plant_found_) add(text, "has not found the plant");
  if (plant_ && !greeted_by_plant_) add(text, "is not greeted by the plant");
  return text;
}

void PlantMeeting::begin(std::vector<std::uint32_t> processes, bool steered) {
  processes_ = std::move(processes);
  steered_ = steered;
}

void PlantMeeting::found(std::uint32_t process, bool there) {
  if (there) {
    found_.insert(process);
  } else {
    found_.erase(process);
    greeted_by_.erase(process);
  }
}

void PlantMeeting::comes_back(std::span<const AgentId> agents) {
  for (const AgentId agent : agents) greeted_by_.erase(agent.value);
}

bool PlantMeeting::greeting_needed(const Next& next, Round granted_until) const {
  return std::any_of(processes_.begin(), processes_.end(), [&](std::uint32_t process) {
    const Round round = next(process);
    return round >= granted_until && round != kNever;
  });
}

Round PlantMeeting::met_until(const Next& next, Round now) const {
  Round until = kNever;
  for (const std::uint32_t process : processes_)
    if (!met(process)) until = std::min(until, next(process));
  return until > now ? until : 0;
}

std::string PlantMeeting::unmet(const Next& next, Round now) const {
  std::string text;
  for (const std::uint32_t process : processes_)
    if (!met(process) && next(process) <= now)
      add(text, std::string(found_.contains(process) ? "is not greeted by" : "has not found") + " the process of agent " +
                    std::to_string(process));
  return text;
}

}  // namespace consort
