#pragma once
/// Whose outputs an agent finds in its measurement y_i, and where: its own first, then, if the experiment says `sensing: neighbours`, those
/// of everybody who may ever be its in-neighbour.

#include "core/errors.hpp"
#include "protocols/protocol.hpp"

#include <string>

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
    for (Eigen::Index s = 0; s < ids.size(); ++s) {
      const auto id = static_cast<std::size_t>(ids[s]);
      if (place_.size() < id) place_.resize(id, -1);
      place_[id - 1] = s * size_;
    }
  }

  /// Length of one output.
  [[nodiscard]] Eigen::Index output_size() const { return size_; }
  /// y_ii in the measurement of one round.
  [[nodiscard]] Output own(const Sense& sense) const { return output(sense, 0); }
  /// y_ij in the measurement of one round. Throws RunError if the agent does not measure j.
  [[nodiscard]] Output of(AgentId j, const Sense& sense) const {
    if (index_of(j) >= place_.size() || place_[index_of(j)] < 0)
      throw RunError(std::string(protocol_) + ": agent " + std::to_string(self_.value) + " hears agent " + std::to_string(j.value) +
                     " but does not measure it; the plant needs 'sensing: neighbours'");
    return output(sense, place_[index_of(j)]);
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
  std::vector<Eigen::Index> place_;  // by agent: where its output begins; -1: not measured
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
