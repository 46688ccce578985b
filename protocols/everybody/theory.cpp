#include "protocols/everybody/theory.hpp"

#include "core/counted.hpp"
#include "core/math/controllability.hpp"
#include "core/math/schur.hpp"
#include "core/math/shapes.hpp"
#include "core/network/graph_witness.hpp"
#include "models/physics.hpp"
#include "protocols/everybody/observed_case.hpp"
#include "protocols/everybody/sensing_theory.hpp"
#include "protocols/theory_case.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <map>
#include <optional>

namespace consort {
namespace {

constexpr std::size_t kMostCases = 6;  // different graphs of one run whose whole error is examined

// One protocol of one experiment under examination.
class ObserverExamination {
 public:
  ObserverExamination(ObserverTask task, const TheoryCase& of, Findings& out)
      : task_(task),
        of_(of),
        experiment_(of.experiment),
        choice_(of.choice),
        survey_(of.survey),
        physics_(plant_task(of.experiment, of.experiment.seed)),
        out_(out) {
    for (std::size_t i = 0; i < experiment_.agents; ++i) knowledge_.push_back(physics_.knowledge(agent_at(i)));
  }

  void examine() {
    connectivity();
    if (senses()) ask_sensing_is_communicated(of_, knowledge_, out_);
    if (senses()) ask_unique_ids(of_, out_);
    if (!collect_cases()) return;
    if (senses()) {
      dag();
      if (!localises()) return;
      grounded();
    } else {
      one_order();
    }
    if (!observable_agents()) return;
    own_observers();
    if (!one_gain()) return;
    coupling();
    whole_error();
  }

 private:
  struct Case {
    Round first = 0;  // round in which it is met first
    ObservedCase of;
  };
  [[nodiscard]] bool localises() const { return task_ == ObserverTask::localise; }
  [[nodiscard]] bool senses() const { return task_ != ObserverTask::observe; }
  void add(Rating verdict, const std::string& condition, std::string evidence, std::string consequence) {
    out_.add(verdict, condition, std::move(evidence), std::move(consequence));
  }
  [[nodiscard]] std::string where(const Case& one) const {
    return cases_.size() == 1 ? "" : fmt::format(" (from round {} on, agents {})", one.first, fmt::join(numbers(one.of.members), ", "));
  }
  static std::vector<std::uint32_t> numbers(const std::vector<AgentId>& agents) {
    std::vector<std::uint32_t> out;
    for (const AgentId agent : agents) out.push_back(agent.value);
    return out;
  }

  // The different communication graphs with those that are there, the earliest first. False if nothing can be said of any.
  bool collect_cases() {
    const std::string condition = "what follows from the graphs with those that are there";
    const auto n = static_cast<double>(experiment_.agents);
    for (const std::size_t s : survey_.distinct()) {
      if (survey_.members[s]->empty()) continue;
      if (cases_.size() == kMostCases || !of_.effort.affords(50.0 * n * n * n)) {
        out_.leave_out(condition, fmt::format("from round {} on: {}", survey_.segments[s].first,
                                              cases_.empty() ? "too many agents" : "too many different graphs"));
        break;
      }
      const Round first = survey_.segments[s].first;
      cases_.push_back({first, observed_case(task_, experiment_, choice_, knowledge_, *survey_.segments[s].graph, first)});
    }
    return !cases_.empty();
  }

  // Refused if even the union of all graphs, as long as the same agents are there, is not strongly connected.
  void connectivity() {
    const std::string condition = "strongly connected communication among the agents that are there";
    const std::string theorem = localises() ? "(Theorem 4.15, condition 3)" : "(Huang et al. 2025, Theorem 3.2)";
    std::optional<Round> weak;
    for (std::size_t s = 0; s < survey_.segments.size();) {
      const Survey::Members& members = *survey_.members[s];
      const Round first = survey_.segments[s].first;
      std::vector<Graph> graphs;
      for (; s < survey_.segments.size() && *survey_.members[s] == members; ++s) {
        if (graphs.empty() || survey_.graphs[s] != survey_.graphs[s - 1]) graphs.push_back(*survey_.graphs[s]);
        if (!weak && members.size() > 1 && !strongly_connected(*survey_.graphs[s])) weak = survey_.segments[s].first;
      }
      if (members.size() < 2) continue;
      const Graph all = union_of(graphs);
      if (strongly_connected(all)) continue;
      const auto [from, to] = *some_unreached(all);
      add(Rating::refused, condition,
          fmt::format("from round {} on, nothing that agent {} says reaches agent {}", first, word(members[index_of(from)]),
                      word(members[index_of(to)])),
          "agents behind the gap never learn the others' states " + theorem);
      return;
    }
    add(weak ? Rating::fails : Rating::holds, condition,
        weak ? fmt::format("not in round {}, but over all rounds together", *weak) : "in every round",
        weak ? "convergence is proved for graphs that are strongly connected at all times " + theorem
             : "every agent can follow every other's own estimate " + theorem);
  }

  void dag() {
    for (const Case& one : cases_) {
      std::vector<std::string> uses;
      for (const Edge& edge : one.of.uses) uses.push_back(word(edge.to) + " uses " + word(edge.from));
      add(Rating::note, "the acyclic sensing graph", fmt::format("layers {}{}", fmt::join(one.of.layers, " "), where(one)),
          fmt::format("{}; the agents know it is final within {} rounds of a change, and those of 'patience'",
                      uses.empty() ? "nobody uses a relative measurement" : fmt::format("{}", fmt::join(uses, ", ")),
                      2 * experiment_.agents));
    }
  }

  void grounded() {
    const std::string condition = "an absolute position is within reach of everybody over sensing edges (Theorem 4.15, condition 1)";
    for (const Case& one : cases_) {
      const auto& layers = one.of.layers;
      const auto lost = std::find(layers.begin(), layers.end(), layers.size());
      if (lost == layers.end()) continue;
      add(Rating::refused, condition,
          fmt::format("agent {} has none{}", word(one.of.members[static_cast<std::size_t>(lost - layers.begin())]), where(one)),
          "the team is not observable: where these agents are cannot be told from what anybody measures (Proposition 4.10)");
      return;
    }
    add(Rating::holds, condition, "by their layers", "the team is observable (Proposition 4.10)");
    // An agent of a layer above zero uses an edge to the layer below, one of layer zero its absolute position.
    add(Rating::holds, "every agent uses a measurement after DAGC (Theorem 4.15, condition 2)",
        "its absolute one, or one of the layer below", "every (A_ii, C_ii) is observable (Proposition 4.12)");
  }

  void one_order() {
    const std::string condition = "dynamics and sensing couplings have a common topological order (Assumption 2)";
    std::vector<Edge> edges;
    for (std::size_t i = 0; i < knowledge_.size(); ++i)
      for (std::size_t j = 0; j < knowledge_.size(); ++j)
        for (const char* name : {"A_", "C_"})
          if (const Matrix* coupling = knowledge_[i].find(name + std::to_string(j + 1)); coupling != nullptr && !coupling->isZero(0.0))
            edges.push_back({agent_at(j), agent_at(i)});
    if (const auto cycle = some_cycle(Graph(knowledge_.size(), edges)); !cycle.empty()) {
      add(Rating::refused, condition, fmt::format("the couplings run in a circle: {}", fmt::join(numbers(cycle), " -> ")),
          "R of (10) is not triangular, and gains that agents choose alone do not make it stable");
      return;
    }
    add(Rating::holds, condition, edges.empty() ? "no couplings" : fmt::format("{}, none in a circle", counted(edges.size(), "coupling")),
        "R of (10) is triangular: stable blocks make it stable");
  }

  bool observable_agents() {
    const std::string condition = "every (A_ii, C_ii) is observable (Assumption 1)";
    for (const Case& one : cases_)
      for (std::size_t i = 0; i < one.of.members.size(); ++i) {
        const ObservedAgent& agent = one.of.system.agents[i];
        std::string why = "it measures nothing";
        if (agent.C.rows() > 0) {
          const auto verdict = observable(agent.A, agent.C);
          if (verdict) continue;
          why = "C does not show the eigenvalue " + text_of(*verdict.offending);
        }
        add(Rating::refused, condition, fmt::format("not that of agent {}: {}{}", word(one.of.members[i]), why, where(one)),
            "no gain F of that agent makes its own observer follow its state");
        return false;
      }
    add(Rating::holds, condition, "at every agent", "a stabilising gain F_i exists at every agent");
    return true;
  }

  void own_observers() {
    const std::string condition = "every A_ii - F_i C_ii is stable";
    double slowest = -std::numeric_limits<double>::infinity();
    for (const Case& one : cases_)
      for (std::size_t i = 0; i < one.of.members.size(); ++i) {
        const ObservedAgent& agent = one.of.system.agents[i];
        const double abscissa = spectral_abscissa(agent.A - agent.F * agent.C);
        slowest = std::max(slowest, abscissa);
        if (abscissa < 0.0) continue;
        add(Rating::fails, condition,
            fmt::format("that of agent {} has an eigenvalue with real part {}{}", word(one.of.members[i]), text_of(abscissa), where(one)),
            "its own observer does not follow its state: choose another F");
        return;
      }
    add(Rating::holds, condition, "slowest eigenvalue's real part " + text_of(slowest), "every agent's own observer follows its state");
  }

  // The whole error is examined with one mu.
  bool one_gain() {
    for (const Case& one : cases_)
      for (const double mu : one.of.mu)
        if (mu != one.of.mu.front()) {
          add(Rating::fails, "all agents have the same mu", fmt::format("{} and {}", text_of(one.of.mu.front()), text_of(mu)),
              "(13) and R of (10) are those of one mu: give mu, or one rho for its rule");
          return false;
        }
    return true;
  }

  void coupling() {
    const std::string condition = "mu > max Re lambda(A_jj) / min Re lambda(S^(j)) (13, with real parts)";
    for (const Case& one : cases_) {
      const auto n = static_cast<double>(one.of.members.size());
      if (!of_.effort.affords(n * spectrum_cost(n))) {
        out_.leave_out(condition, fmt::format("{} agents are too many for all S^(j)", n));
        continue;
      }
      double fastest = -std::numeric_limits<double>::infinity();
      for (const ObservedAgent& agent : one.of.system.agents) fastest = std::max(fastest, spectral_abscissa(agent.A));
      const double smallest = consensus_spectrum(one.of.system.communication, one.of.system.weights).smallest_real;
      const double mu = one.of.system.mu, bound = std::max(0.0, fastest / smallest);
      // On the edge of stability itself (integrators: max Re lambda(A) = 0) any mu > 0 will do.
      const bool holds = smallest > 1e-12 && mu > bound;
      add(holds ? Rating::holds : Rating::fails, condition,
          smallest > 1e-12 ? fmt::format("mu = {}, the bound is {} = {} / {}{}", text_of(mu), text_of(bound),
                                         text_of(std::max(0.0, fastest)), text_of(smallest), where(one))
                           : fmt::format("an eigenvalue of some S^(j) is zero{}", where(one)),
          holds ? "everybody's estimates follow each agent's own" : "the consensus is too slow for the plant: take a larger mu");
    }
  }

  void whole_error() {
    for (const Case& one : cases_) {
      const ObservedSystem& system = one.of.system;
      const Eigen::Index size = system.error_size();
      const std::string condition = "the whole error E' = R E is stable (10)";
      if (!of_.effort.affords(spectrum_cost(static_cast<double>(size)))) {
        out_.leave_out(condition, fmt::format("{} components are too many{}", size, where(one)));
        continue;
      }
      const double abscissa = spectral_abscissa(error_matrix(system));
      add(abscissa < 0.0 ? Rating::holds : Rating::fails, condition,
          fmt::format("spectral abscissa {} of {}{}", text_of(abscissa), counted(static_cast<std::uint64_t>(size), "component"),
                      where(one)),
          abscissa < 0.0 ? (one.of.inputs_known ? "all estimates converge" : "the errors stay bounded as the inputs are (19)")
                         : "the estimates do not converge");
      if (abscissa < 0.0) step(one);
    }
  }

  void step(const Case& one) {
    const auto radius = [&](Seconds h) { return spectral_radius(sampled_error_matrix(one.of.system, h)); };
    const std::string_view order = one.of.system.scheme == SampledScheme::first_order ? "first" : "second";
    const double cost = 2.0 * spectrum_cost(static_cast<double>(one.of.system.error_size()));
    ask_short_step(of_, out_, "the sampled scheme", {radius, std::min(experiment_.dt, 1e-3), cost, where(one)},
                   fmt::format("correct and predict once a round is stable, and {}-order accurate in dt", order),
                   "the sampled scheme is unstable");
  }

  ObserverTask task_;
  const TheoryCase& of_;
  const Experiment& experiment_;
  const ProtocolChoice& choice_;
  const Survey& survey_;
  Physics physics_;
  std::vector<Values> knowledge_;
  std::vector<Case> cases_;
  Findings& out_;
};

}  // namespace

void examine_distributed_observer(const TheoryCase& of, Findings& out) { ObserverExamination(ObserverTask::observe, of, out).examine(); }
void examine_acyclic_sensing(const TheoryCase& of, Findings& out) { ObserverExamination(ObserverTask::settle, of, out).examine(); }
void examine_cooperative_localization(const TheoryCase& of, Findings& out) {
  ObserverExamination(ObserverTask::localise, of, out).examine();
}

}  // namespace consort
