#pragma once
/// Double integrators, which may share a drift they do not know, are to agree on positions and velocities. Each has one gain, adapted to
/// how it differs from its neighbours.
///
///     e_p = sum_j w_ij (p_i - p_j),   e_v = sum_j w_ij (v_i - v_j)      (the rows of L, or with a leader of H = L + G)
///     u_i  = -alpha c_i e_p - beta c_i e_v                                                                             (4.14), (4.16)
///     c_i' = xi [ alpha e_p'e_p + beta gamma e_v'e_v + (beta + alpha gamma) e_p'e_v ]                                  (4.15), (4.17)
///
/// (4.14) is printed with v_j - v_j for v_j - v_i, (4.16) without the minus sign, without which the agents run away from the leader. A
/// leader is an agent without in-neighbours; the weight of its edges is g_i. u and the products are held over the round.
/// Source: Yu, Ren, Zheng, Chen, Lu 2013, as printed in Knotek, "Distributed estimation and control of multi-agent systems" (thesis),
/// (4.12)-(4.17).
/// Assumes: undirected and connected among the followers; y = (p, v); no noise; dt small against beta c_i lambda_max.
/// A missing message is an absent term in both sums.

#include "protocols/adapter.hpp"
#include "protocols/adaptive/gains.hpp"
#include "protocols/adaptive/metrics.hpp"
#include "protocols/adaptive/theory.hpp"

namespace consort {

struct YuConsensus {
  static constexpr std::string_view name = "yu_consensus";
  static constexpr std::string_view summary = "double integrators, one adapted gain per agent for position and velocity";
  static constexpr std::string_view source = "Yu, Ren, Zheng, Chen, Lu 2013 (Knotek, thesis, (4.14)-(4.17), corrected)";
  static constexpr std::string_view assumptions = "y = (position, velocity); undirected and connected among the followers; no noise";
  static constexpr bool needs_plant = true;
  static constexpr auto& metrics = kGainMetrics;
  static constexpr auto examine = examine_yu_consensus;
  static constexpr std::array parameters{ValueDoc{"alpha", "scalar", "1", "weight of the position, > 0"},
                                         ValueDoc{"beta", "scalar", "1", "weight of the velocity, > 0"},
                                         ValueDoc{"gamma", "scalar", "1", "weight of the velocity in the adaptation, > 0"},
                                         ValueDoc{"xi", "scalar", "0.1", "rate of the adaptation, > 0"}};
  static constexpr std::array initial{ValueDoc{"c", "scalar", "0.1", "coupling gain c_i(0), > 0"}};
  static constexpr std::array estimate_values{ValueDoc{"c", "scalar", "", "coupling gain c_i"}};
  static constexpr std::array recorded_values{ValueDoc{"e", "vector 2 d", "", "e_i, sums of the differences of position and of velocity"}};

  struct Params {
    double alpha, beta, gamma, xi;
    Eigen::Index d;  // coordinates of a position
  };
  struct State {
    double c;
    Vector u, e;  // e = (e_p, e_v)
  };
  struct Message {
    Numbers y;
    static constexpr std::array<std::string_view, 1> field_names{"y"};
    static constexpr std::string_view noisy_field = "y";
    static auto fields(auto& m) { return std::tie(m.y); }
  };

  static Params params(const Values& values, const Setup& setup) {
    return {positive_parameter(name, values, "alpha", 1.0), positive_parameter(name, values, "beta", 1.0),
            positive_parameter(name, values, "gamma", 1.0), positive_parameter(name, values, "xi", 0.1), positions_measured(name, setup)};
  }
  static State init(const Params& p, const Setup& setup) {
    return {positive_parameter(name, setup.initial, "c", 0.1), Vector::Zero(p.d), Vector::Zero(2 * p.d)};
  }
  static Message message(const Params&, const State&, const Sense& sense) { return {sense.y}; }

  /// State at k + 1, u_i(k) (d) with it.
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    const auto y = measured(sense);
    s.e.setZero();
    for (const auto& [from, sent, w_ij, heard] : inbox) s.e += w_ij * (y - heard.y.vector());
    const auto e_p = s.e.head(p.d), e_v = s.e.tail(p.d);
    // u_i = -alpha c_i e_p - beta c_i e_v                                                                            (4.14), (4.16)
    s.u = -s.c * (p.alpha * e_p + p.beta * e_v);
    // c_i' = xi [ alpha e_p'e_p + beta gamma e_v'e_v + (beta + alpha gamma) e_p'e_v ]                                (4.15), (4.17)
    s.c += sense.dt * p.xi *
           (p.alpha * e_p.squaredNorm() + p.beta * p.gamma * e_v.squaredNorm() + (p.beta + p.alpha * p.gamma) * e_p.dot(e_v));
  }

  static Eigen::Matrix<double, 1, 1> estimate(const State& s) { return Eigen::Matrix<double, 1, 1>(s.c); }
  static auto recorded(const Params&, const State& s) { return std::tie(s.e); }
  static std::vector<Field> estimate_fields(const State&) { return {{"c", 1, 1}}; }
  static const Vector& control(const Params&, const State& s) { return s.u; }
};

}  // namespace consort
