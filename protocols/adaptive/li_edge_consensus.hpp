#pragma once
/// Linear agents are to agree on their whole states though nobody knows the graph. Every edge has a gain of its own that grows as long as
/// its two ends differ, and never falls.
///
///     u_i   = K sum_j c_ij w_ij (x_j - x_i)                                                                                   (4.18)
///     c_ij' = k w_ij (x_j - x_i)' Gamma (x_j - x_i)                                                                           (4.19)
///     K = R^-1 B'P,  Gamma = K'RK, P the stabilising solution of the Riccati equation                                         (4.20)
///
/// (4.18) is printed with x_i - x_j and K = -B'P^-1, P any solution of A P + P A' - 2 B B' < 0; the inverse of the Riccati solution for
/// R = I is one of them, which gives the gains above. u and the products are held over the round.
/// Source: Li, Ren, Liu, Fu 2013, as printed in Knotek, "Distributed estimation and control of multi-agent systems" (thesis),
/// (4.18)-(4.20).
/// Assumes: (A, B) stabilisable, y = x; undirected and connected, both ends of an edge starting with the same gain and hearing each other;
/// no noise, which lets the gains grow for ever; dt < 2 / (c lambda_max(K B) lambda_max(L)) at the largest gain.
/// A missing message is an absent term, and the gain of that end stands still: the two ends then have different gains.

#include "protocols/adapter.hpp"
#include "protocols/adaptive/edge_gains.hpp"
#include "protocols/adaptive/gains.hpp"
#include "protocols/adaptive/metrics.hpp"
#include "protocols/adaptive/theory.hpp"

namespace consort {

struct LiEdgeConsensus {
  static constexpr std::string_view name = "li_edge_consensus";
  static constexpr std::string_view summary = "every edge adapts a coupling gain that only grows";
  static constexpr std::string_view source = "Li, Ren, Liu, Fu 2013 (Knotek, thesis, (4.18)-(4.20))";
  static constexpr std::string_view assumptions = "(A, B) stabilisable, y = x; undirected, connected; no noise";
  static constexpr bool needs_plant = true;
  static constexpr auto& metrics = kGainMetrics;
  static constexpr auto examine = examine_li_edge_consensus;
  static constexpr std::array parameters =
      joined(kGainParameters, std::array{ValueDoc{"rate", "scalar", "1", "k, the constant kappa_ij of (4.19), the same for all edges"}});
  static constexpr std::array initial{ValueDoc{"c", "scalar", "0.01", "gain c_ij(0) of each edge, > 0, the same at all agents"}};
  static constexpr std::array estimate_values{ValueDoc{"c_min", "scalar", "", "smallest gain c_ij of the edges heard through"},
                                              ValueDoc{"c_mean", "scalar", "", "mean of them"},
                                              ValueDoc{"c_max", "scalar", "", "largest of them"}};

  struct Params {
    Matrix K, root;  // m x n; Gamma = root' root
    double rate;
  };
  struct State {
    EdgeGains c;
    Vector u, pull, difference;  // pull = sum_j c_ij w_ij (x_j - x_i)
  };
  struct Message {
    Numbers y;
    static constexpr std::array<std::string_view, 1> field_names{"y"};
    static constexpr std::string_view noisy_field = "y";
    static auto fields(auto& m) { return std::tie(m.y); }
  };

  static Params params(const Values& values, const Setup& setup) {
    const ConsensusGains gains = consensus_gains(name, values, setup);
    return {gains.K, gains.root, positive_parameter(name, values, "rate", 1.0)};
  }
  static State init(const Params& p, const Setup& setup) {
    return {EdgeGains(positive_parameter(name, setup.initial, "c", 0.01)), Vector::Zero(p.K.rows()), Vector::Zero(p.K.cols()),
            Vector::Zero(p.K.cols())};
  }
  static Message message(const Params&, const State&, const Sense& sense) { return {sense.y}; }

  /// State at k + 1, u_i(k) (m) with it.
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    s.c.match(sense.in_neighbours);
    const auto y = measured(sense);
    s.pull.setZero();
    for (const auto& [from, sent, w_ij, heard] : inbox) {
      s.difference = heard.y.vector() - y;
      s.pull += (s.c.of(from) * w_ij) * s.difference;
      // c_ij' = k w_ij (x_j - x_i)' Gamma (x_j - x_i)                                                                         (4.19)
      s.c.add(from, sense.dt * p.rate * w_ij * p.root.lazyProduct(s.difference).squaredNorm());
    }
    // u_i = K sum_j c_ij w_ij (x_j - x_i)                                                                                     (4.18)
    s.u.noalias() = p.K.lazyProduct(s.pull);
  }

  /// Smallest, mean and largest gain of the agent's edges.
  static Eigen::Vector3d estimate(const State& s) { return s.c.summary(); }
  static std::vector<Field> estimate_fields(const State&) { return {{"c_min", 1, 1}, {"c_mean", 1, 1}, {"c_max", 1, 1}}; }
  static const Vector& control(const Params&, const State& s) { return s.u; }
};

}  // namespace consort
