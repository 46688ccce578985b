#pragma once
/// The distributed Luenberger observer, whatever its gains: x_i' = A x_i + L_i (y_i - C_i x_i) + F_i sum_j w_ij (x_j - x_i), in rounds by
/// correcting and predicting (protocols/filters/estimator_network.hpp).

#include "core/math/decompositions.hpp"
#include "protocols/adapter.hpp"
#include "protocols/filters/base.hpp"
#include "protocols/luenberger.hpp"

namespace consort {

struct LuenbergerObserver {
  static constexpr std::array initial{ValueDoc{"x", "vector n", "0", "estimate at the start"}};
  static constexpr std::array design{
      ValueDoc{"Q", "covariance n x n (scalar, diagonal or matrix)", "1", "L_io is the Kalman gain for process noise of this intensity"},
      ValueDoc{"R", "covariance p x p (scalar, diagonal or matrix)", "1", "... and measurement noise of this intensity, > 0"}};

  struct Params {
    std::string_view who;
    ObservedPlant plant;
    Matrix injection;  ///< (I + h L C)^-1 h L, n x p
    Matrix coupling;   ///< F_i, n x n
  };
  struct State {
    Vector x;
    double d = 0.0;  ///< for which S was computed
    Matrix S;
  };
  struct Message {
    Vector x;
    static constexpr std::array<std::string_view, 1> field_names{"x"};
    static constexpr std::string_view noisy_field = "x";
    static auto fields(auto& m) { return std::tie(m.x); }
  };

  /// Q and R of the design, R for p measurements. Throws ConfigError.
  static std::pair<Matrix, Matrix> weights(const Values& values, const ObservedPlant& plant) {
    const Eigen::Index p = plant.C.rows();
    return {values.covariance("Q", plant.A.rows(), 1.0), p == 0 ? Matrix(0, 0) : values.covariance("R", p, 1.0, true)};
  }
  static Params with(std::string_view who, ObservedPlant plant, const ObserverGains& gains, Seconds h) {
    const Matrix damped = Matrix::Identity(plant.A.rows(), plant.A.rows()) + h * gains.L * plant.C;
    return {who, std::move(plant), solve(damped, Matrix(h * gains.L), std::string(who) + ": I + h L C"), gains.F};
  }
  static State init(const Params& p, const Setup& setup) {
    const Eigen::Index n = p.plant.A.rows();
    return {initial_estimate(p.who, setup, n), 0.0, Matrix::Zero(n, n)};
  }
  static Message message(const Params&, const State& s, const Sense&) { return {s.x}; }

  /// State at k + 1: x (n x 1).
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    const Matrix& step = p.plant.step;
    double d = 0.0;
    Vector pull = Vector::Zero(s.x.size());  // sum_j w_ij (x_j - x_i)
    for (const auto& [from, sent, w_ij, heard] : inbox) {
      d += w_ij;
      pull += w_ij * (brought_forward(step, heard.x, sent, sense.k) - s.x);
    }
    if (d > 0.0 && d != s.d) {
      s.d = d;
      s.S = coupling_step(p.coupling, d, sense.dt);
    }
    Vector corrected = s.x + p.injection * (measured(sense) - p.plant.C * s.x);
    if (d > 0.0) corrected += s.S * pull;
    s.x = step * corrected;
  }

  static const Vector& estimate(const State& s) { return s.x; }
};

}  // namespace consort
