#pragma once
/// Chains of integrators: single (x' = u), double (x' = v, v' = u) or of any order, in any dimension. Everything is measured.

#include "models/linear.hpp"

namespace consort {

struct Integrator {
  static constexpr std::string_view name = "integrator";
  static constexpr std::string_view summary = "the order-th derivative of the position is u_i; the whole state is measured";
  static constexpr std::array parameters{ValueDoc{"order", "scalar", "1", "1: x' = u; 2: x' = v, v' = u; ..."},
                                         ValueDoc{"dimension", "scalar", "1", "number of coordinates of the position"}};
  static constexpr std::array initial{ValueDoc{"position", "vector dimension", "0", "position"},
                                      ValueDoc{"velocity", "vector dimension", "0", "its first derivative (order 2 and above)"},
                                      ValueDoc{"x", "vector order * dimension", "position, velocity", "the whole state at once"}};

  static std::unique_ptr<PlantModel> make(const PlantSetup& setup) {
    std::vector<LinearPart> parts;
    for (std::size_t i = 0; i < setup.agents; ++i) {
      const Eigen::Index order = whole_parameter(setup.parameters[i], "order", 1, 1, 10);
      const Eigen::Index p = whole_parameter(setup.parameters[i], "dimension", 1, 1, 100);
      const Eigen::Index n = order * p;
      LinearPart part{Matrix::Zero(n, n), Matrix::Zero(n, p), Matrix::Identity(n, n), Vector::Zero(n), {}};
      part.A.topRightCorner(n - p, n - p).setIdentity();
      part.B.bottomRows(p).setIdentity();
      part.x = start(setup.initial[i], order, p);
      constexpr std::array kNames{"position", "velocity", "acceleration"};
      for (Eigen::Index derivative = 0; derivative < order; ++derivative) {
        const auto d = static_cast<std::size_t>(derivative);
        part.layout.fields.push_back(
            {d < kNames.size() ? kNames[d] : "derivative_" + std::to_string(derivative), static_cast<std::size_t>(p), 1});
      }
      parts.push_back(std::move(part));
    }
    return std::make_unique<LinearParts>(std::move(parts), setup.dt);
  }

 private:
  static Vector start(const Values& initial, Eigen::Index n, Eigen::Index p) {
    if (initial.has("x")) {
      if (initial.has("position") || initial.has("velocity"))
        throw ConfigError("initial 'x': it is the whole state; allowed: either x or position and velocity");
      return initial_vector(initial, "x", n * p);
    }
    if (n == 1 && initial.has("velocity")) throw ConfigError("initial 'velocity': a single integrator has none; allowed: position");
    Vector x = Vector::Zero(n * p);
    x.head(p) = initial_vector(initial, "position", p);
    if (n > 1) x.segment(p, p) = initial_vector(initial, "velocity", p);
    return x;
  }
};

}  // namespace consort
