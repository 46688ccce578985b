#pragma once
/// Agents hold a value each and want to agree on one, hearing only their in-neighbours. Everybody moves a little towards
/// what it hears.
///
///     x_i+ = x_i + dt sum_j w_ij (x_j - x_i)                                                                  (2.9)-(2.10)
///
/// Source: Knotek, "Distributed estimation and control of multi-agent systems" (thesis), equations (2.9)-(2.10), in discrete time.
/// Assumes: a spanning tree (in the union over bounded windows if it switches); dt < 1 / (largest weighted in-degree).
/// The value agreed on is w^T x(0), w the left null vector of the Laplacian (the mean if the graph is balanced).
/// A missing message is an absent term: the step of that round is shorter, nothing else.

#include "agent/protocol_adapter.hpp"

namespace consort {

template <int N>
struct LocalVoting {
  static constexpr std::string_view name = "local_voting";
  static constexpr std::string_view summary = "every agent moves towards the values it hears";
  static constexpr std::string_view source = "Knotek, thesis, (2.9)-(2.10), discrete time";
  static constexpr std::string_view assumptions = "spanning tree (over windows if switching); dt * largest weighted in-degree < 1";
  static constexpr std::array<ValueDoc, 0> parameters{};
  static constexpr std::array initial{ValueDoc{"x", "vector n", "", "initial value x_i(0)"}};

  using Vec = Eigen::Matrix<double, N, 1>;
  struct Params {};
  struct State {
    Vec x;
  };
  struct Message {
    Vec x;
    static constexpr std::array<std::string_view, 1> field_names{"x"};
    static constexpr std::string_view noisy_field = "x";
    static auto fields(auto& m) { return std::tie(m.x); }
  };

  static Params params(const Values&, Eigen::Index) { return {}; }
  static State init(const Params&, const Setup& setup) { return {setup.initial.vector("x")}; }
  static Message message(const Params&, const State& s, const Sense&) { return {s.x}; }

  /// State at k + 1 (n x 1, unit of x).
  static State transition(const Params&, const State& s, const Sense& sense, HeardInbox<Message> inbox) {
    // x_i+ = x_i + dt sum_j w_ij (x_j - x_i)                                                                (2.9)-(2.10)
    State next = s;
    for (const auto& [from, sent, w_ij, heard] : inbox) next.x += (sense.dt * w_ij) * (heard.x - s.x);
    return next;
  }

  static const Vec& estimate(const State& s) { return s.x; }
};

}  // namespace consort
