#pragma once
/// Every agent estimates the state of every agent. What it measures of itself feeds an observer of its own, bar_i; the estimate of it that
/// everybody keeps follows bar_i by consensus, as followers follow a leader. Agents may differ and be coupled, states and outputs alike.
///
///     hat_j^(i)' = A_jj hat_j^(i) + B_jj u_j + sum_l A_jl hat_l^(i) + mu sum_l w_il^(j) (hat_j^(l) - hat_j^(i)),  j != i     (6a)
///     hat_i^(i)' = the same with j = i, + mu w_i0^(i) (bar_i - hat_i^(i))                                                    (6b)
///     bar_i'     = A_ii bar_i + B_ii u_i + sum_l A_il hat_l^(i) + F_i [ y_i - C_ii bar_i - sum_l C_il hat_l^(i) ]            (6c)
///
/// Source: Huang, Jiang, Zhao, Cheng, Wu 2025, "Fully Distributed State Estimation for Multi-agent Systems and its Application in
/// Cooperative Localization", sections 3.1 to 3.4. `inputs: own` drops B_jj u_j for j != i, (18). Weights, mu, the sampled scheme, and how
/// agents notice who joins and leaves: protocols/everybody/base.hpp.
/// An agent announces A_ii, B_ii, the A_il that act on it and the law of its input; nobody knows a graph.
/// Assumes: (A_ii, C_ii) observable; dynamics and sensing couplings acyclic in one order; strongly connected; A_ii - F_i C_ii stable; (13).
/// A missing message is an absent term: its sender counts for the weights (11) but not for the sum. An agent that is not heard of any more
/// is forgotten, and its terms A_jl, C_il vanish with it. Link noise disturbs the estimates that are sent.

#include "protocols/everybody/base.hpp"
#include "protocols/everybody/metrics.hpp"
#include "protocols/everybody/theory.hpp"

namespace consort {

struct DistributedObserver {
  static constexpr std::string_view name = "distributed_observer";
  static constexpr std::string_view summary = "every agent estimates everybody's state: own observer, led consensus, joins and leaves";
  static constexpr std::string_view source = "Huang, Jiang, Zhao, Cheng, Wu 2025, (6a)-(6c), (11)-(18)";
  static constexpr std::string_view assumptions = "(A_ii, C_ii) observable; acyclic couplings; strongly connected; mu above (13)";
  static constexpr bool needs_plant = true;
  static constexpr Truth truth = Truth::everybody;
  static constexpr auto& metrics = kObserverMetrics<ObserverTask::observe>;
  static constexpr auto examine = examine_distributed_observer;
  static constexpr auto parameters =
      with_everybody(std::array{ValueDoc{"F", "matrix n x p (or its diagonal, or one number)", "", "gain F_i: A_ii - F_i C_ii is stable"}});
  static constexpr std::array initial{ValueDoc{"x", "vector n", "0", "what the agent takes itself for at its start"}};
  static constexpr std::array estimate_values{
      ValueDoc{"x", "matrix n x agents", "", "estimates hat_j of everybody's state, column j for agent j"},
      ValueDoc{"bar", "vector n", "", "second estimate bar_i of the own state"}};

  struct Params {
    EverybodyDesign everybody;
    Matrix F, C;                                     ///< n x p, p x n
    std::vector<std::pair<AgentId, Matrix>> C_from;  ///< C_il, p x n_l
  };
  struct State {
    Everybody everybody;
    Vector surprise;  ///< y_i - C_ii bar_i - sum_l C_il hat_l^(i)
  };
  struct Message {
    Numbers x;
    Vector heard_of;
    double out_degree = 1.0;
    static constexpr std::array<std::string_view, 3> field_names{"x", "heard_of", "out_degree"};
    static constexpr std::string_view noisy_field = "x";
    static auto fields(auto& m) { return std::tie(m.x, m.heard_of, m.out_degree); }
  };

  static Params params(const Values& values, const Setup& setup) {
    EverybodyDesign everybody(values, setup, name);
    const Matrix* C = setup.model.find("C");
    if (C == nullptr) throw ConfigError(everybody.who + " measures nothing; allowed: a plant with outputs");
    Params p{everybody, observer_gain(values, everybody.n(), C->rows(), everybody.who), *C, {}};
    for (std::size_t l = 0; l < setup.agents; ++l)
      if (const Matrix* C_l = setup.model.find("C_" + std::to_string(l + 1))) p.C_from.emplace_back(agent_at(l), *C_l);
    return p;
  }
  static State init(const Params& p, const Setup& setup) { return {Everybody(p.everybody, setup), Vector::Zero(p.C.rows())}; }
  static Values announcement(const Params& p, const Setup&) { return p.everybody.announcement(); }
  static Message message(const Params&, const State& s, const Sense& sense) {
    return {s.everybody.sent(), s.everybody.heard_of(sense), static_cast<double>(sense.out_degree)};
  }

  /// State at k + 1: estimates of everybody (n_j each, unit of x_j), u (m, held over round k).
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    Everybody& all = s.everybody;
    all.begin_round(p.everybody, sense, inbox);
    // y_i - ( C_ii bar_i + sum_l C_il hat_l^(i) )                                                                          (6c)
    s.surprise = Eigen::Map<const Vector>(sense.y.data(), p.C.rows());
    s.surprise.noalias() -= p.C * all.bar();
    for (const auto& [l, C_il] : p.C_from)
      if (all.knows(l)) s.surprise.noalias() -= C_il * all.hat(l);
    all.correct_and_predict(p.everybody, sense, p.F * s.surprise);
  }

  static const Vector& estimate(const State& s) { return s.everybody.estimate(); }
  static std::vector<Field> estimate_fields(const State& s) { return s.everybody.fields(); }
  static const Vector& control(const Params&, const State& s) { return s.everybody.control(); }
};

}  // namespace consort
