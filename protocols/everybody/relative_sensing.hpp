#pragma once
/// Where an agent's measurements of others lie in y_i (`sensing: {relative, absolute}`): for every measured agent j, ascending, the output
/// of j minus its own; then, if it has an absolute measurement, minus its own output. Rows of an agent that is absent are kAbsent.

#include "core/errors.hpp"
#include "core/number_text.hpp"
#include "protocols/protocol.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace consort {

class RelativeSensing {
 public:
  using Output = Eigen::Map<const Vector>;

  /// Throws ConfigError on a plant that measures otherwise.
  RelativeSensing(const Setup& setup, std::string_view protocol) : place_(setup.agents, -1) {
    const bool relative = setup.model.has("relative");
    absolute_ = setup.model.has("absolute");
    const Matrix* C = setup.model.find("C");
    if (C == nullptr)
      throw ConfigError("protocol " + std::string(protocol) + ": agent " + std::to_string(setup.self.value) +
                        " does not know its output matrix C; allowed: a linear plant model");
    size_ = C->rows();
    const Vector ids = relative ? setup.model.vector("relative") : Vector();
    if (static_cast<std::size_t>(size_ * (ids.size() + (absolute_ ? 1 : 0))) != setup.measurement_size)
      throw ConfigError("protocol " + std::string(protocol) + ": agent " + std::to_string(setup.self.value) +
                        " measures itself; allowed: a plant with 'sensing: {relative: ..., absolute: ...}'");
    for (Eigen::Index s = 0; s < ids.size(); ++s) place_.at(static_cast<std::size_t>(ids[s]) - 1) = s * size_;
    absolute_at_ = ids.size() * size_;
  }

  [[nodiscard]] Eigen::Index output_size() const { return size_; }
  [[nodiscard]] bool has_absolute() const { return absolute_; }
  /// Output of j minus the agent's own, if it measures j and j is there.
  [[nodiscard]] std::optional<Output> relative(AgentId j, const Sense& sense) const {
    const Eigen::Index at = place_[index_of(j)];
    if (at < 0) return std::nullopt;
    const Output y = output(sense, at);
    if (std::any_of(y.begin(), y.end(), [](double value) { return is_absent(value); })) return std::nullopt;
    return y;
  }
  /// Minus the agent's own output. The agent must have it.
  [[nodiscard]] Output absolute(const Sense& sense) const { return output(sense, absolute_at_); }

 private:
  [[nodiscard]] Output output(const Sense& sense, Eigen::Index at) const {
    check(sense.y.size() >= static_cast<std::size_t>(at + size_), "a protocol with a plant is given its measurement in every round");
    return {sense.y.data() + at, size_};
  }
  Eigen::Index size_ = 0, absolute_at_ = 0;
  bool absolute_ = false;
  std::vector<Eigen::Index> place_;  // by agent: where its rows begin; -1: not measured
};

/// Rounds that news may be late: the parameter `patience`, 0 without it. `who` begins the text of the ConfigError.
inline Round patience_of(const Values& parameters, const std::string& who) {
  const double rounds = parameters.scalar("patience", 0.0);
  if (!(rounds >= 0.0 && rounds <= 1e6 && rounds == std::floor(rounds)))
    throw ConfigError(who + ": patience is " + number_text(rounds) + "; allowed: a whole number of rounds, 0 to 1000000");
  return static_cast<Round>(rounds);
}

/// A whole, positive id of the agent: the parameter `id`, or its number. Throws ConfigError on another.
inline double unique_id(const Values& parameters, const Setup& setup, std::string_view protocol) {
  const double id = parameters.scalar("id", static_cast<double>(setup.self.value));
  if (!(id >= 1.0 && id <= 1e15 && id == std::floor(id)))
    throw ConfigError("protocol " + std::string(protocol) + ": agent " + std::to_string(setup.self.value) + ": id is " + number_text(id) +
                      "; allowed: a whole number from 1");
  return id;
}

}  // namespace consort
