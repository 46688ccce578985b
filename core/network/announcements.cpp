#include "core/network/announcements.hpp"

#include <algorithm>
#include <set>

namespace consort {
namespace {

using Known = std::vector<std::vector<bool>>;  // [who][of whom]

// Everybody passes on what it knows until nobody learns anything new.
void spread(const Graph& support, const std::vector<bool>& present, Known& known) {
  for (bool news = true; news;) {
    news = false;
    for (std::size_t i = 0; i < present.size(); ++i) {
      if (!present[i]) continue;
      for (const Neighbour& neighbour : support.in_neighbours(agent_at(i))) {
        if (!present[index_of(neighbour.id)]) continue;
        const std::vector<bool>& theirs = known[index_of(neighbour.id)];
        for (std::size_t j = 0; j < theirs.size(); ++j) {
          if (!theirs[j] || known[i][j]) continue;
          known[i][j] = true;
          news = true;
        }
      }
    }
  }
}

Attendance attendance_of(AgentId agent, const std::map<AgentId, Attendance>& presence) {
  const auto at = presence.find(agent);
  return at == presence.end() ? Attendance{} : at->second;
}

}  // namespace

std::vector<std::vector<Told>> announcements(const Graph& support, const std::map<AgentId, Attendance>& presence) {
  const std::size_t n = support.agents();
  std::set<Round> joins{0};
  for (const auto& [agent, attendance] : presence)
    for (const Attendance& stay : attendance.stays()) joins.insert(stay.from);
  Known known(n, std::vector<bool>(n, false)), before = known;
  std::vector<std::vector<Told>> told(n);
  for (const Round k : joins) {
    std::vector<bool> present(n);
    for (std::size_t i = 0; i < n; ++i) {
      present[i] = attendance_of(agent_at(i), presence).holds(k);
      if (present[i]) known[i][i] = true;
    }
    spread(support, present, known);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j)
        if (known[i][j] && !before[i][j] && i != j) told[i].push_back({agent_at(j), k});
    before = known;
  }
  for (auto& list : told) std::sort(list.begin(), list.end(), [](const Told& a, const Told& b) { return a.from < b.from; });
  return told;
}

bool need_relays(const std::vector<std::vector<Told>>& told, const Graph& support, const std::map<AgentId, Attendance>& presence) {
  for (std::size_t i = 0; i < told.size(); ++i) {
    if (told[i].size() > support.in_degree(agent_at(i))) return true;
    for (const Attendance& stay : attendance_of(agent_at(i), presence).stays())
      for (const Told& news : told[i])
        if (news.since <= stay.from && !attendance_of(news.from, presence).holds(stay.from)) return true;
  }
  return false;
}

}  // namespace consort
