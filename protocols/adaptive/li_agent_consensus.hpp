#pragma once
/// Linear agents are to follow a leader on a directed graph that nobody knows. Each turns its own gain up while it differs from its
/// neighbours, never down, and a nonlinear factor makes large differences count for more.
///
///     xi_i = sum_j w_ij (x_i - x_j)
///     u_i  = -c_i rho_i K xi_i,   rho_i = (1 + xi_i' P xi_i)^3                                                                (4.21)
///     c_i' = xi_i' Gamma xi_i                                                                                                 (4.22)
///     K = R^-1 B'P,  Gamma = K'RK, P the stabilising solution of the Riccati equation
///
/// Printed with xi_i = sum e_ij (x_j - x_i), which is positive feedback together with the printed K = -B'P^-1; the sum has to be of
/// x_i - x_j. The printed P is the inverse of the P here (see li_edge_consensus). u and xi' Gamma xi are held over the round.
/// Source: Li, Wen, Duan, Ren 2015, as printed in Knotek, "Distributed estimation and control of multi-agent systems" (thesis),
/// (4.21)-(4.22).
/// Assumes: (A, B) stabilisable, y = x; a leader (an agent without in-neighbours) that reaches everybody; c_i(0) >= 1; no noise.
/// rho grows like |xi|^6, so dt < 2 / (c_i rho_i lambda_max(K B) lambda_max(L)) asks for initial differences of about 1, or for tiny steps.
/// A missing message is an absent term in xi.

#include "protocols/adapter.hpp"
#include "protocols/adaptive/gains.hpp"
#include "protocols/adaptive/metrics.hpp"
#include "protocols/adaptive/theory.hpp"

namespace consort {

struct LiAgentConsensus {
  static constexpr std::string_view name = "li_agent_consensus";
  static constexpr std::string_view summary = "follows a leader on a directed graph with gains that only grow and a nonlinear factor";
  static constexpr std::string_view source = "Li, Wen, Duan, Ren 2015 (Knotek, thesis, (4.21)-(4.22), sign corrected)";
  static constexpr std::string_view assumptions = "(A, B) stabilisable, y = x; a leader reaches everybody; small differences or tiny dt";
  static constexpr bool needs_plant = true;
  static constexpr auto& metrics = kGainMetrics;
  static constexpr auto examine = examine_li_agent_consensus;
  static constexpr std::array parameters = kGainParameters;
  static constexpr std::array initial{ValueDoc{"c", "scalar", "1", "coupling gain c_i(0), at least 1 in theory, > 0"}};
  static constexpr std::array estimate_values{ValueDoc{"c", "scalar", "", "coupling gain c_i"}};
  static constexpr std::array recorded_values{ValueDoc{"xi", "vector n", "", "xi_i, weighted sum of the differences from the neighbours"}};

  struct Params {
    Matrix K, root, P;  // m x n, m x n (Gamma = root' root), n x n
  };
  struct State {
    double c;
    Vector u, xi;
  };
  struct Message {
    Numbers y;
    static constexpr std::array<std::string_view, 1> field_names{"y"};
    static constexpr std::string_view noisy_field = "y";
    static auto fields(auto& m) { return std::tie(m.y); }
  };

  static Params params(const Values& values, const Setup& setup) {
    const ConsensusGains gains = consensus_gains(name, values, setup);
    return {gains.K, gains.root, gains.P};
  }
  static State init(const Params& p, const Setup& setup) {
    return {positive_parameter(name, setup.initial, "c", 1.0), Vector::Zero(p.K.rows()), Vector::Zero(p.K.cols())};
  }
  static Message message(const Params&, const State&, const Sense& sense) { return {sense.y}; }

  /// State at k + 1, u_i(k) (m) with it.
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    const auto y = measured(sense);
    s.xi.setZero();
    for (const auto& [from, sent, w_ij, heard] : inbox) s.xi += w_ij * (y - heard.y.vector());
    // rho_i = (1 + xi_i' P xi_i)^3
    const double root_of_rho = 1.0 + s.xi.dot(p.P.lazyProduct(s.xi));
    const double rho = root_of_rho * root_of_rho * root_of_rho;
    // u_i = -c_i rho_i K xi_i                                                                                                 (4.21)
    s.u.noalias() = (-s.c * rho) * p.K.lazyProduct(s.xi);
    // c_i' = xi_i' Gamma xi_i                                                                                                 (4.22)
    s.c += sense.dt * p.root.lazyProduct(s.xi).squaredNorm();
  }

  static Eigen::Matrix<double, 1, 1> estimate(const State& s) { return Eigen::Matrix<double, 1, 1>(s.c); }
  static auto recorded(const Params&, const State& s) { return std::tie(s.xi); }
  static std::vector<Field> estimate_fields(const State&) { return {{"c", 1, 1}}; }
  static const Vector& control(const Params&, const State& s) { return s.u; }
};

}  // namespace consort
