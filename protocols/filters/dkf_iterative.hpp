#pragma once
/// The Kalman filter of Olfati-Saber in discrete time: in every round an agent filters with the measurements of itself and its neighbours
/// and moves towards their predictions.
///
///     J_i = {i} and the in-neighbours,  u_j = C_j'R_j^-1 y_j,  U_j = C_j'R_j^-1 C_j,  z_i = sum_J u_j,  S_i = sum_J U_j        step 3
///     M_i = (P_i^-1 + S_i)^-1,  xhat_i = xbar_i + M_i (z_i - S_i xbar_i) + epsilon M_i sum_j w_ij (xbar_j - xbar_i)          step 4
///     P_i <- A M_i A' + Q,  xbar_i <- A xhat_i                                                                            step 5
///
/// with A = exp(A_plant dt): one round is one step. Q is the covariance that the process noise adds in a round, R_i that of one sample of
/// the measurement (for continuous white noise: its intensity times dt, over dt).
/// Source: Olfati-Saber as printed in Knotek, thesis, Algorithm 3.1, which has epsilon = 1. That overshoots where d_i M_i has an eigenvalue
/// above 1; `bounded: 1` lowers epsilon there, to 1 / (d_i |M_i|), by what the agent knows itself. P_i is updated after xhat_i, with M_i.
/// The estimate of round k + 1 that is recorded is the prediction xbar_i, with P_i. P_i is honest up to what the coupling adds: the filter
/// of J_i's measurements has it (epsilon = 0), and the coupling towards xbar_j is not in it.
/// Assumes: undirected connected graph; (A, C) detectable with the measurements of J_i; P_i(0) > 0.
/// A missing message is an absent term in all sums for that round. A late xbar_j is moved on with the plant; a late measurement is not
/// used. Weights scale the coupling, not the measurements. Link noise disturbs xbar_j. An agent without a sensor sends zeros.

#include "core/math/decompositions.hpp"
#include "protocols/adapter.hpp"
#include "protocols/filters/base.hpp"
#include "protocols/filters/theory.hpp"

namespace consort {

struct DkfIterative {
  static constexpr std::string_view name = "dkf_iterative";
  static constexpr std::string_view summary = "discrete Kalman filter with the neighbours' measurements and predictions";
  static constexpr std::string_view source = "Knotek, thesis, Algorithm 3.1 (Olfati-Saber)";
  static constexpr std::string_view assumptions = "one plant seen by all; undirected, connected; (A, C) detectable with those of J_i";
  static constexpr bool needs_plant = true;
  static constexpr Truth truth = Truth::state;
  static constexpr auto examine = examine_dkf_iterative;
  static constexpr std::array parameters{
      ValueDoc{"Q", "covariance n x n (scalar, diagonal or matrix)", "", "covariance that the process noise adds in a round"},
      ValueDoc{"R", "covariance p x p (scalar, diagonal or matrix)", "",
               "covariance of one sample of the agent's measurement, > 0; not for "
               "agents without a sensor"},
      ValueDoc{"epsilon", "scalar", "1", "scales the gain M_i of the coupling, >= 0"},
      ValueDoc{"bounded", "0 or 1", "0", "1: epsilon is at most 1 / (d_i |M_i|)"}};
  static constexpr std::array initial = kFilterInitial;
  static constexpr std::array estimate_values = kFilterEstimate;

  struct Params {
    FilterParams filter;
    double epsilon;
    bool bounded;
  };
  using State = FilterState;
  struct Message {
    Vector x, u;
    Matrix U;
    static constexpr std::array<std::string_view, 3> field_names{"x", "u", "U"};
    static constexpr std::string_view noisy_field = "x";
    static auto fields(auto& m) { return std::tie(m.x, m.u, m.U); }
  };

  static Params params(const Values& values, const Setup& setup) {
    return {filter_params(name, values, setup), positive_parameter(name, values, "epsilon", 1.0, true), flag(name, values, "bounded")};
  }
  static State init(const Params& p, const Setup& setup) { return initial_filter_state(name, p.filter, setup); }
  static Message message(const Params& p, const State& s, const Sense& sense) {
    return {s.x(), sensed(p.filter.sensor, sense), p.filter.sensor.U};
  }

  /// State at k + 1: xbar (n x 1), P (n x n).
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    const auto& [plant, Q, own] = p.filter;
    const auto x = s.x();
    const Eigen::Index n = x.size();
    Vector z = sensed(own, sense), pull = Vector::Zero(n);  // sum_j w_ij (xbar_j - xbar_i)
    Matrix S = own.U;
    double d = 0.0;
    for (const auto& [from, sent, w_ij, heard] : inbox) {
      d += w_ij;
      pull += w_ij * (brought_forward(plant.step, heard.x, sent, sense.k) - x);
      if (sent != sense.k) continue;
      z += heard.u;
      S += heard.U;
    }
    // (P^-1 + S)^-1 = (I + P S)^-1 P, which asks for no inverse of P
    const Matrix one_sided = solve(Matrix::Identity(n, n) + s.covariance() * S, Matrix(s.covariance()), "dkf_iterative: I + P_i S_i");
    const Matrix M = 0.5 * (one_sided + one_sided.transpose());
    const double epsilon = p.bounded && d > 0.0 ? bounded_gain(p.epsilon, d, M) : p.epsilon;
    s.x() = plant.step * (x + M * (z - S * x + epsilon * pull));
    const Matrix next = plant.step * M * plant.step.transpose() + Q;
    s.covariance() = 0.5 * (next + next.transpose());
  }

  /// xbar_i and P_i.
  static const Vector& estimate(const State& s) { return s.both(); }
  static std::vector<Field> estimate_fields(const State& s) { return s.fields(); }

 private:
  static double bounded_gain(double epsilon, double d, const Matrix& M) {
    const double largest = symmetric_eigenvalues(M).maxCoeff();
    return epsilon * d * largest > 1.0 ? 1.0 / (d * largest) : epsilon;
  }
};

}  // namespace consort
