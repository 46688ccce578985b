#pragma once
/// Coupling gains that belong to the edges an agent hears through.

#include "core/errors.hpp"
#include "protocols/protocol.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <vector>

namespace consort {

/// One gain per in-neighbour that the topology gives in this round. An edge that appears starts anew; one that goes is forgotten.
class EdgeGains {
 public:
  explicit EdgeGains(double start) : start_(start) {}

  /// Brings the edges in step with the round's in-neighbours.
  void match(std::span<const Neighbour> in_neighbours) {
    const auto same = [](const Gain& gain, const Neighbour& neighbour) { return gain.from == neighbour.id; };
    if (std::equal(gains_.begin(), gains_.end(), in_neighbours.begin(), in_neighbours.end(), same)) return;
    std::vector<Gain> matched;
    for (const Neighbour& neighbour : in_neighbours) {
      const auto known = std::find_if(gains_.begin(), gains_.end(), [&](const Gain& gain) { return gain.from == neighbour.id; });
      matched.push_back(known != gains_.end() ? *known : Gain{neighbour.id, start_});
    }
    gains_ = std::move(matched);
  }

  /// The gain of the edge from j; after match(). A delayed message may come over an edge that has gone: its gain counts as the start value,
  /// and is not kept.
  [[nodiscard]] double of(AgentId j) const {
    const auto at = find(j);
    return at != gains_.end() ? at->value : start_;
  }
  void add(AgentId j, double increase) {
    if (const auto at = find(j); at != gains_.end()) gains_[static_cast<std::size_t>(at - gains_.begin())].value += increase;
  }

  /// Smallest, mean and largest gain of the edges there are; the start value without edges.
  [[nodiscard]] Eigen::Vector3d summary() const {
    if (gains_.empty()) return Eigen::Vector3d::Constant(start_);
    double low = gains_.front().value, high = low, sum = 0.0;
    for (const Gain& gain : gains_) {
      low = std::min(low, gain.value);
      high = std::max(high, gain.value);
      sum += gain.value;
    }
    return {low, sum / static_cast<double>(gains_.size()), high};
  }

 private:
  struct Gain {
    AgentId from;
    double value;
  };
  [[nodiscard]] std::vector<Gain>::const_iterator find(AgentId j) const {
    const auto at = std::lower_bound(gains_.begin(), gains_.end(), j, [](const Gain& gain, AgentId id) { return gain.from < id; });
    return at != gains_.end() && at->from == j ? at : gains_.end();
  }
  double start_;
  std::vector<Gain> gains_;  // ascending
};

}  // namespace consort
