#pragma once
/// Who hears of whom: announcements travel along the communication graph, passed on by everybody who takes part.

#include "core/network/graph.hpp"
#include "core/network/schedule.hpp"

#include <map>
#include <vector>

namespace consort {

/// From round `since` on, the agent knows what agent `from` announced.
struct Told {
  AgentId from;
  Round since = 0;
  bool operator==(const Told&) const = default;
};

/// By agent: whose announcements reach it over the edges of `support`, ascending, itself left out. What an agent has heard it passes on
/// while it takes part, so news goes round whenever somebody joins.
std::vector<std::vector<Told>> announcements(const Graph& support, const std::map<AgentId, Attendance>& presence);

/// Somebody has to pass on what others announced, as it comes from further away than the next agent, or from one that is no longer there
/// when it is wanted.
bool need_relays(const std::vector<std::vector<Told>>& told, const Graph& support, const std::map<AgentId, Attendance>& presence);

}  // namespace consort
