#pragma once
/// Metrics of agents that average: theory promises them a value, and they may follow a leader without a plant.

#include "core/metrics/steering.hpp"
#include "protocols/predicted_value.hpp"

#include <array>

namespace consort {

inline constexpr std::array kVotingMetrics{
    predicted_value(averaged_value, averaged_value_names),
    MetricEntry{"leader_error", "largest final distance from the leader, the only agent that never hears anybody", distance_from_leader,
                distance_from_leader_name}};

}  // namespace consort
