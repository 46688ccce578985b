#pragma once
/// Every agent runs a Kalman-Bucy filter on what it measures itself and moves towards its neighbours' estimates, the less sure it is, the
/// faster.
///
///     xhat_i' = A xhat_i + K_i (y_i - C_i xhat_i) + gamma P_i sum_j w_ij (xhat_j - xhat_i),   K_i = P_i C_i'R_i^-1     (3.6a), (3.6b)
///     P_i'    = A P_i + P_i A' + Q - P_i C_i'R_i^-1 C_i P_i                                                                    (3.6c)
///
/// `aggregated: 1` (Remark 4): C_i, R_i, y_i are those of all of J_i = {i} and the in-neighbours. They arrive as u_j = C_j'R_j^-1 y_j and
/// U_j = C_j'R_j^-1 C_j, which add up; without it the message is xhat_j alone.
/// Source: Olfati-Saber et al. as printed in Knotek, thesis, (3.6) and Remark 4; the transpose in (3.6c) is lost in its text.
/// x is corrected and predicted in rounds (protocols/filters/estimator_network.hpp); `consort validate` says how long they may be: a large
/// gamma makes neighbours jump to each other's estimates, which never meet on an even ring. P_i moves through a round without an error of
/// integration (protocols/filters/riccati_step.hpp). P_i is not the covariance of the error: (3.6c) knows nothing of what the neighbours
/// contribute, nor that errors are correlated through the common process noise and the coupling. P_i is what the agent would have alone
/// (with aggregated measurements: with those alone), so the error is usually smaller than P_i says and its NEES lies below its bounds.
/// Assumes: undirected connected graph; gamma large enough; (A, C_i) detectable for every i: else P_i grows without bound.
/// A missing message is an absent term for that round, in the sum over neighbours and among the aggregated measurements. A late xhat_j is
/// moved on with the plant; a late measurement is not used. Weights scale the coupling, not the measurements. Link noise disturbs xhat_j.
/// An agent without a sensor (C_i = 0) only predicts and follows its neighbours.

#include "protocols/adapter.hpp"
#include "protocols/filters/base.hpp"
#include "protocols/filters/riccati_step.hpp"
#include "protocols/filters/theory.hpp"

namespace consort {

struct DkfOlfatiSaber {
  static constexpr std::string_view name = "dkf_olfati_saber";
  static constexpr std::string_view summary = "a Kalman-Bucy filter of one's own that moves towards the neighbours' estimates";
  static constexpr std::string_view source = "Knotek, thesis, (3.6), Remark 4 (Olfati-Saber et al.)";
  static constexpr std::string_view assumptions = "one plant seen by all; undirected, connected; (A, C_i) detectable; gamma large enough";
  static constexpr bool needs_plant = true;
  static constexpr Truth truth = Truth::state;
  static constexpr auto examine = examine_dkf_olfati_saber;
  static constexpr std::array parameters =
      joined(kFilterParameters, std::array{ValueDoc{"gamma", "scalar", "", "coupling gain, 1 / (unit of x^2 s), > 0"},
                                           ValueDoc{"aggregated", "0 or 1", "0", "1: filter with the in-neighbours' measurements too"}});
  static constexpr std::array initial = kFilterInitial;
  static constexpr std::array estimate_values = kFilterEstimate;

  struct Params {
    FilterParams filter;
    double gamma;
    bool aggregated;
  };
  struct State {
    FilterState filter;
    Matrix U;  ///< for which `riccati` was made
    RiccatiStep riccati;
  };
  struct Message {
    Vector x, u;  ///< u and U are empty without aggregated measurements
    Matrix U;
    static constexpr std::array<std::string_view, 3> field_names{"x", "u", "U"};
    static constexpr std::string_view noisy_field = "x";
    static auto fields(auto& m) { return std::tie(m.x, m.u, m.U); }
  };

  static Params params(const Values& values, const Setup& setup) {
    return {filter_params(name, values, setup), positive_parameter(name, values, "gamma", {}), flag(name, values, "aggregated")};
  }
  static State init(const Params& p, const Setup& setup) {
    const auto& [plant, Q, own] = p.filter;
    return {initial_filter_state(name, p.filter, setup), own.U, RiccatiStep(plant.A, own.U, Q, setup.dt)};
  }
  static Message message(const Params& p, const State& s, const Sense& sense) {
    if (!p.aggregated) return {s.filter.x(), Vector(0), Matrix(0, 0)};
    return {s.filter.x(), sensed(p.filter.sensor, sense), p.filter.sensor.U};
  }

  /// State at k + 1: x (n x 1), P (n x n).
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    const auto& [plant, Q, own] = p.filter;
    const auto x = s.filter.x();
    Vector u = sensed(own, sense), pull = Vector::Zero(x.size());  // sum_j w_ij (xhat_j - xhat_i)
    Matrix U = own.U;
    double d = 0.0;
    for (const auto& [from, sent, w_ij, heard] : inbox) {
      d += w_ij;
      pull += w_ij * (brought_forward(plant.step, heard.x, sent, sense.k) - x);
      if (!p.aggregated || sent != sense.k) continue;
      u += heard.u;
      U += heard.U;
    }
    Vector corrected = x + corrected_by(u, U, s.filter.covariance(), x, sense.dt);
    if (d > 0.0) corrected += coupling_step(s.filter.covariance(), p.gamma, d, sense.dt) * pull;
    s.filter.x() = plant.step * corrected;
    if (U != s.U) {
      s.riccati = RiccatiStep(plant.A, U, Q, sense.dt);
      s.U = std::move(U);
    }
    s.filter.covariance() = s.riccati(s.filter.covariance());
  }

  /// xhat_i and P_i.
  static const Vector& estimate(const State& s) { return s.filter.both(); }
  static std::vector<Field> estimate_fields(const State& s) { return s.filter.fields(); }
};

}  // namespace consort
