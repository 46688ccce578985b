#pragma once
/// Agents steer integrators together on nothing but what they measure of themselves and of their in-neighbours, as if it were exact. The
/// classical law, as a comparison for laws that filter their measurements.
///
///     x_i' = u_i + d_i,    u_i = sum_j w_ij (y_ij - y_ii)                                                               (30)
///
/// y_ii and y_ij are the agent's own measurements of x_i and x_j (`sensing: neighbours`). With exact ones this is (30); noisy ones feed
/// their noise, times the in-degree, straight into the plant.
///
/// Source: Zamani, Shames, Ugrinovskii, "Minimum-energy distributed consensus of uncertain agents" (2014), section VII, (30), which is the
/// classical consensus algorithm of Olfati-Saber and Murray.
/// Assumes: single integrators; a spanning tree; dt < 2 Re(lambda) / |lambda|^2 for the eigenvalues lambda of L other than zero.
/// The message of j carries its own y_jj, for the record alone: that it arrived is what makes j visible, so a missing message means that
/// y_ij is not used in this round. Link noise disturbs that record only.

#include "protocols/adapter.hpp"
#include "protocols/control/metrics.hpp"
#include "protocols/control/theory.hpp"
#include "protocols/sensing.hpp"

namespace consort {

struct MeasuredConsensus {
  static constexpr std::string_view name = "measured_consensus";
  static constexpr std::string_view summary = "classical consensus straight on own measurements of oneself and the neighbours";
  static constexpr std::string_view source = "Zamani, Shames, Ugrinovskii 2014, (30)";
  static constexpr std::string_view assumptions =
      "single integrators, sensing: neighbours; spanning tree; dt * largest eigenvalue of L < 2";
  static constexpr bool needs_plant = true;
  static constexpr auto& metrics = kMeasuredMetrics;
  static constexpr auto examine = examine_measured_consensus;
  static constexpr std::array<ValueDoc, 0> parameters{};
  static constexpr std::array initial{ValueDoc{"x", "vector n", "0", "what stands in the record before the first measurement"}};

  struct Params {
    Sensing sensing;
  };
  struct State {
    Vector x, u;
  };
  struct Message {
    Numbers x;
    static constexpr std::array<std::string_view, 1> field_names{"x"};
    static constexpr std::string_view noisy_field = "x";
    static auto fields(auto& m) { return std::tie(m.x); }
  };

  static Params params(const Values&, const Setup& setup) { return {Sensing(setup, name)}; }
  static State init(const Params& p, const Setup& setup) {
    const Eigen::Index n = p.sensing.output_size();
    return {first_record(setup, n, name), Vector::Zero(n)};
  }
  static Message message(const Params& p, const State&, const Sense& sense) { return {p.sensing.own(sense)}; }

  /// State at k + 1: x = y_ii(k) (n x 1), u (n x 1) to hold over the round.
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    s.x = p.sensing.own(sense);
    s.u.setZero();
    // u_i = sum_j w_ij (y_ij - y_ii)                                                                                    (30)
    for (const auto& [from, sent, w_ij, heard] : inbox) s.u += w_ij * (p.sensing.of(from, sense) - s.x);
  }

  static const Vector& estimate(const State& s) { return s.x; }
  static const Vector& control(const Params&, const State& s) { return s.u; }
};

}  // namespace consort
