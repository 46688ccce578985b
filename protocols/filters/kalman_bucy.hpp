#pragma once
/// The centralised filter as a benchmark: every agent filters with its own measurement and those of its in-neighbours, and nothing else.
/// On a complete graph, or in the middle of a star, that is all measurements there are, and nothing linear does better.
///
///     xhat' = A xhat + K (y - C xhat),   K = P C'R^-1                                                                (3.4a), (3.4b)
///     P'    = A P + P A' + Q - P C'R^-1 C P                                                                                  (3.4c)
///
/// with C, R those of J_i = {i} and the in-neighbours, and Q for Psi Q Psi'. As independent measurements add up, C'R^-1 y = sum_j u_j and
/// C'R^-1 C = sum_j U_j, u_j = C_j'R_j^-1 y_j, U_j = C_j'R_j^-1 C_j: the message of j is u_j and U_j, of one size whatever j measures, and
/// nobody needs to know C_j or R_j.
/// Source: Knotek, thesis, (3.4); the transpose in (3.4c) is lost in its text, A P + P A' is meant.
/// x is corrected, then predicted, with the Kalman gain for measurements held over the round; P moves through the round without an error of
/// integration (protocols/filters/riccati_step.hpp), stably at every dt, and its stationary value is that of (3.4c). P is honest: the
/// covariance of the error if the noises have the intensities Q and R, but for terms of first order in dt.
/// Assumes: noises independent of each other; (A, C) detectable, C of J_i.
/// A missing message, or one that comes late (its measurement is of an older state), is a measurement that was not made: P_i grows by it.
/// Weights of edges are not used. Link noise disturbs u_j, and P_i does not know of it. An agent without a sensor sends zeros.

#include "protocols/adapter.hpp"
#include "protocols/filters/base.hpp"
#include "protocols/filters/riccati_step.hpp"
#include "protocols/filters/theory.hpp"

namespace consort {

struct KalmanBucy {
  static constexpr std::string_view name = "kalman_bucy";
  static constexpr std::string_view summary = "the centralised Kalman-Bucy filter: everybody filters with all measurements it is sent";
  static constexpr std::string_view source = "Knotek, thesis, (3.4)";
  static constexpr std::string_view assumptions =
      "one plant seen by all; (A, C) detectable with the measurements of i and its in-neighbours";
  static constexpr bool needs_plant = true;
  static constexpr Truth truth = Truth::state;
  static constexpr auto examine = examine_kalman_bucy;
  static constexpr std::array parameters = kFilterParameters;
  static constexpr std::array initial = kFilterInitial;
  static constexpr std::array estimate_values = kFilterEstimate;

  using Params = FilterParams;
  struct State {
    FilterState filter;
    Matrix U;  ///< for which `riccati` was made
    RiccatiStep riccati;
  };
  struct Message {
    Vector u;
    Matrix U;
    static constexpr std::array<std::string_view, 2> field_names{"u", "U"};
    static constexpr std::string_view noisy_field = "u";
    static auto fields(auto& m) { return std::tie(m.u, m.U); }
  };

  static Params params(const Values& values, const Setup& setup) { return filter_params(name, values, setup); }
  static State init(const Params& p, const Setup& setup) {
    return {initial_filter_state(name, p, setup), p.sensor.U, RiccatiStep(p.plant.A, p.sensor.U, p.Q, setup.dt)};
  }
  static Message message(const Params& p, const State&, const Sense& sense) { return {sensed(p.sensor, sense), p.sensor.U}; }

  /// State at k + 1: x (n x 1), P (n x n).
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    Vector u = sensed(p.sensor, sense);
    Matrix U = p.sensor.U;
    for (const auto& [from, sent, weight, heard] : inbox) {
      if (sent != sense.k) continue;
      u += heard.u;
      U += heard.U;
    }
    s.filter.x() = p.plant.step * (s.filter.x() + corrected_by(u, U, s.filter.covariance(), s.filter.x(), sense.dt));
    if (U != s.U) {
      s.riccati = RiccatiStep(p.plant.A, U, p.Q, sense.dt);
      s.U = std::move(U);
    }
    s.filter.covariance() = s.riccati(s.filter.covariance());
  }

  /// x and P.
  static const Vector& estimate(const State& s) { return s.filter.both(); }
  static std::vector<Field> estimate_fields(const State& s) { return s.filter.fields(); }
};

}  // namespace consort
