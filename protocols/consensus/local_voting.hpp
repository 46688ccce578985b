#pragma once
/// Agents hold a value each and want to agree on one, hearing only their in-neighbours. Everybody moves a little towards
/// what it hears.
///
///     u_i = sum_j w_ij (x_j - x_i)                                                                            (2.9)-(2.10)
///     x_i' = u_i                                                                                                     (2.8)
///
/// Without a plant the value is a number the agent keeps, and moves in steps: x_i+ = x_i + dt u_i. With one, x_i is what the agent
/// measures in every round and u_i steers an integrator, held over the round, which is the same step.
/// A leader (2.15) is an agent without in-neighbours: its sum is empty, it keeps its value, and the weight of its edges is the pinning gain
/// g_i. Nobody needs to know that it leads.
///
/// Source: Knotek, "Distributed estimation and control of multi-agent systems" (thesis), equations (2.8)-(2.17).
/// Assumes: a spanning tree (in the union over bounded windows if it switches); dt < 1 / (largest weighted in-degree).
/// The value agreed on is w^T x(0) with w the left null vector of the Laplacian, sum 1 (2.13): the mean if the graph is balanced, the
/// leader's value if there is one.
/// A missing message is an absent term: the step of that round is shorter, nothing else.

#include "protocols/adapter.hpp"
#include "protocols/consensus/metrics.hpp"
#include "protocols/consensus/theory.hpp"
#include "protocols/sensing.hpp"

#include <optional>

namespace consort {

template <int N>
struct LocalVoting {
  static constexpr std::string_view name = "local_voting";
  static constexpr std::string_view summary = "every agent moves towards the values it hears; alone or steering a plant";
  static constexpr std::string_view source = "Knotek, thesis, (2.8)-(2.17), discrete time";
  static constexpr std::string_view assumptions = "spanning tree (over windows if switching); dt * largest weighted in-degree < 1";
  static constexpr auto& metrics = kVotingMetrics;
  static constexpr auto examine = examine_local_voting;
  static constexpr std::array<ValueDoc, 0> parameters{};
  static constexpr std::array initial{ValueDoc{
      "x", "vector n", "", "initial value x_i(0); with a plant: what stands in the record before the first measurement (default 0)"}};

  using Vec = Eigen::Matrix<double, N, 1>;
  struct Params {
    std::optional<Sensing> sensing;  ///< with a plant
  };
  struct State {
    Vec x, u;
    Vec before;  ///< x of the round before, without a plant
  };
  struct Message {
    Vec x;
    static constexpr std::array<std::string_view, 1> field_names{"x"};
    static constexpr std::string_view noisy_field = "x";
    static auto fields(auto& m) { return std::tie(m.x); }
  };

  static Params params(const Values&, const Setup& setup) {
    if (setup.measurement_size == 0) return {};
    return {Sensing(setup, name)};
  }
  static State init(const Params& p, const Setup& setup) {
    const Vec x = p.sensing ? first_record(setup, p.sensing->output_size(), name) : setup.initial.vector("x");
    return {x, Vec::Zero(x.size()), x};
  }
  static Message message(const Params& p, const State& s, const Sense& sense) {
    if (!p.sensing) return {s.x};
    return {own(p, sense)};
  }

  /// State at k + 1: x (n x 1, unit of x; with a plant what was measured in round k), u (n x 1, unit of x per s).
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    if (p.sensing) {
      s.x = own(p, sense);
      s.u.setZero();
      // u_i = sum_j w_ij (x_j - x_i)                                                                        (2.9)-(2.10)
      for (const auto& [from, sent, w_ij, heard] : inbox) s.u += w_ij * (heard.x - s.x);
    } else {
      s.before = s.x;
      // x_i+ = x_i + dt sum_j w_ij (x_j - x_i)                                                              (2.9)-(2.10)
      for (const auto& [from, sent, w_ij, heard] : inbox) s.x += (sense.dt * w_ij) * (heard.x - s.before);
    }
  }

  static const Vec& estimate(const State& s) { return s.x; }
  /// u_i with a plant, nothing without.
  static Eigen::Map<const Vector> control(const Params& p, const State& s) { return {s.u.data(), p.sensing ? s.u.size() : 0}; }

 private:
  /// y_i, its length known to the compiler where that of x is.
  static Eigen::Map<const Vec> own(const Params& p, const Sense& sense) {
    const Sensing::Output y = p.sensing->own(sense);
    return Eigen::Map<const Vec>(y.data(), y.size());
  }
};

}  // namespace consort
