#pragma once
/// Agents with the same linear dynamics, of any order and possibly unstable, steer their states together. Everybody applies the gain of an
/// optimal regulator to its disagreement with those it hears, times a coupling gain that the graph decides.
///
///     x_i' = A x_i + B u_i                                                                                           (2.18)
///     u_i  = c K sum_j w_ij (x_j - x_i)                                                                       (2.20), (2.25)
///     K    = R^-1 B' P,    A'P + P A + Q - P B R^-1 B' P = 0                                                   (2.21)-(2.22)
///     c   >= 1 / (2 min Re lambda),  lambda the eigenvalues of L other than zero                                      (2.27)
///
/// Source: Knotek, "Distributed estimation and control of multi-agent systems" (thesis), section 2.3.3.
/// A leader (2.19) is an agent without in-neighbours: its sum is empty, so u = 0, and the weight of its edges is the pinning gain g_i. With
/// it the eigenvalues of L are one zero and those of the publication's L + G.
/// An agent knows A and B but not the graph, so c is a parameter; `consort validate` computes (2.27) from the graph and compares.
/// Assumes: (A, B) stabilisable, the same for all; the whole state measured (C = I); a spanning tree; (2.27), which is sufficient only; a
/// round short enough for a control that is held over it.
/// A missing message is an absent term in the sum of that round: the agent is pulled less, by the others alone.

#include "core/math/riccati.hpp"
#include "core/math/shapes.hpp"
#include "protocols/adapter.hpp"
#include "protocols/control/theory.hpp"
#include "protocols/sensing.hpp"

namespace consort {

struct StaticConsensus {
  static constexpr std::string_view name = "static_consensus";
  static constexpr std::string_view summary = "regulator gain times coupling gain times disagreement; linear agents of any order";
  static constexpr std::string_view source = "Knotek, thesis, (2.18)-(2.27)";
  static constexpr std::string_view assumptions = "(A, B) stabilisable and common; spanning tree; c >= 1 / (2 min Re lambda(L))";
  static constexpr bool needs_plant = true;
  static constexpr auto examine = examine_static_consensus;
  static constexpr std::array parameters{
      ValueDoc{"c", "scalar", "", "coupling gain c > 0; (2.27) asks for at least 1 / (2 min Re lambda(L))"},
      ValueDoc{"Q", "covariance n x n (scalar, diagonal or matrix)", "1", "weight Q of the state in the regulator"},
      ValueDoc{"R", "covariance m x m (scalar, diagonal or matrix)", "1", "weight R of the control in the regulator, > 0"}};
  static constexpr std::array initial{ValueDoc{"x", "vector n", "0", "what stands in the record before the first measurement"}};

  struct Params {
    Matrix gain;  ///< c K, m x n
    Sensing sensing;
  };
  struct State {
    Vector x, u, disagreement;  // disagreement = sum_j w_ij (x_j - x_i)
  };
  struct Message {
    Numbers x;
    static constexpr std::array<std::string_view, 1> field_names{"x"};
    static constexpr std::string_view noisy_field = "x";
    static auto fields(auto& m) { return std::tie(m.x); }
  };

  static Params params(const Values& values, const Setup& setup) {
    const std::string who = "protocol static_consensus: agent " + std::to_string(setup.self.value);
    const Matrix* A = setup.model.find("A");
    const Matrix* B = setup.model.find("B");
    const Matrix* C = setup.model.find("C");
    if (A == nullptr || B == nullptr || C == nullptr)
      throw ConfigError(who + " does not know its dynamics; allowed: a linear plant model (A, B, C)");
    if (C->rows() != C->cols() || !C->isIdentity(0.0)) throw ConfigError(who + " does not measure its whole state; allowed: C = I");
    const double c = values.scalar("c");
    if (!(c > 0.0)) throw ConfigError(who + ": c is " + text_of(c) + "; allowed: above 0");
    const Matrix Q = values.covariance("Q", A->rows(), 1.0), R = values.covariance("R", B->cols(), 1.0, true);
    return {c * lqr_gain(*A, *B, Q, R), Sensing(setup, name)};
  }
  static State init(const Params& p, const Setup& setup) {
    return {first_record(setup, p.gain.cols(), name), Vector::Zero(p.gain.rows()), Vector::Zero(p.gain.cols())};
  }
  static Message message(const Params& p, const State&, const Sense& sense) { return {p.sensing.own(sense)}; }

  /// State at k + 1: x (n x 1) as measured in round k, u (m x 1) to hold over it.
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    s.x = p.sensing.own(sense);
    s.disagreement.setZero();
    for (const auto& [from, sent, w_ij, heard] : inbox) s.disagreement += w_ij * (heard.x.vector() - s.x);
    // u_i = c K sum_j w_ij (x_j - x_i)                                                                      (2.20), (2.25)
    s.u.noalias() = p.gain * s.disagreement;
  }

  static const Vector& estimate(const State& s) { return s.x; }
  static const Vector& control(const Params&, const State& s) { return s.u; }
};

}  // namespace consort
