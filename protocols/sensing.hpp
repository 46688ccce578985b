#pragma once
/// Whose outputs an agent finds in its measurement y_i, and where: its own first, then, if the experiment says `sensing: neighbours`, those
/// of everybody who may ever be its in-neighbour.

#include "core/errors.hpp"
#include "protocols/protocol.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace consort {

class Sensing {
 public:
  using Output = Eigen::Map<const Vector>;

  /// Throws ConfigError if the agent measures nothing.
  Sensing(const Setup& setup, std::string_view protocol) : protocol_(protocol), self_(setup.self) {
    Vector ids = Vector::Constant(1, setup.self.value);
    if (setup.model.has("sensed")) ids = setup.model.vector("sensed");
    size_ = static_cast<Eigen::Index>(setup.measurement_size) / ids.size();
    if (size_ == 0)
      throw ConfigError("protocol " + std::string(protocol) + ": agent " + std::to_string(setup.self.value) +
                        " measures nothing; allowed: a plant with outputs");
    for (Eigen::Index s = 0; s < ids.size(); ++s) places_.emplace_back(static_cast<std::uint32_t>(ids[s]), s * size_);
    std::sort(places_.begin(), places_.end());
  }

  /// Length of one output.
  [[nodiscard]] Eigen::Index output_size() const { return size_; }
  /// y_ii in the measurement of one round.
  [[nodiscard]] Output own(const Sense& sense) const { return output(sense, 0); }
  /// y_ij in the measurement of one round. Throws RunError if the agent does not measure j.
  [[nodiscard]] Output of(AgentId j, const Sense& sense) const {
    const auto at = std::lower_bound(places_.begin(), places_.end(), std::pair{j.value, Eigen::Index{0}});
    if (at == places_.end() || at->first != j.value)
      throw RunError(std::string(protocol_) + ": agent " + std::to_string(self_.value) + " hears agent " + std::to_string(j.value) +
                     " but does not measure it; the plant needs 'sensing: neighbours'");
    return output(sense, at->second);
  }

 private:
  [[nodiscard]] Output output(const Sense& sense, Eigen::Index at) const {
    if (sense.y.size() < static_cast<std::size_t>(at + size_))
      check(false, "a protocol with a plant is given its measurement in every round");
    return {sense.y.data() + at, size_};
  }

  std::string_view protocol_;
  AgentId self_;
  Eigen::Index size_ = 0;
  std::vector<std::pair<std::uint32_t, Eigen::Index>> places_;  // whose outputs there are, ascending, and where each begins
};

/// What a protocol that takes its x from the plant (n x 1) has in its record before the first measurement: the initial x if one is given,
/// else zero. Throws ConfigError on another length.
inline Vector first_record(const Setup& setup, Eigen::Index n, std::string_view protocol) {
  if (!setup.initial.has("x")) return Vector::Zero(n);
  Vector x = setup.initial.vector("x");
  if (x.size() != n)
    throw ConfigError("protocol " + std::string(protocol) + ": agent " + std::to_string(setup.self.value) +
                      ": found an initial x of length " + std::to_string(x.size()) + "; allowed: the length of what it measures, " +
                      std::to_string(n));
  return x;
}

}  // namespace consort
