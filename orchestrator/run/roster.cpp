#include "orchestrator/run/roster.hpp"

#include "core/counted.hpp"
#include "core/id_list.hpp"

#include <algorithm>
#include <array>

namespace consort {
namespace {

constexpr std::size_t kMostRemembered = 10'000;  // who was refused: somebody may try for ever

std::string ids_of(const std::vector<AgentId>& agents) {
  std::vector<std::uint32_t> ids;
  for (const AgentId agent : agents) ids.push_back(agent.value);
  return to_text(ids);
}

std::string agents_of(const std::vector<AgentId>& agents) {
  return agents.empty() ? "the plant" : noun(agents.size(), "agent") + " " + ids_of(agents);
}

std::string process_of(const Newcomer& newcomer) { return "pid " + std::to_string(newcomer.pid) + " on " + newcomer.host; }

}  // namespace

Roster::Roster(std::vector<Place> places, std::string host, std::string build)
    : places_(std::move(places)),
      host_(std::move(host)),
      build_(std::move(build)),
      holders_(places_.size()),
      launched_(places_.size()),
      launched_on_(places_.size()),
      gone_(places_.size()) {}

std::optional<std::size_t> Roster::place_of(const std::string& id) const {
  const auto at = std::find_if(holders_.begin(), holders_.end(), [&](const auto& holder) { return holder && holder->id == id; });
  return at == holders_.end() ? std::nullopt : std::optional(static_cast<std::size_t>(at - holders_.begin()));
}

Roster::Verdict Roster::judge(const Newcomer& newcomer) {
  if (const auto place = place_of(newcomer.id)) return {Standing::member, *place};
  if (const auto before = former_.find(newcomer.id); before != former_.end()) return {Standing::former, before->second};
  if (const auto before = refused_.find(newcomer.id); before != refused_.end()) return {Standing::refused, 0, before->second};
  const auto at = std::find_if(places_.begin(), places_.end(), [&](const Place& place) { return place.agents == newcomer.agents; });
  const auto place = at == places_.end() ? std::nullopt : std::optional(static_cast<std::size_t>(at - places_.begin()));
  if (std::string why = objection(newcomer, place); !why.empty()) {
    if (refused_.size() >= kMostRemembered) refused_.clear();
    refused_[newcomer.id] = why;
    return {Standing::refused, 0, std::move(why), true};
  }
  holders_[*place] = newcomer;
  return {Standing::member, *place, {}, true};
}

// Why it may not take the place; empty: it may.
std::string Roster::objection(const Newcomer& newcomer, std::optional<std::size_t> place) const {
  if (!newcomer.fits)
    return "it is " + (newcomer.build.empty() ? "of a build that does not say its version" : newcomer.build) + ", this run " + build_ +
           ": install the same build on both";
  if (!place) return misplaced(newcomer);
  const Place& wanted = places_[*place];
  const bool is_child = newcomer.pid == launched_[*place] && newcomer.host == launched_on_[*place];
  if (!wanted.external && !is_child) return not_by_hand(*place);
  if (closed_.contains(*place)) return agents_of(wanted.agents) + " died before, and the run goes on without; nobody can take that place";
  if (const auto& holder = holders_[*place])
    return agents_of(wanted.agents) + (wanted.agents.size() > 1 ? " are" : " is") + " there already: " + process_of(*holder) +
           "; end that process first, or start this one with other ids";
  return {};
}

// The place is for a process that the run itself starts.
std::string Roster::not_by_hand(std::size_t place) const {
  const Place& wanted = places_[place];
  const bool several = wanted.agents.size() > 1;
  if (gone_[place]) {
    constexpr std::array kHow{"left, as the experiment says", "was killed, as the experiment says", "died, and the run goes on without it"};
    constexpr std::array kHowMany{"left, as the experiment says", "were killed, as the experiment says",
                                  "died, and the run goes on without them"};
    const auto how = static_cast<std::size_t>(*gone_[place]);
    return agents_of(wanted.agents) + " " + (several ? kHowMany : kHow).at(how) +
           ": nobody can take that place by hand; where the experiment lets " + (several ? "them" : "it") +
           " come back, `consort run` does";
  }
  return agents_of(wanted.agents) + (several ? " are" : " is") + " started by `consort run` itself" +
         (launched_[place] == 0 ? "" : ", as pid " + std::to_string(launched_[place]) + " on " + launched_on_[place]) +
         ": to start it by hand, name it there: --external " + (wanted.agents.empty() ? "0" : ids_of(wanted.agents));
}

// The run has no such process: which ones it has instead.
std::string Roster::misplaced(const Newcomer& newcomer) const {
  if (newcomer.agents.empty()) return "this run has no plant";
  AgentId last;
  for (const Place& place : places_)
    if (!place.agents.empty()) last = std::max(last, place.agents.back());
  if (newcomer.agents.back() > last) return "this run has agents 1-" + std::to_string(last.value) + ", not " + ids_of(newcomer.agents);
  constexpr std::size_t kNamed = 5;
  std::string processes;
  std::size_t found = 0;
  for (const Place& place : places_) {
    const bool meant = std::any_of(newcomer.agents.begin(), newcomer.agents.end(),
                                   [&](AgentId id) { return std::binary_search(place.agents.begin(), place.agents.end(), id); });
    if (meant && ++found <= kNamed) processes += (processes.empty() ? "" : ", ") + ("--ids " + ids_of(place.agents));
  }
  if (found > kNamed) processes += " and so on";
  return "this run does not place " + agents_of(newcomer.agents) + (newcomer.agents.size() > 1 ? " together" : " alone") + ": start " +
         processes + ", or give the run another `placement: {agents_per_process: ...}` (--agents-per-process)";
}

void Roster::vacate(std::size_t place, Departure how) {
  gone_.at(place) = how;
  if (!holders_[place]) return;
  if (former_.size() >= kMostRemembered) former_.clear();
  former_[holders_[place]->id] = place;
  holders_[place].reset();
}

}  // namespace consort
