#pragma once
/// Linear agents are to agree on their whole states though nobody knows the graph. Each turns its own coupling gain up while it differs
/// from its neighbours, and lets it decay to a reference that it finds itself.
///
///     u_i  = c_i K sum_j w_ij (x_j - x_i)                                                                          (4.24), (4.70)
///     c_i' = sum_j w_ij (x_j - x_i)' Gamma (x_j - x_i) - beta (c_i - kappa_i)                                      (4.25), (4.71)
///     K = R^-1 B'P,  Gamma = K'RK,  A'P + P A + Q - P B R^-1 B'P = 0                                               (4.26)-(4.28)
///
/// u and the sum are held over the round, in which (4.25) then moves exactly. kappa_i: protocols/adaptive/reference.hpp. A leader is an
/// agent without in-neighbours; its u is 0 and the weight of its edges is the pinning gain g_i.
/// A change of the network (Remark 32 wants all c_i and the estimators begun again): an agent sees its own in-neighbours change and stamps
/// its messages with that round; whoever hears a newer stamp than its own begins again too and passes it on, one edge per round.
/// `reset: never` turns that off.
/// Source: Knotek, "Distributed estimation and control of multi-agent systems" (thesis), sections 4.4-4.6; (4.91) for beta.
/// Assumes: (A, B) stabilisable, y = x; strongly connected, or a leader that reaches everybody; kappa_i large enough, else the states end
/// within a bound of each other only; dt < 2 / (c_i lambda_max(K B) lambda_max(L)) at the peak of c_i, or the loop rings up.
/// A missing message is an absent term in both sums; the scheduled graph, not the loss, decides what counts as a change.

#include "protocols/adapter.hpp"
#include "protocols/adaptive/gains.hpp"
#include "protocols/adaptive/metrics.hpp"
#include "protocols/adaptive/reference.hpp"
#include "protocols/adaptive/theory.hpp"

namespace consort {

struct AdaptiveConsensus {
  static constexpr std::string_view name = "adaptive_consensus";
  static constexpr std::string_view summary = "every agent adapts its own coupling gain, which decays to a reference found on the way";
  static constexpr std::string_view source = "Knotek, thesis, (4.24)-(4.28), (4.70)-(4.71), Algorithms 4.1 and 4.2";
  static constexpr std::string_view assumptions =
      "(A, B) stabilisable, y = x; strongly connected or led; eigenvalue: undirected; dt small against the largest gain";
  static constexpr bool needs_plant = true;
  static constexpr auto& metrics = kGainMetrics;
  static constexpr auto examine = examine_adaptive_consensus;
  static constexpr std::array parameters = joined(
      joined(kGainParameters,
             std::array{ValueDoc{"beta", "scalar", "0.9 lambda_min(Q) / lambda_max(P)", "decay rate of c_i, 1/s"},
                        ValueDoc{"reset", "one of on_change, never", "on_change", "begin c_i and kappa_i again when the network changes"}}),
      Reference::parameters);
  static constexpr std::array initial =
      joined(std::array{ValueDoc{"c", "scalar", "0.01", "coupling gain c_i(0), > 0"}}, Reference::initial);
  static constexpr std::array estimate_values{ValueDoc{"c", "scalar", "", "coupling gain c_i"},
                                              ValueDoc{"kappa", "scalar", "", "reference kappa_i that it decays to"}};
  static constexpr std::array recorded_values{ValueDoc{"r", "scalar", "", "artificial state r_i of the eigenvalue estimator"},
                                              ValueDoc{"q", "scalar", "", "artificial state q_i of it"}};

  struct Params {
    Matrix K, root;        // m x n; Gamma = root' root
    double beta, decayed;  // decayed = (1 - e^{-beta dt}) / beta
    bool resets;
    Reference::Rule reference;
  };
  struct State {
    double c, c_start, kappa_start;
    Reference::State reference;
    Vector u, pull, difference;  // pull = sum_j w_ij (x_j - x_i)
    bool begun = false;          // a round has been absorbed
    Round changed = 0;           // newest change known, as the round after it; 0: none
    std::vector<Neighbour> heard_from;
  };
  struct Message {
    Numbers y;
    double changed = 0, r = 0, q = 0;
    static constexpr std::array<std::string_view, 4> field_names{"y", "changed", "r", "q"};
    static constexpr std::string_view noisy_field = "y";
    static auto fields(auto& m) { return std::tie(m.y, m.changed, m.r, m.q); }
  };

  static Params params(const Values& values, const Setup& setup) {
    const ConsensusGains gains = consensus_gains(name, values, setup);
    const double beta = positive_parameter(name, values, "beta", 0.9 * gains.slowest_decay, true);
    const double decayed = beta > 0.0 ? -std::expm1(-beta * setup.dt) / beta : setup.dt;
    return {gains.K, gains.root, beta, decayed, values.scalar("reset", 0.0) == 0.0, Reference::rule(name, values, setup.dt)};
  }
  static State init(const Params& p, const Setup& setup) {
    const double c = positive_parameter(name, setup.initial, "c", 0.01);
    const Reference::State reference = Reference::start(name, p.reference, setup, c);
    return {c, c, reference.kappa, reference, Vector::Zero(p.K.rows()), Vector::Zero(p.K.cols()), Vector::Zero(p.K.cols()), false, 0, {}};
  }
  /// y (n), the round after the newest change known (0: none), r and q.
  static Message message(const Params&, const State& s, const Sense& sense) {
    return {sense.y, static_cast<double>(newest_change(s, sense)), s.reference.r, s.reference.q};
  }

  /// State at k + 1, u_i(k) (m) with it.
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    if (p.resets) begin_again_on_change(s, sense, inbox);
    const auto y = measured(sense);
    s.pull.setZero();
    double disagreement = 0.0, laplacian_r = 0.0, laplacian_q = 0.0;
    for (const auto& [from, sent, w_ij, heard] : inbox) {
      s.difference = heard.y.vector() - y;
      s.pull += w_ij * s.difference;
      // (x_j - x_i)' Gamma (x_j - x_i) = |root (x_j - x_i)|^2
      disagreement += w_ij * (p.root.lazyProduct(s.difference)).squaredNorm();
      laplacian_r += w_ij * (s.reference.r - heard.r);
      laplacian_q += w_ij * (s.reference.q - heard.q);
    }
    // u_i = c_i K sum_j w_ij (x_j - x_i)                                                                                  (4.24), (4.70)
    s.u.noalias() = s.c * p.K.lazyProduct(s.pull);
    Reference::advance(p.reference, s.reference, sense.k, s.c, laplacian_r, laplacian_q);
    // c_i' = sum_j w_ij (x_j - x_i)' Gamma (x_j - x_i) - beta (c_i - kappa_i)                                             (4.25), (4.71)
    s.c += p.decayed * (disagreement - p.beta * (s.c - s.reference.kappa));
  }

  /// c_i and kappa_i.
  static Eigen::Vector2d estimate(const State& s) { return {s.c, s.reference.kappa}; }
  static auto recorded(const Params&, const State& s) { return std::tie(s.reference.r, s.reference.q); }
  static std::vector<Field> estimate_fields(const State&) { return {{"c", 1, 1}, {"kappa", 1, 1}}; }
  static const Vector& control(const Params&, const State& s) { return s.u; }

 private:
  static Round newest_change(const State& s, const Sense& sense) {
    const bool changed =
        s.begun && !std::equal(s.heard_from.begin(), s.heard_from.end(), sense.in_neighbours.begin(), sense.in_neighbours.end());
    return changed ? sense.k + 1 : s.changed;
  }
  static void begin_again_on_change(State& s, const Sense& sense, HeardInbox<Message> inbox) {
    Round newest = newest_change(s, sense);
    for (const auto& heard : inbox) newest = std::max(newest, static_cast<Round>(heard.message.changed));
    if (newest > s.changed) {
      s.changed = newest;
      s.c = s.c_start;
      Reference::restart(s.reference, s.c_start, s.kappa_start);
    }
    s.heard_from.assign(sense.in_neighbours.begin(), sense.in_neighbours.end());
    s.begun = true;
  }
};

}  // namespace consort
