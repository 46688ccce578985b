#pragma once
/// Agents steer integrators together on bad measurements of themselves and of their in-neighbours, under disturbances of which nothing is
/// assumed. Everybody runs a filter that takes its neighbours for itself plus an error, and steers by what the filter says.
///
///     x_i'    = u_i + B_i delta_i,    y_ii = x_i + D eps_ii,    y_ij = x_j + D eps_ij,    R = D^2                   (4)-(6)
///     u_i     = sum_j w_ij (xhat_ij - xhat_i)                                                                           (7)
///     xhat_i' = u_i + Q_i [ (y_ii - xhat_i) / R + sum_j w_ij (y_ij - xhat_i) / S ],    S = R + G                 (14), (15)
///     xhat_ij = xhat_i + (G / S) (y_ij - xhat_i)                                                                       (16)
///     Q_i'    = B_i^2 - Q_i^2 (1 / R + d_i / S),    Q_i(0) = 1 / Xi_i                                                  (17)
///     Q_i*    = B_i (1 / R + d_i / S)^(-1/2)       the stationary value of (17)                                        (18)
///
/// Source: Zamani, Shames, Ugrinovskii, "Minimum-energy distributed consensus of uncertain agents" (2014), equations (4)-(19).
/// As printed, Q_i* has B_i^2, which does not solve (17); they agree for B_i = 1. Section VII takes R = G = S = 1, against (14): `S: 1` is
/// that letter. w_ij is the weight of the edge and counts every term of j, and d_i is their sum, so that (23) holds with weights too.
/// (15) moves by Euler's rule with the round's measurements, which leaves the value agreed on, (24), exactly as in continuous time; (17) is
/// solved exactly over the round. A state of several components is filtered component by component, R, G, S, B alike for all.
/// Assumes: single integrators; `sensing: neighbours`; strongly connected; dt below the bound that `consort validate` states.
/// The message of j carries its own estimate xhat_j, for the record alone: agents measure each other, and that j's message arrived is what
/// makes j visible. A missing message means that y_ij is not used in this round: its terms are absent from (7), (15) and (17), while the
/// stationary Q_i* stays that of all in-neighbours. Link noise disturbs that record only.

#include "protocols/adapter.hpp"
#include "protocols/control/metrics.hpp"
#include "protocols/control/minimum_energy.hpp"
#include "protocols/control/theory.hpp"
#include "protocols/sensing.hpp"

namespace consort {

struct MinimumEnergyConsensus {
  static constexpr std::string_view name = "minimum_energy_consensus";
  static constexpr std::string_view summary = "consensus through a filter for oneself that takes the neighbours for oneself plus an error";
  static constexpr std::string_view source = "Zamani, Shames, Ugrinovskii 2014, (4)-(19)";
  static constexpr std::string_view assumptions = "single integrators, sensing: neighbours; strongly connected; dt below its bound";
  static constexpr bool needs_plant = true;
  static constexpr auto& metrics = kMinimumEnergyMetrics;
  static constexpr auto examine = examine_minimum_energy_consensus;
  static constexpr std::array parameters{
      ValueDoc{"R", "scalar", "1", "energy weight R = D^2 of the measurement errors, > 0"},
      ValueDoc{"G", "scalar", "1", "energy weight G of the neighbours' difference from oneself, > 0"},
      ValueDoc{"S", "scalar", "R + G", "S of (14), >= G; another value than R + G for the letter of section VII"},
      ValueDoc{"B", "scalar", "1", "B_i, how strongly the disturbance delta_i acts, > 0"},
      ValueDoc{"gain", "one of stationary, riccati", "stationary", "Q_i: the constant (18), or the solution of (17)"}};
  static constexpr std::array initial{ValueDoc{"x", "vector n", "", "a-priori estimate xhat_i(0)"},
                                      ValueDoc{"Q", "scalar", "1", "Q_i(0) = 1 / Xi_i with gain: riccati, > 0"}};
  static constexpr std::array estimate_values{ValueDoc{"x", "vector n", "", "estimate xhat_i of the state"},
                                              ValueDoc{"Q", "scalar", "", "Q_i of the filter"}};

  struct Params {
    MinimumEnergyWeights weights;
    Sensing sensing;
  };
  struct State {
    Vector xhat_Q;  ///< xhat_i (n) and, below it, Q_i
    Vector u, surprise;
    [[nodiscard]] Eigen::Map<const Vector> x() const { return {xhat_Q.data(), u.size()}; }
  };
  struct Message {
    Numbers x;
    static constexpr std::array<std::string_view, 1> field_names{"x"};
    static constexpr std::string_view noisy_field = "x";
    static auto fields(auto& m) { return std::tie(m.x); }
  };

  static Params params(const Values& values, const Setup& setup) { return {minimum_energy_weights(values), Sensing(setup, name)}; }
  static State init(const Params& p, const Setup& setup) {
    const Vector x = setup.initial.vector("x");
    if (x.size() != p.sensing.output_size())
      throw ConfigError("protocol minimum_energy_consensus: agent " + std::to_string(setup.self.value) + ": found an initial x of length " +
                        std::to_string(x.size()) + "; allowed: the length of one output, " + std::to_string(p.sensing.output_size()));
    const double Q = setup.initial.scalar("Q", p.weights.stationary ? p.weights.stationary_gain(0.0) : 1.0);
    if (!(Q > 0.0))
      throw ConfigError("protocol minimum_energy_consensus: agent " + std::to_string(setup.self.value) + ": initial Q is " +
                        std::to_string(Q) + "; allowed: above 0");
    Vector xhat_Q(x.size() + 1);
    xhat_Q << x, Q;
    return {xhat_Q, Vector::Zero(x.size()), Vector::Zero(x.size())};
  }
  static Message message(const Params&, const State& s, const Sense&) { return {s.x()}; }

  /// State at k + 1: xhat (n x 1, unit of x), Q (s), u (n x 1, unit of x per s) to hold over round k.
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    const auto& [R, G, S, B, stationary] = p.weights;
    double d = 0.0, d_heard = 0.0;
    for (const Neighbour& j : sense.in_neighbours) d += j.weight;
    auto x = s.xhat_Q.head(s.u.size());
    double& Q_i = s.xhat_Q[s.u.size()];
    s.surprise.setZero();  // sum_j w_ij (y_ij - xhat_i)
    for (const auto& [from, sent, w_ij, heard] : inbox) {
      s.surprise += w_ij * (p.sensing.of(from, sense) - x);
      d_heard += w_ij;
    }
    if (stationary) Q_i = p.weights.stationary_gain(d);
    // u_i = sum_j w_ij (xhat_ij - xhat_i) = (G / S) sum_j w_ij (y_ij - xhat_i)                                      (7), (16)
    s.u = (G / S) * s.surprise;
    // xhat_i+ = xhat_i + dt ( u_i + Q_i [ (y_ii - xhat_i) / R + sum_j w_ij (y_ij - xhat_i) / S ] )                      (15)
    x += sense.dt * (s.u + Q_i * ((p.sensing.own(sense) - x) / R + s.surprise / S));
    if (!stationary) Q_i = p.weights.gain_after(sense.dt, Q_i, d_heard);
  }

  /// xhat_i and Q_i.
  static const Vector& estimate(const State& s) { return s.xhat_Q; }
  static std::vector<Field> estimate_fields(const State& s) { return {{"x", static_cast<std::size_t>(s.u.size()), 1}, {"Q", 1, 1}}; }
  static const Vector& control(const Params&, const State& s) { return s.u; }
};

}  // namespace consort
