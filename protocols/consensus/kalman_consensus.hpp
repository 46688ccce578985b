#pragma once
/// Agents hold an estimate each with its covariance, and agree in pairs or groups, trusting whoever is surer. An exact agent
/// (small P) draws the others to itself; with equal certainty it is an average.
///
///     P_i+ = [ (P_i + Q)^-1 + sum_j g_ij (P_j + Omega)^-1 ]^-1                                                          (4)
///     x_i+ = x_i + P_i+ sum_j g_ij (P_j + Omega)^-1 (x_j + nu_ij - x_i)                                                 (5)
///
/// Source: Ren, Beard, Kingston, "Multi-agent Kalman consensus with relative uncertainty", ACC 2005, equations (4)-(5).
/// The sums run over j != i, as Alighanbari and How (2006) rewrite them; `self_term: 1` adds (P_i + Omega)^-1 to (4), which is
/// the letter of (4) with its g_ii = 1 (in (5) the term is zero).
/// Assumes: P_i(0) > 0; the union of the graphs over bounded windows has a spanning tree (Theorem 3.9). On a graph that is not
/// balanced the value agreed on is biased towards agents with many listeners.
/// g_ij is the weight of the edge, 1 unless the topology says otherwise. nu_ij is the link's noise, which disturbs x only.
/// A missing message is an absent term in both sums. With Omega = 0 every P keeps falling, geometrically with two or more
/// in-neighbours whatever Q. Where double has no number for it any more, it has an exponent of its own (protocols/covariances.hpp), so
/// x is what a double of unlimited range would give.

#include "core/number_text.hpp"
#include "protocols/adapter.hpp"
#include "protocols/consensus/theory.hpp"
#include "protocols/covariances.hpp"

namespace consort {

template <int N>
struct KalmanConsensus {
  static constexpr std::string_view name = "kalman_consensus";
  static constexpr std::string_view summary = "consensus weighted by covariances; an exact agent leads";
  static constexpr std::string_view source = "Ren, Beard, Kingston 2005, (4)-(5)";
  static constexpr std::string_view assumptions =
      "union over bounded windows has a spanning tree; unbiased only if all have equally many listeners";
  static constexpr auto examine = examine_kalman_consensus;
  static constexpr std::array parameters{
      ValueDoc{"Q", "covariance n x n (scalar, diagonal or matrix)", "0", "process covariance Q added to P_i each round"},
      ValueDoc{"Omega", "covariance n x n (scalar, diagonal or matrix)", "0", "communication covariance Omega added to every P_j heard"},
      ValueDoc{"self_term", "0 or 1", "0", "1: the sum in (4) includes j = i, the letter of the publication"}};
  static constexpr std::array initial{
      ValueDoc{"x", "vector n", "", "initial estimate x_i(0)"},
      ValueDoc{"P", "covariance n x n (scalar, diagonal or matrix)", "1", "covariance P_i(0) of x_i(0), > 0"}};
  static constexpr std::array recorded_values{ValueDoc{"P", "covariance n x n", "", "covariance P_i of x_i (unit of x squared)"}};

  using Vec = Eigen::Matrix<double, N, 1>;
  using Mat = Eigen::Matrix<double, N, N>;
  struct Params {
    Mat Q, Omega;
    bool self_term;
  };
  struct State {
    Vec x;
    Mat P;
    Vec e;  ///< exponents of P
  };
  struct Message {
    Vec x;
    Mat P;
    Vec e;
    static constexpr std::array<std::string_view, 3> field_names{"x", "P", "exponents"};
    static constexpr std::string_view noisy_field = "x";
    static auto fields(auto& m) { return std::tie(m.x, m.P, m.e); }
  };

  static Params params(const Values& values, Eigen::Index n) {
    const double self_term = values.scalar("self_term", 0.0);
    if (self_term != 0.0 && self_term != 1.0)
      throw ConfigError("protocol kalman_consensus: self_term is " + number_text(self_term) + "; allowed: 0 or 1");
    return {values.covariance("Q", n, 0.0), values.covariance("Omega", n, 0.0), self_term == 1.0};
  }
  static State init(const Params&, const Setup& setup) {
    const Vec x = setup.initial.vector("x");
    State s{x, setup.initial.covariance("P", x.size(), 1.0, true), Vec::Zero(x.size())};
    settle_exponents(s);
    return s;
  }
  static Message message(const Params&, const State& s, const Sense&) { return {s.x, s.P, s.e}; }

  /// State at k + 1: x (n x 1), P (n x n, symmetric positive definite). Throws RunError on a covariance that cannot be inverted.
  static State transition(const Params& p, const State& s, const Sense& sense, HeardInbox<Message> inbox) {
    return in_one_unit<KalmanConsensus>(p, s, sense, inbox);
  }
  /// The same with all covariances in one unit, e.
  static State round(const Params& p, const State& s, const Sense& sense, HeardInbox<Message> inbox) {
    SpdInverse<N> inverse(s.x.size(), {name, sense.self, sense.k});
    // P_i+ = [ (P_i + Q)^-1 + sum_j g_ij (P_j + Omega)^-1 ]^-1                                                        (4)
    // innovation = sum_j g_ij (P_j + Omega)^-1 (x_j - x_i)                                                     sum of (5)
    Mat information = inverse(s.P + p.Q, "P_i + Q");
    if (p.self_term) information += inverse(s.P + p.Omega, "P_i + Omega");
    Vec innovation = Vec::Zero(s.x.size()), difference = s.x;
    for (const auto& [from, sent, g_ij, heard] : inbox) {
      const Mat& certainty = inverse(heard.P + p.Omega, "P_j + Omega");
      difference = g_ij * (heard.x - s.x);
      information += g_ij * certainty;
      innovation.noalias() += certainty * difference;
    }
    // x_i+ = x_i + P_i+ innovation                                                                                    (5)
    const Mat& P_next = inverse(information, "P_i+^-1");
    return {s.x + P_next * innovation, P_next, s.e};
  }

  static const Vec& estimate(const State& s) { return s.x; }
  static auto recorded(const Params&, const State& s) { return std::make_tuple(covariance_of(s)); }
};

}  // namespace consort
