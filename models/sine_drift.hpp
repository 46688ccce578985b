#pragma once
/// A scalar agent with a drift it does not know: x_i' = a_i sin(x_i) + b_i + u_i. The example that neural protocols are tried on
/// (Das, Lewis 2010; Knotek, thesis, section 4.2).

#include "models/nonlinear.hpp"

#include "core/value_doc.hpp"

#include <array>
#include <cmath>
#include <memory>

namespace consort {

class SineDrift final : public NonlinearParts {
 public:
  static constexpr std::string_view name = "sine_drift";
  static constexpr std::string_view summary = "x_i' = a_i sin(x_i) + b_i + u_i; x_i is measured; RK4";
  static constexpr std::array parameters{ValueDoc{"a", "scalar", "1", "amplitude of the drift"},
                                         ValueDoc{"b", "scalar", "0", "constant drift"},
                                         ValueDoc{"substeps", "scalar", "1", "RK4 steps per round"}};
  static constexpr std::array initial{ValueDoc{"x", "scalar", "0", "initial state x_i(0)"}};

  static std::unique_ptr<PlantModel> make(const PlantSetup& setup) { return std::make_unique<SineDrift>(setup); }

  explicit SineDrift(const PlantSetup& setup)
      : NonlinearParts(initial_states(setup), Layout{{{"x", 1, 1}}}, 1, setup.dt,
                       whole_parameter(setup.parameters.at(0), "substeps", 1, 1, 10'000)) {
    for (const Values& own : setup.parameters) drifts_.push_back({own.scalar("a", 1.0), own.scalar("b", 0.0)});
  }

  /// Nothing: the drift is what the agent has to learn.
  [[nodiscard]] Values knowledge(AgentId) const override { return {}; }

 private:
  struct Drift {
    double a, b;
  };
  static std::vector<Vector> initial_states(const PlantSetup& setup) {
    std::vector<Vector> states;
    for (const Values& own : setup.initial) states.push_back(initial_vector(own, "x", 1));
    return states;
  }
  [[nodiscard]] Vector derivative(AgentId agent, Seconds, const Vector& x, const Vector& u) const override {
    const auto [a, b] = drifts_[index_of(agent)];
    return Vector::Constant(1, a * std::sin(x[0]) + b + u[0]);
  }
  std::vector<Drift> drifts_;
};

}  // namespace consort
