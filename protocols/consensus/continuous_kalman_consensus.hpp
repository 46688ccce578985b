#pragma once
/// Agents hold an estimate each with its covariance, and drift towards each other all the time, the less sure the faster. Kalman consensus
/// in continuous time: the Kalman-Bucy filter for which everybody else is a measurement.
///
///     P_i' = -P_i [ sum_j g_ij (P_j + Omega)^-1 ] P_i + Q                                                               (1)
///     K_ij = P_i (P_j + Omega)^-1                                                                                       (2)
///     x_i' = sum_j g_ij K_ij (x_j + nu_ij - x_i)                                                                        (3)
///
/// Source: Ren, Beard, Kingston, "Multi-agent Kalman consensus with relative uncertainty", ACC 2005, equations (1)-(3).
/// What is heard in a round is held over it, and both equations are integrated through the round: `steps` steps of the classical
/// Runge-Kutta method or of Euler's. Holding costs an error of first order in dt, whatever the steps: dt <= 0.01 s is 5e-3 of the spread.
/// The sums run over j != i; `self_term: 1` adds j = i to (1), as its letter has it with g_ii = 1 (in (3) the term is zero).
/// Assumes: P_i(0) > 0; the union of the graphs over bounded windows has a spanning tree. Euler: a step is shorter than 1 / the largest
/// gain. On a graph that is not balanced, or with Q or Omega above zero, the value agreed on is not the centralised estimate.
/// g_ij is the weight of the edge, 1 unless the topology says otherwise. nu_ij is the link's noise, drawn once per link and round and held;
/// it disturbs x only. White noise of intensity W is a link's noise_covariance of W / dt.
/// A missing message is an absent term in both sums for that round: P_i grows at the rate Q if nobody is heard.
/// With Q = Omega = 0 every P keeps falling. Where double has no number for it any more, it has an exponent of its own
/// (protocols/covariances.hpp), so x is what a double of unlimited range would give.

#include "core/number_text.hpp"
#include "protocols/adapter.hpp"
#include "protocols/consensus/theory.hpp"
#include "protocols/covariances.hpp"

#include <cmath>

namespace consort {

template <int N>
struct ContinuousKalmanConsensus {
  static constexpr std::string_view name = "continuous_kalman_consensus";
  static constexpr std::string_view summary = "Kalman consensus in continuous time: everybody else is a measurement";
  static constexpr std::string_view source = "Ren, Beard, Kingston 2005, (1)-(3)";
  static constexpr std::string_view assumptions = "union over bounded windows has a spanning tree; dt short against 1 / the largest gain";
  static constexpr auto examine = examine_continuous_kalman_consensus;
  static constexpr std::array parameters{
      ValueDoc{"Q", "covariance n x n (scalar, diagonal or matrix)", "0", "process covariance Q that P_i grows by, per s"},
      ValueDoc{"Omega", "covariance n x n (scalar, diagonal or matrix)", "0", "communication covariance Omega added to every P_j heard"},
      ValueDoc{"self_term", "0 or 1", "0", "1: the sum in (1) includes j = i, the letter of the publication"},
      ValueDoc{"method", "one of runge_kutta, euler", "runge_kutta", "how a round is integrated"},
      ValueDoc{"steps", "scalar", "1", "integration steps per round, a whole number from 1 to 10000"}};
  static constexpr std::array initial{
      ValueDoc{"x", "vector n", "", "initial estimate x_i(0)"},
      ValueDoc{"P", "covariance n x n (scalar, diagonal or matrix)", "1", "covariance P_i(0) of x_i(0), > 0"}};
  static constexpr std::array recorded_values{ValueDoc{"P", "covariance n x n", "", "covariance P_i of x_i (unit of x squared)"}};

  using Vec = Eigen::Matrix<double, N, 1>;
  using Mat = Eigen::Matrix<double, N, N>;
  struct Params {
    Mat Q, Omega;
    bool self_term, euler;
    int steps;
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
    return {values.covariance("Q", n, 0.0), values.covariance("Omega", n, 0.0), whole(values, "self_term", 0, 0, 1) == 1,
            whole(values, "method", 0, 0, 1) == 1, whole(values, "steps", 1, 1, 10'000)};
  }
  static State init(const Params&, const Setup& setup) {
    const Vec x = setup.initial.vector("x");
    State s{x, setup.initial.covariance("P", x.size(), 1.0, true), Vec::Zero(x.size())};
    settle_exponents(s);
    return s;
  }
  static Message message(const Params&, const State& s, const Sense&) { return {s.x, s.P, s.e}; }

  /// State at k + 1: x (n x 1), P (n x n, symmetric positive definite). Throws RunError on a covariance that cannot be inverted, and on
  /// a P_i that is no longer positive definite because the step is too long.
  static State transition(const Params& p, const State& s, const Sense& sense, HeardInbox<Message> inbox) {
    return in_one_unit<ContinuousKalmanConsensus>(p, s, sense, inbox);
  }
  /// The same with all covariances in one unit, e.
  static State round(const Params& p, const State& s, const Sense& sense, HeardInbox<Message> inbox) {
    const Eigen::Index n = s.x.size();
    SpdInverse<N> inverse(n, {name, sense.self, sense.k});
    // What is heard, held over the round: certainty = sum_j g_ij (P_j + Omega)^-1, pull = sum_j g_ij (P_j + Omega)^-1 (x_j - x_i(k)).
    Mat certainty = Mat::Zero(n, n);
    Vec pull = Vec::Zero(n), difference = s.x;
    for (const auto& [from, sent, g_ij, heard] : inbox) {
      const Mat& of_j = inverse(heard.P + p.Omega, "P_j + Omega");
      difference = g_ij * (heard.x - s.x);
      certainty += g_ij * of_j;
      pull.noalias() += of_j * difference;
    }
    const auto slope = [&](const Moved& at) -> Moved {
      // P_i' = -P_i (sum_j g_ij (P_j + Omega)^-1) P_i + Q                                                                   (1)
      // x_i' = P_i sum_j g_ij (P_j + Omega)^-1 (x_j - x_i)                                                             (2), (3)
      const Vec force = pull - certainty * at.x;
      Mat known = certainty;
      if (p.self_term) known += inverse(at.P + p.Omega, "P_i + Omega");
      const Mat gain = at.P * known;
      Moved derivative{at.P * force, p.Q};
      derivative.P.noalias() -= gain * at.P;
      return derivative;
    };
    Moved moved{Vec::Zero(n), s.P};  // x relative to x_i(k): far from the origin nothing is lost to rounding
    const double h = sense.dt / p.steps;
    for (int step = 0; step < p.steps; ++step) moved = p.euler ? along(moved, slope(moved), h) : runge_kutta(moved, slope, h);
    inverse(moved.P, "P_i");
    return {s.x + moved.x, 0.5 * (moved.P + moved.P.transpose()), s.e};
  }

  static const Vec& estimate(const State& s) { return s.x; }
  static auto recorded(const Params&, const State& s) { return std::make_tuple(covariance_of(s)); }

 private:
  struct Moved {
    Vec x;  ///< relative to x_i(k)
    Mat P;
  };
  static Moved along(const Moved& from, const Moved& slope, double h) { return {from.x + h * slope.x, from.P + h * slope.P}; }
  template <class Slope>
  static Moved runge_kutta(const Moved& from, const Slope& slope, double h) {
    const Moved k1 = slope(from);
    const Moved k2 = slope(along(from, k1, 0.5 * h));
    const Moved k3 = slope(along(from, k2, 0.5 * h));
    const Moved k4 = slope(along(from, k3, h));
    return {from.x + h / 6.0 * (k1.x + 2.0 * k2.x + 2.0 * k3.x + k4.x), from.P + h / 6.0 * (k1.P + 2.0 * k2.P + 2.0 * k3.P + k4.P)};
  }
  static int whole(const Values& values, std::string_view parameter, int fallback, int low, int high) {
    const double value = values.scalar(parameter, fallback);
    if (value != std::floor(value) || value < low || value > high)
      throw ConfigError("protocol " + std::string(name) + ": " + std::string(parameter) + " is " + number_text(value) +
                        "; allowed: a whole number from " + std::to_string(low) + " to " + std::to_string(high));
    return static_cast<int>(value);
  }
};

}  // namespace consort
