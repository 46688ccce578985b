#pragma once
/// Kalman consensus is biased towards agents that many listen to. Here every agent says how many listen to it, and its
/// covariance counts that many times, so the agents reach the centralised estimate of their initial values exactly.
///
///     P_i+ = [ (P_i + Q)^-1 + sum_{j != i} g_ij (mu_j P_j + Omega)^-1 ]^-1                                              (8)
///     x_i+ = x_i + P_i+ sum_{j != i} g_ij (mu_j P_j + Omega)^-1 (x_j + nu_ij - x_i)                                     (9)
///
/// Source: Alighanbari, How, "An unbiased Kalman consensus algorithm", ACC 2006, equations (8)-(9) (MDKC). (8) is printed with a
/// sum from 1 to n and g_ii = 1; the term j = i must be left out, as (9) and (11) do, or the result is biased.
/// Assumes: strongly connected in every round (Theorem 7); P_i(0) > 0; Q = Omega = 0 (with Omega > 0 it converges, but to a biased
/// value once P is small against Omega).
/// mu_j counts listeners, so g_ij is 0 or 1 here and the weight of an edge is not used. nu_ij is the link's noise, on x only.
/// A missing message is an absent term in both sums; its share of j's information is lost, so the result is no longer unbiased.
/// With Q = Omega = 0, P falls like 2^-k. Where double has no number for it any more, it has an exponent of its own
/// (protocols/covariances.hpp), so x is what a double of unlimited range would give.

#include "protocols/adapter.hpp"
#include "protocols/consensus/theory.hpp"
#include "protocols/covariances.hpp"

namespace consort {

template <int N>
struct UnbiasedKalmanConsensus {
  static constexpr std::string_view name = "unbiased_kalman_consensus";
  static constexpr std::string_view summary = "Kalman consensus with covariances scaled by out-degree: no bias (MDKC)";
  static constexpr std::string_view source = "Alighanbari, How 2006, (8)-(9)";
  static constexpr std::string_view assumptions = "strongly connected in every round; no loss; Omega = 0 for no bias";
  static constexpr auto examine = examine_unbiased_consensus;
  static constexpr std::array parameters{
      ValueDoc{"Q", "covariance n x n (scalar, diagonal or matrix)", "0", "process covariance Q added to P_i each round"},
      ValueDoc{"Omega", "covariance n x n (scalar, diagonal or matrix)", "0",
               "communication covariance Omega added to every mu_j P_j heard"}};
  static constexpr std::array initial{
      ValueDoc{"x", "vector n", "", "initial estimate x_i(0)"},
      ValueDoc{"P", "covariance n x n (scalar, diagonal or matrix)", "1", "covariance P_i(0) of x_i(0), > 0"}};
  static constexpr std::array recorded_values{ValueDoc{"P", "covariance n x n", "", "covariance P_i of x_i (unit of x squared)"}};

  using Vec = Eigen::Matrix<double, N, 1>;
  using Mat = Eigen::Matrix<double, N, N>;
  struct Params {
    Mat Q, Omega;
  };
  struct State {
    Vec x;
    Mat P;
    Vec e;  ///< exponents of P
  };
  struct Message {
    Vec x;
    Mat P;
    double mu;  ///< listeners of the sender in the round of sending
    Vec e;
    static constexpr std::array<std::string_view, 4> field_names{"x", "P", "out_degree", "exponents"};
    static constexpr std::string_view noisy_field = "x";
    static auto fields(auto& m) { return std::tie(m.x, m.P, m.mu, m.e); }
  };

  static Params params(const Values& values, Eigen::Index n) {
    return {values.covariance("Q", n, 0.0), values.covariance("Omega", n, 0.0)};
  }
  static State init(const Params&, const Setup& setup) {
    const Vec x = setup.initial.vector("x");
    State s{x, setup.initial.covariance("P", x.size(), 1.0, true), Vec::Zero(x.size())};
    settle_exponents(s);
    return s;
  }
  static Message message(const Params&, const State& s, const Sense& sense) {
    return {s.x, s.P, static_cast<double>(sense.out_degree), s.e};
  }

  /// State at k + 1: x (n x 1), P (n x n, symmetric positive definite). Throws RunError on a covariance that cannot be inverted.
  static State transition(const Params& p, const State& s, const Sense& sense, HeardInbox<Message> inbox) {
    return in_one_unit<UnbiasedKalmanConsensus>(p, s, sense, inbox);
  }
  /// The same with all covariances in one unit, e.
  static State round(const Params& p, const State& s, const Sense& sense, HeardInbox<Message> inbox) {
    SpdInverse<N> inverse(s.x.size(), {name, sense.self, sense.k});
    // P_i+ = [ (P_i + Q)^-1 + sum_{j != i} g_ij (mu_j P_j + Omega)^-1 ]^-1                                            (8)
    // innovation = sum_{j != i} g_ij (mu_j P_j + Omega)^-1 (x_j - x_i)                                         sum of (9)
    Mat information = inverse(s.P + p.Q, "P_i + Q");
    Vec innovation = Vec::Zero(s.x.size()), difference = s.x;
    for (const auto& [from, sent, weight, heard] : inbox) {
      const Mat& certainty = inverse(heard.mu * heard.P + p.Omega, "mu_j P_j + Omega");
      difference = heard.x - s.x;
      information += certainty;
      innovation.noalias() += certainty * difference;
    }
    // x_i+ = x_i + P_i+ innovation                                                                                    (9)
    const Mat& P_next = inverse(information, "P_i+^-1");
    return {s.x + P_next * innovation, P_next, s.e};
  }

  static const Vec& estimate(const State& s) { return s.x; }
  static auto recorded(const Params&, const State& s) { return std::make_tuple(covariance_of(s)); }
};

}  // namespace consort
