#pragma once
/// Scalar agents, each with a drift nobody knows, are to follow a leader. A fixed coupling holds them together and a small neural network
/// in each learns its drift from how it differs from its neighbours.
///
///     e_i  = sum_j w_ij (x_j - x_i)                                   (with the leader's edges, of weight g_i, among them)      (2.15)
///     u_i  = c e_i - W_i' phi(x_i),   phi(x) = (1, sin x, cos x);   u_0 = 0 of the leader                        (4.2), (4.3), (4.4)
///     W_i' = -F phi(x_i) e_i p (d_i + g_i) - kappa F W_i                                                                (4.5), (4.6)
///
/// d_i + g_i is the weighted in-degree. A leader is an agent that has had no in-neighbours so far; its u is 0, whatever its W. Who has none
/// any more goes on making up for its drift. e_i and phi are held over the round, in which (4.5) then moves exactly.
/// Source: Das, Lewis 2010, as printed in Knotek, "Distributed estimation and control of multi-agent systems" (thesis), (4.3)-(4.6).
/// Assumes: strongly connected, or a leader that reaches everybody; the drift close to a combination of phi; y = x, scalar. The errors
/// end within a bound, not at zero; dt < 2 / (c lambda_max(L)).
/// A missing message is an absent term in e_i; d_i + g_i is that of the scheduled graph.

#include "core/counted.hpp"
#include "protocols/adapter.hpp"
#include "protocols/adaptive/gains.hpp"
#include "protocols/adaptive/theory.hpp"

namespace consort {

struct DasNeuralConsensus {
  static constexpr std::string_view name = "das_neural_consensus";
  static constexpr std::string_view summary = "scalar agents follow a leader and learn their unknown drift with a neural network";
  static constexpr std::string_view source = "Das, Lewis 2010 (Knotek, thesis, (4.3)-(4.6))";
  static constexpr std::string_view assumptions = "y = x, scalar; strongly connected or led; drift near the span of 1, sin x, cos x";
  static constexpr bool needs_plant = true;
  static constexpr auto examine = examine_das_neural_consensus;
  static constexpr std::array parameters{ValueDoc{"c", "scalar", "20", "coupling gain, 1/s, > 0"},
                                         ValueDoc{"F", "scalar", "10", "rate of learning (F times the identity), > 0"},
                                         ValueDoc{"kappa", "scalar", "0.01", "rate of forgetting, at least 0"},
                                         ValueDoc{"p", "scalar", "1", "weight p_i of the agent's error, > 0"}};
  static constexpr std::array initial{ValueDoc{"W", "vector 3", "0", "weights W_i(0) of 1, sin x, cos x"}};
  static constexpr std::array estimate_values{ValueDoc{"W", "vector 3", "", "weights W_i of the neural network"}};

  struct Params {
    double c, F, p;
    double kept, learnt;  // over a round: e^{-kappa F dt}, (1 - e^{-kappa F dt}) / (kappa F)
  };
  struct State {
    Eigen::Vector3d W;
    double u;
    bool follows = false;  ///< it has, or had, in-neighbours
  };
  struct Message {
    double y = 0;
    static constexpr std::array<std::string_view, 1> field_names{"y"};
    static constexpr std::string_view noisy_field = "y";
    static auto fields(auto& m) { return std::tie(m.y); }
  };

  static Params params(const Values& values, const Setup& setup) {
    if (setup.measurement_size != 1)
      throw ConfigError("protocol das_neural_consensus: agent " + std::to_string(setup.self.value) + " measures " +
                        counted(setup.measurement_size, "number") + "; allowed: 1, its own state");
    const double F = positive_parameter(name, values, "F", 10.0);
    const double forgetting = F * positive_parameter(name, values, "kappa", 0.01, true);
    const double learnt = forgetting > 0.0 ? -std::expm1(-forgetting * setup.dt) / forgetting : setup.dt;
    return {positive_parameter(name, values, "c", 20.0), F, positive_parameter(name, values, "p", 1.0), std::exp(-forgetting * setup.dt),
            learnt};
  }
  static State init(const Params&, const Setup& setup) {
    if (!setup.initial.has("W")) return {Eigen::Vector3d::Zero(), 0.0};
    const Vector W = setup.initial.vector("W");
    if (W.size() != 3)
      throw ConfigError("protocol das_neural_consensus: initial W has " + std::to_string(W.size()) + " numbers; allowed: 3");
    return {W, 0.0};
  }
  static Message message(const Params&, const State&, const Sense& sense) { return {sense.y[0]}; }

  /// State at k + 1, u_i(k) with it.
  static State transition(const Params& p, const State& s, const Sense& sense, HeardInbox<Message> inbox) {
    const double x = sense.y[0];
    double e = 0.0, in_degree = 0.0;
    for (const auto& [from, sent, w_ij, heard] : inbox) e += w_ij * (heard.y - x);
    for (const Neighbour& neighbour : sense.in_neighbours) in_degree += neighbour.weight;
    const Eigen::Vector3d phi(1.0, std::sin(x), std::cos(x));
    State next = s;
    // u_i = c e_i - W_i' phi(x_i)                                                                                      (4.3), (4.4)
    next.follows = s.follows || !sense.in_neighbours.empty();
    next.u = next.follows ? p.c * e - s.W.dot(phi) : 0.0;
    // W_i' = -F phi(x_i) e_i p (d_i + g_i) - kappa F W_i                                                               (4.5), (4.6)
    next.W = p.kept * s.W - (p.learnt * p.F * e * p.p * in_degree) * phi;
    return next;
  }

  static const Eigen::Vector3d& estimate(const State& s) { return s.W; }
  static std::vector<Field> estimate_fields(const State&) { return {{"W", 3, 1}}; }
  static Eigen::Matrix<double, 1, 1> control(const Params&, const State& s) { return Eigen::Matrix<double, 1, 1>(s.u); }
};

}  // namespace consort
