#include "rounds/last_round.hpp"

#include <algorithm>

namespace consort {

Round last_round(const Experiment& experiment) {
  if (experiment.presence.size() < experiment.agents) return experiment.rounds;
  Round last = 0;
  for (const auto& [agent, presence] : experiment.presence)
    for (const Attendance& stay : presence.stays())
      if (stay.from <= experiment.rounds) last = std::max(last, stay.until);
  return std::min(last, experiment.rounds);
}

}  // namespace consort
