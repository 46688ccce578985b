#pragma once
/// Double integrators, which may share a drift they do not know, are to follow a leader whom only a few of them hear. Velocities are
/// coupled by a gain per edge and a gain to the leader, both adapted, and a potential draws neighbours together.
///
///     u_i   = -sum_j w_ij (p_i - p_j) - sum_j m_ij w_ij (v_i - v_j) - g_i c_s (p_i - p_0) - g_i c_i (v_i - v_0)                (4.9)
///     m_ij' = k_m (v_i - v_j)'(v_i - v_j)                                                                                   (4.10)
///     c_i'  = k_c (v_i - v_0)'(v_i - v_0)                                                                                   (4.11)
///
/// The potential is psi(d) = d^2 / 2, whose gradient is p_i - p_j. The leader is an agent without in-neighbours, which its message says;
/// the weight of its edges is g_i. u and the products are held over the round. The source's connectivity-preserving switching is the
/// experiment's topology here.
/// Source: Su, Chen, Wang, Lin 2011, as printed in Knotek, "Distributed estimation and control of multi-agent systems" (thesis),
/// (4.7)-(4.11).
/// Assumes: undirected and connected among the followers, some hear the leader; y = (p, v); no noise, which lets the gains grow for ever.
/// A missing message is an absent term, and its edge's gain stands still.

#include "protocols/adapter.hpp"
#include "protocols/adaptive/edge_gains.hpp"
#include "protocols/adaptive/gains.hpp"
#include "protocols/adaptive/metrics.hpp"
#include "protocols/adaptive/theory.hpp"

namespace consort {

struct SuConsensus {
  static constexpr std::string_view name = "su_consensus";
  static constexpr std::string_view summary = "double integrators follow a leader; gains per edge and to the leader only grow";
  static constexpr std::string_view source = "Su, Chen, Wang, Lin 2011 (Knotek, thesis, (4.9)-(4.11))";
  static constexpr std::string_view assumptions = "y = (position, velocity); undirected and connected among the followers; no noise";
  static constexpr bool needs_plant = true;
  static constexpr auto& metrics = kGainMetrics;
  static constexpr auto examine = examine_su_consensus;
  static constexpr std::array parameters{ValueDoc{"c_s", "scalar", "1", "weight of the leader's position, > 0"},
                                         ValueDoc{"k_m", "scalar", "1", "rate of the edges' gains, > 0"},
                                         ValueDoc{"k_c", "scalar", "1", "rate of the gain to the leader, > 0"}};
  static constexpr std::array initial{ValueDoc{"m", "scalar", "0.01", "gain m_ij(0) of each edge, > 0"},
                                      ValueDoc{"c", "scalar", "0.01", "gain c_i(0) to the leader, > 0"}};
  static constexpr std::array estimate_values{ValueDoc{"c", "scalar", "", "gain c_i to the leader"},
                                              ValueDoc{"m_max", "scalar", "", "largest gain m_ij of the edges heard through"}};
  static constexpr std::array recorded_values{ValueDoc{"m_min", "scalar", "", "smallest gain m_ij of the edges heard through"},
                                              ValueDoc{"m_mean", "scalar", "", "mean of them"}};

  struct Params {
    double c_s, k_m, k_c;
    Eigen::Index d;  // coordinates of a position
  };
  struct State {
    double c;
    EdgeGains m;
    Vector u, difference;
  };
  struct Message {
    Numbers y;
    double leads = 0;  // 1: it hears nobody
    static constexpr std::array<std::string_view, 2> field_names{"y", "leads"};
    static constexpr std::string_view noisy_field = "y";
    static auto fields(auto& m) { return std::tie(m.y, m.leads); }
  };

  static Params params(const Values& values, const Setup& setup) {
    return {positive_parameter(name, values, "c_s", 1.0), positive_parameter(name, values, "k_m", 1.0),
            positive_parameter(name, values, "k_c", 1.0), positions_measured(name, setup)};
  }
  static State init(const Params& p, const Setup& setup) {
    return {positive_parameter(name, setup.initial, "c", 0.01), EdgeGains(positive_parameter(name, setup.initial, "m", 0.01)),
            Vector::Zero(p.d), Vector::Zero(2 * p.d)};
  }
  static Message message(const Params&, const State&, const Sense& sense) { return {sense.y, sense.in_neighbours.empty() ? 1.0 : 0.0}; }

  /// State at k + 1, u_i(k) (d) with it.
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    s.m.match(sense.in_neighbours);
    const auto y = measured(sense);
    const double c = s.c;
    s.u.setZero();
    for (const auto& [from, sent, w_ij, heard] : inbox) {
      s.difference = y - heard.y.vector();
      const auto to_p = s.difference.head(p.d), to_v = s.difference.tail(p.d);
      if (heard.leads != 0.0) {
        // - g_i c_s (p_i - p_0) - g_i c_i (v_i - v_0)                                                                 last of (4.9)
        s.u -= w_ij * (p.c_s * to_p + c * to_v);
        // c_i' = k_c (v_i - v_0)'(v_i - v_0)                                                                                 (4.11)
        s.c += sense.dt * p.k_c * to_v.squaredNorm();
      } else {
        // - w_ij (p_i - p_j) - m_ij w_ij (v_i - v_j)                                                                 first of (4.9)
        s.u -= w_ij * (to_p + s.m.of(from) * to_v);
        // m_ij' = k_m (v_i - v_j)'(v_i - v_j)                                                                                (4.10)
        s.m.add(from, sense.dt * p.k_m * to_v.squaredNorm());
      }
    }
  }

  /// The gain to the leader, and the largest gain of an edge.
  static Eigen::Vector2d estimate(const State& s) { return {s.c, s.m.summary()[2]}; }
  static auto recorded(const Params&, const State& s) { return std::make_tuple(s.m.summary()[0], s.m.summary()[1]); }
  static std::vector<Field> estimate_fields(const State&) { return {{"c", 1, 1}, {"m_max", 1, 1}}; }
  static const Vector& control(const Params&, const State& s) { return s.u; }
};

}  // namespace consort
