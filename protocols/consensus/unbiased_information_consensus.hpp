#pragma once
/// The unbiased Kalman consensus written with information instead of covariance: every agent keeps half of its information
/// and hands the other half out to its listeners in equal parts, so what all of them know together never changes.
///
///     Y_i+ = 1/2 ( Y_i + sum_{j != i} g_ij Y_j / mu_j )                                                                (11)
///     y_i+ = 1/2 ( y_i + sum_{j != i} g_ij y_j / mu_j ),    x_i = Y_i^-1 y_i,    Y_i(0) = P_i(0)^-1                    (12)
///
/// Source: Alighanbari, How, "An unbiased Kalman consensus algorithm", ACC 2006, equations (11)-(12). The factor 1/2, which (8)-(9)
/// lack, changes no x; it keeps sum_i Y_i and sum_i y_i constant.
/// Assumes: strongly connected in every round (Theorem 7); P_i(0) > 0; Q = Omega = 0 (there is no such term).
/// x and Y are sent, and y_j = Y_j (x_j + nu_ij) is formed by the receiver, so that link noise disturbs an estimate as in (9).
/// mu_j counts listeners, so g_ij is 0 or 1 here and the weight of an edge is not used. An agent without listeners (excluded by the
/// assumption) loses half of its information per round. A missing message is an absent term: that share of the information is
/// gone for good, x stays an average of what arrived, and the result is no longer unbiased. Where double has no number for what is left of
/// Y, it has an exponent of its own, so x is what a double of unlimited range would give.

#include "protocols/adapter.hpp"
#include "protocols/consensus/theory.hpp"
#include "protocols/covariances.hpp"

namespace consort {

template <int N>
struct UnbiasedInformationConsensus {
  static constexpr std::string_view name = "unbiased_information_consensus";
  static constexpr std::string_view summary = "unbiased Kalman consensus in information form: what is known in total is preserved";
  static constexpr std::string_view source = "Alighanbari, How 2006, (11)-(12)";
  static constexpr std::string_view assumptions = "strongly connected in every round; no loss";
  static constexpr auto examine = examine_unbiased_consensus;
  static constexpr std::array<ValueDoc, 0> parameters{};
  static constexpr std::array initial{
      ValueDoc{"x", "vector n", "", "initial estimate x_i(0)"},
      ValueDoc{"P", "covariance n x n (scalar, diagonal or matrix)", "1", "covariance of x_i(0), > 0; Y_i(0) is its inverse"}};
  static constexpr std::array recorded_values{
      ValueDoc{"Y", "matrix n x n", "", "information Y_i, of which x_i = Y_i^-1 y_i (1 / unit of x squared)"}};

  using Vec = Eigen::Matrix<double, N, 1>;
  using Mat = Eigen::Matrix<double, N, N>;
  struct Params {};
  struct State {
    Vec x;
    Mat Y;
    double e = 0.0;  ///< exponent of Y: what it means is 2^e Y
  };
  struct Message {
    Vec x;
    Mat Y;
    double mu;  ///< listeners of the sender in the round of sending
    double e;
    static constexpr std::array<std::string_view, 4> field_names{"x", "Y", "out_degree", "exponent"};
    static constexpr std::string_view noisy_field = "x";
    static auto fields(auto& m) { return std::tie(m.x, m.Y, m.mu, m.e); }
  };

  static Params params(const Values&, Eigen::Index) { return {}; }
  static State init(const Params&, const Setup& setup) {
    const Vec x = setup.initial.vector("x");
    const Mat P = setup.initial.covariance("P", x.size(), 1.0, true);
    return settled({x, SpdInverse<N>(x.size(), {name, setup.self, 0})(P, "P_i(0)")});
  }
  static Message message(const Params&, const State& s, const Sense& sense) {
    return {s.x, s.Y, static_cast<double>(sense.out_degree), s.e};
  }

  /// State at k + 1: x (n x 1), Y (n x n, symmetric positive definite). Throws RunError on a Y that cannot be inverted.
  static State transition(const Params&, const State& s, const Sense& sense, HeardInbox<Message> inbox) {
    // Y_i+ = 1/2 ( Y_i + sum_{j != i} g_ij Y_j / mu_j )                                                              (11)
    // y_i+ = 1/2 ( y_i + sum_{j != i} g_ij y_j / mu_j ),    y_j = Y_j x_j                                            (12)
    double unit = s.e;  // exponent of all Y in the sums: that of the largest
    for (const auto& heard : inbox) unit = std::max(unit, heard.message.e);
    State next{s.x, 0.5 * power(s.e - unit) * s.Y, unit};
    Vec y = next.Y * s.x;
    for (const auto& [from, sent, weight, heard] : inbox) {
      const double share = 0.5 / heard.mu * power(heard.e - unit);
      next.Y += share * heard.Y;
      y.noalias() += share * (heard.Y * heard.x);
    }
    // x_i+ = (Y_i+)^-1 y_i+
    next.x.noalias() = SpdInverse<N>(s.x.size(), {name, sense.self, sense.k})(next.Y, "Y_i+") * y;
    return settled(std::move(next));
  }

  static const Vec& estimate(const State& s) { return s.x; }
  static auto recorded(const Params&, const State& s) { return std::make_tuple(Mat(s.Y * power(s.e))); }

 private:
  static double power(double e) { return std::ldexp(1.0, static_cast<int>(std::max(e, -3000.0))); }
  /// With the exponent that the size of Y asks for.
  static State settled(State s) {
    const double size = std::ilogb(s.Y.diagonal().maxCoeff()) + s.e;
    const double e = size < kLeastExponent ? size : 0.0;
    if (e == s.e) return s;
    s.Y *= power(s.e - e);
    s.e = e;
    return s;
  }
};

}  // namespace consort
