#pragma once
/// A Kalman-Bucy filter of one's own whose estimate moves towards the neighbours' estimates and whose covariance moves towards theirs, so
/// that agents take part whose own measurements do not show the state, or who measure nothing.
///
///     xhat_i' = A xhat_i + K_i (y_i - C_i xhat_i) + gamma P_i sum_j w_ij (xhat_j - xhat_i),   K_i = P_i C_i'R_i^-1     (3.7a), (3.7b)
///     P_i'    = A P_i + P_i A' + Q - P_i C_i'R_i^-1 C_i P_i + k sum_j w_ij (P_j - P_i)                                         (3.7c)
///
/// Source: Kim et al. as printed in Knotek, thesis, (3.7). R in its (3.7b) is R_i; the transpose in (3.7c) is lost in its text.
/// x is corrected and predicted in rounds (protocols/filters/estimator_network.hpp); `consort validate` says how long they may be. With the
/// P_j heard held over the round, (3.7c) is the Riccati equation of A - (k d_i / 2) I with process noise Q + k sum_j w_ij P_j and moves
/// without an error of integration (protocols/filters/riccati_step.hpp), stably for large k, whose eigenvalues k d_i an explicit method has
/// to resolve; what is stationary for (3.7c) is stationary here.
/// P_i is not the covariance of the error: it leaves out how errors correlate, and averaging it is a rule, not an inference.
/// Assumes: undirected connected graph; (A, C) of all together detectable; gamma large enough.
/// A missing message is an absent term in both sums for that round. A late xhat_j is moved on with the plant, a late P_j taken as it is.
/// w_ij is the weight of the edge. Link noise disturbs xhat_j.

#include "protocols/adapter.hpp"
#include "protocols/filters/base.hpp"
#include "protocols/filters/riccati_step.hpp"
#include "protocols/filters/theory.hpp"

namespace consort {

struct DkfKim {
  static constexpr std::string_view name = "dkf_kim";
  static constexpr std::string_view summary = "Kalman-Bucy filters that agree on estimates and on covariances; some may see nothing";
  static constexpr std::string_view source = "Knotek, thesis, (3.7) (Kim et al.)";
  static constexpr std::string_view assumptions = "one plant seen by all; undirected, connected; (A, C) detectable; gamma large enough";
  static constexpr bool needs_plant = true;
  static constexpr Truth truth = Truth::state;
  static constexpr auto examine = examine_dkf_kim;
  static constexpr std::array parameters =
      joined(kFilterParameters, std::array{ValueDoc{"gamma", "scalar", "", "coupling gain of the estimates, 1 / (unit of x^2 s), > 0"},
                                           ValueDoc{"k", "scalar", "", "coupling gain of the covariances, 1/s, >= 0"}});
  static constexpr std::array initial = kFilterInitial;
  static constexpr std::array estimate_values = kFilterEstimate;

  struct Params {
    FilterParams filter;
    double gamma, k;
  };
  using State = FilterState;
  struct Message {
    Vector x;
    Matrix P;
    static constexpr std::array<std::string_view, 2> field_names{"x", "P"};
    static constexpr std::string_view noisy_field = "x";
    static auto fields(auto& m) { return std::tie(m.x, m.P); }
  };

  static Params params(const Values& values, const Setup& setup) {
    return {filter_params(name, values, setup), positive_parameter(name, values, "gamma", {}),
            positive_parameter(name, values, "k", {}, true)};
  }
  static State init(const Params& p, const Setup& setup) { return initial_filter_state(name, p.filter, setup); }
  static Message message(const Params&, const State& s, const Sense&) { return {s.x(), s.covariance()}; }

  /// State at k + 1: x (n x 1), P (n x n).
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    const auto& [plant, Q, own] = p.filter;
    const auto x = s.x();
    const Eigen::Index n = x.size();
    Vector pull = Vector::Zero(n);  // sum_j w_ij (xhat_j - xhat_i)
    Matrix noise = Q;               // Q + k sum_j w_ij P_j
    double d = 0.0;
    for (const auto& [from, sent, w_ij, heard] : inbox) {
      d += w_ij;
      pull += w_ij * (brought_forward(plant.step, heard.x, sent, sense.k) - x);
      noise += p.k * w_ij * heard.P;
    }
    Vector corrected = x + corrected_by(sensed(own, sense), own.U, s.covariance(), x, sense.dt);
    if (d > 0.0) corrected += coupling_step(s.covariance(), p.gamma, d, sense.dt) * pull;
    s.x() = plant.step * corrected;
    s.covariance() = RiccatiStep(plant.A - 0.5 * p.k * d * Matrix::Identity(n, n), own.U, noise, sense.dt)(s.covariance());
  }

  /// xhat_i and P_i.
  static const Vector& estimate(const State& s) { return s.both(); }
  static std::vector<Field> estimate_fields(const State& s) { return s.fields(); }
};

}  // namespace consort
