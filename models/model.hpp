#pragma once
/// The contract of a plant: constant mathematics. Its state, time and noise live outside it (models/physics.hpp).

#include "core/layout.hpp"
#include "core/types.hpp"
#include "core/values.hpp"

#include <span>
#include <vector>

namespace consort {

/// What a model is made from.
struct PlantSetup {
  std::size_t agents = 1;
  Seconds dt = 1.0;                ///< length of a round: the step of advance()
  std::vector<Values> parameters;  ///< by agent
  std::vector<Values> initial;     ///< by agent
};

/// One part per agent, of any size; the state of the whole is the agents' states one after the other, agent 1 first. Or (`shared`) one
/// state that every agent observes, and the part of each is the whole.
class PlantModel {
 public:
  virtual ~PlantModel() = default;
  [[nodiscard]] virtual bool shared() const { return false; }
  [[nodiscard]] virtual const Layout& state_layout(AgentId agent) const = 0;  ///< names of the numbers of its state
  [[nodiscard]] virtual std::size_t control_size(AgentId agent) const = 0;
  [[nodiscard]] virtual std::size_t output_size(AgentId agent) const = 0;
  [[nodiscard]] virtual Vector initial_state(AgentId agent) const = 0;
  /// What an agent may know of its own dynamics: named matrices, such as A, B, C.
  [[nodiscard]] virtual Values knowledge(AgentId agent) const = 0;

  /// The whole plant at one moment.
  struct Whole {
    std::span<const double> x;
    std::span<const char> active;  ///< by agent: 0 where it is absent, and acts on nobody
  };
  /// y = h_i(x), noise-free.
  virtual void output(AgentId agent, Seconds t, const Whole& whole, std::span<double> y) const = 0;

  /// What acts on the plant during one step, held constant: by agent, one after the other.
  struct Input {
    std::span<const double> control;      ///< u
    std::span<const double> disturbance;  ///< d, added to the derivative of the state
    std::span<const char> active;         ///< by agent: 0 where it is absent and its part stands still
  };
  /// Moves the whole state from t to t + dt with u and d held.
  virtual void advance(Seconds t, const Input& input, std::span<double> x) const = 0;

  /// Covariance of the state increment that continuous-time white noise of intensity W (n x n) on agent i's state makes in one step.
  [[nodiscard]] virtual Matrix increment_covariance(AgentId agent, const Matrix& intensity) const = 0;
};

}  // namespace consort
