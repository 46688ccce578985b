#pragma once
/// Agents that measure each other's positions agree on who uses which measurement, so that no estimate depends on itself. Nobody sees the
/// graph: each tells its in-neighbours its layer, its id, whom it measures, and when it last heard of a change.
///
///     layer_i = 0 with an absolute position, else 1 + min layer_j over the sensing edges of i, either direction
///     i uses the edge with j if (layer_i, id_i) > (layer_j, id_j)
///
/// Source: Huang, Jiang, Zhao, Cheng, Wu 2025, Algorithm 1 (DAGC), with its misprints mended; how it ends:
/// protocols/everybody/acyclic_graph.hpp.
/// The plant is measured for whom an agent sees, nothing is steered.
/// Assumes: sensing edges are communication edges in both directions; ids that differ; strongly connected.
/// A missing message leaves what its sender said last; `patience` is how many rounds the news of a change may be late. Link noise disturbs
/// nothing.

#include "protocols/adapter.hpp"
#include "protocols/everybody/acyclic_graph.hpp"
#include "protocols/everybody/relative_sensing.hpp"
#include "protocols/everybody/theory.hpp"

namespace consort {

struct AcyclicSensingGraph {
  static constexpr std::string_view name = "acyclic_sensing";
  static constexpr std::string_view summary = "distributed construction of an acyclic sensing graph: layers, ties by id, ends by itself";
  static constexpr std::string_view source = "Huang, Jiang, Zhao, Cheng, Wu 2025, Algorithm 1";
  static constexpr std::string_view assumptions = "sensing edges are communication edges both ways; unique ids; strongly connected";
  static constexpr bool needs_plant = true;
  static constexpr auto examine = examine_acyclic_sensing;
  static constexpr std::array parameters{
      ValueDoc{"id", "scalar", "the agent's number", "unique id, a whole number from 1"},
      ValueDoc{"patience", "scalar", "0", "rounds that news may be late before layers count as final; for links that lose"}};
  static constexpr std::array<ValueDoc, 0> initial{};
  static constexpr std::array estimate_values{
      ValueDoc{"layer", "scalar", "", "layer of the agent in the acyclic graph"},
      ValueDoc{"done", "scalar", "", "1: it does not change any more"},
      ValueDoc{"uses", "vector of agents", "", "by agent: 1 this agent uses the edge between them, -1 the other does, 0 there is none"}};

  struct Params {
    double id = 1.0;
    Round patience = 0;
    RelativeSensing sensing;
  };
  struct State {
    AcyclicSensing dag;
    Vector layer_done_uses;  ///< layer, done, then by agent: 1: this agent uses the edge, -1: the other does, 0: there is none
    std::vector<char> measures;
    std::vector<AcyclicSensing::Told> told;
  };
  struct Message {
    double layer = 0.0, id = 0.0, changed = 0.0;
    Vector measures;  ///< by agent: 1 where the sender measures it
    static constexpr std::array<std::string_view, 4> field_names{"layer", "id", "changed", "measures"};
    static constexpr std::string_view noisy_field = "";
    static auto fields(auto& m) { return std::tie(m.layer, m.id, m.changed, m.measures); }
  };

  static Params params(const Values& values, const Setup& setup) {
    return {unique_id(values, setup, name),
            patience_of(values, "protocol " + std::string(name) + ": agent " + std::to_string(setup.self.value)),
            RelativeSensing(setup, name)};
  }
  static State init(const Params& p, const Setup& setup) {
    const AcyclicSensing dag(setup.self, setup.agents, p.id, p.sensing.has_absolute(), p.patience);
    Vector out = Vector::Zero(2 + static_cast<Eigen::Index>(setup.agents));
    out[0] = dag.says().layer;
    return {dag, out, std::vector<char>(setup.agents), {}};
  }
  static Message message(const Params& p, const State& s, const Sense& sense) {
    Vector measures(static_cast<Eigen::Index>(s.measures.size()));
    for (std::size_t j = 0; j < s.measures.size(); ++j)
      measures[static_cast<Eigen::Index>(j)] = p.sensing.relative(agent_at(j), sense) ? 1.0 : 0.0;
    return {s.dag.says().layer, s.dag.says().id, s.dag.says().changed, measures};
  }

  /// State at k + 1.
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    for (std::size_t j = 0; j < s.measures.size(); ++j) s.measures[j] = p.sensing.relative(agent_at(j), sense) ? 1 : 0;
    s.told.clear();
    for (const auto& heard : inbox) {
      const Message& m = heard.message;
      s.told.push_back({heard.from, {m.layer, m.id, m.changed}, m.measures[static_cast<Eigen::Index>(index_of(sense.self))] != 0.0});
    }
    s.dag.absorb(sense.k, sense.in_neighbours, s.measures, s.told);
    s.layer_done_uses[0] = s.dag.says().layer;
    s.layer_done_uses[1] = s.dag.done() ? 1.0 : 0.0;
    for (std::size_t j = 0; j < s.measures.size(); ++j) {
      const auto use = s.dag.use(agent_at(j));
      s.layer_done_uses[2 + static_cast<Eigen::Index>(j)] = use == AcyclicSensing::Use::mine     ? 1.0
                                                            : use == AcyclicSensing::Use::theirs ? -1.0
                                                                                                 : 0.0;
    }
  }

  /// Layer (m: no agent with an absolute position within reach), done (0 or 1), use of the edge with each agent (1, -1 or 0).
  static const Vector& estimate(const State& s) { return s.layer_done_uses; }
  static std::vector<Field> estimate_fields(const State& s) { return {{"layer", 1, 1}, {"done", 1, 1}, {"uses", s.measures.size(), 1}}; }
};

}  // namespace consort
