#pragma once
/// Agents that measure each other's relative positions, of which few know where they are, all come to know where all are.
///
///     hat_j^(i)' = A hat_j^(i) + B u_j + mu [ sum_l w_il^(j) (hat_j^(l) - hat_j^(i))  + w_i0^(i) (bar_i - hat_i^(i)) if j = i ]
///                                                                                                        (26a), (26b), (31a), (31b)
///     bar_i'     = A bar_i + B u_i + F_i sum over the measurements that i uses of (measured - estimated)                     (26c), (31c)
///
/// Source: Huang, Jiang, Zhao, Cheng, Wu 2025, sections 4.3 and 4.4; A = 0 of single integrators or that of double ones is the model's. The
/// publication has mu = 1. A measurement of j is y_ij = C (x_j - x_i), estimated C (hat_j^(i) - bar_i); an absolute one is -C x_i (25). So
/// F_i, n x p and the same for every measurement of i, is negative: F_3 and F_2 as printed belong to an edge that changed its direction
/// without its sign, and to the graph before DAGC. In (31) K = [b3, b4], not [b2, b4].
/// Which measurements i uses DAGC decides (protocols/everybody/acyclic_graph.hpp), in the same messages. Until it has ended, and while it
/// runs again after a change, only absolute measurements are used: nothing that could be cyclic. A measurement that the other end takes
/// travels in its message, with its sign turned. Weights, mu, sampled scheme, joins and leaves: protocols/everybody/base.hpp.
/// Assumes: sensing edges are communication edges in both directions; Theorem 4.15: an absolute position within reach of everybody over
/// sensing edges, and strongly connected communication.
/// A missing message is an absent term in every sum, and a measurement that did not arrive is not used. Link noise disturbs the estimates
/// that are sent, not the measurements.

#include "protocols/everybody/acyclic_graph.hpp"
#include "protocols/everybody/base.hpp"
#include "protocols/everybody/metrics.hpp"
#include "protocols/everybody/relative_sensing.hpp"
#include "protocols/everybody/theory.hpp"

namespace consort {

struct CooperativeLocalization {
  static constexpr std::string_view name = "cooperative_localization";
  static constexpr std::string_view summary = "everybody localises everybody from relative positions, a few absolute ones, and messages";
  static constexpr std::string_view source = "Huang, Jiang, Zhao, Cheng, Wu 2025, (26), (31), Algorithm 1";
  static constexpr std::string_view assumptions = "Theorem 4.15; sensing edges are communication edges both ways";
  static constexpr bool needs_plant = true;
  static constexpr Truth truth = Truth::everybody;
  static constexpr auto& metrics = kObserverMetrics<ObserverTask::localise>;
  static constexpr auto examine = examine_cooperative_localization;
  static constexpr auto parameters =
      with_everybody(std::array{ValueDoc{"F", "matrix n x p (or its diagonal, or one number)", "", "gain of each measurement; negative"},
                                ValueDoc{"id", "scalar", "the agent's number", "unique id for ties in DAGC, a whole number from 1"}});
  static constexpr std::array initial{ValueDoc{"x", "vector n", "0", "what the agent takes itself for at its start"}};
  static constexpr std::array estimate_values{
      ValueDoc{"x", "matrix n x agents", "", "estimates hat_j of everybody's state, column j for agent j"},
      ValueDoc{"bar", "vector n", "", "second estimate bar_i of the own state"}};

  struct Params {
    EverybodyDesign everybody;
    Matrix F, C;  ///< n x p, p x n
    double id = 1.0;
    RelativeSensing sensing;
  };
  struct State {
    Everybody everybody;
    AcyclicSensing dag;
    Vector surprise;  ///< sum of what the measurements in use say beyond the estimates
    std::vector<char> measures;
    std::vector<AcyclicSensing::Told> told;
  };
  struct Message {
    Numbers x;
    Vector heard_of;
    double out_degree = 1.0, layer = 0.0, id = 0.0, changed = 0.0;
    Vector measures;  ///< by agent: 1 where the sender measures it
    Matrix relative;  ///< p x agents: those measurements
    static constexpr std::array<std::string_view, 8> field_names{"x",  "heard_of", "out_degree", "layer",
                                                                 "id", "changed",  "measures",   "relative"};
    static constexpr std::string_view noisy_field = "x";
    static auto fields(auto& m) { return std::tie(m.x, m.heard_of, m.out_degree, m.layer, m.id, m.changed, m.measures, m.relative); }
  };

  static Params params(const Values& values, const Setup& setup) {
    EverybodyDesign everybody(values, setup, name);
    RelativeSensing sensing(setup, name);
    const Matrix F = observer_gain(values, everybody.n(), sensing.output_size(), everybody.who);
    return {std::move(everybody), F, *setup.model.find("C"), unique_id(values, setup, name), std::move(sensing)};
  }
  static State init(const Params& p, const Setup& setup) {
    return {Everybody(p.everybody, setup),
            AcyclicSensing(setup.self, setup.agents, p.id, p.sensing.has_absolute(), p.everybody.patience),
            Vector::Zero(p.C.rows()),
            std::vector<char>(setup.agents),
            {}};
  }
  static Values announcement(const Params& p, const Setup&) { return p.everybody.announcement(); }

  static Message message(const Params& p, const State& s, const Sense& sense) {
    const AcyclicSensing::Says& says = s.dag.says();
    const auto agents = static_cast<Eigen::Index>(s.measures.size());
    Message m{s.everybody.sent(), s.everybody.heard_of(sense), static_cast<double>(sense.out_degree), says.layer, says.id,
              says.changed,       Vector::Zero(agents),        Matrix::Zero(p.C.rows(), agents)};
    for (Eigen::Index j = 0; j < agents; ++j) {
      const auto y = p.sensing.relative(agent_at(static_cast<std::size_t>(j)), sense);
      if (!y) continue;
      m.measures[j] = 1.0;
      m.relative.col(j) = *y;
    }
    return m;
  }

  /// State at k + 1: estimates of everybody (n each, unit of x), u (m, held over round k).
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    const auto self = static_cast<Eigen::Index>(index_of(sense.self));
    for (std::size_t j = 0; j < s.measures.size(); ++j) s.measures[j] = p.sensing.relative(agent_at(j), sense) ? 1 : 0;
    s.told.clear();
    for (const auto& heard : inbox) {
      const Message& m = heard.message;
      s.told.push_back({heard.from, {m.layer, m.id, m.changed}, m.measures[self] != 0.0});
    }
    s.dag.absorb(sense.k, sense.in_neighbours, s.measures, s.told);

    Everybody& all = s.everybody;
    all.begin_round(p.everybody, sense, inbox);
    s.surprise.setZero();
    // absolute: -C x_i + C bar_i; relative: C (x_j - x_i) - C (hat_j^(i) - bar_i)                              (25), (26c), (31c)
    if (p.sensing.has_absolute()) s.surprise += p.sensing.absolute(sense) + p.C * all.bar();
    const auto use = [&](AgentId j, const Vector& y) {
      if (s.dag.done() && all.knows(j) && s.dag.use(j) == AcyclicSensing::Use::mine) s.surprise += y - p.C * (all.hat(j) - all.bar());
    };
    for (std::size_t j = 0; j < s.measures.size(); ++j)
      if (s.measures[j] != 0) use(agent_at(j), *p.sensing.relative(agent_at(j), sense));
    for (const auto& heard : inbox)
      if (s.measures[index_of(heard.from)] == 0 && heard.message.measures[self] != 0.0) use(heard.from, -heard.message.relative.col(self));
    all.correct_and_predict(p.everybody, sense, p.F * s.surprise);
  }

  static const Vector& estimate(const State& s) { return s.everybody.estimate(); }
  static std::vector<Field> estimate_fields(const State& s) { return s.everybody.fields(); }
  static const Vector& control(const Params&, const State& s) { return s.everybody.control(); }
};

}  // namespace consort
