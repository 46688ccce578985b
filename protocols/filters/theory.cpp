#include "protocols/filters/theory.hpp"

#include "core/counted.hpp"
#include "core/math/controllability.hpp"
#include "core/math/decompositions.hpp"
#include "core/math/discretise.hpp"
#include "core/math/schur.hpp"
#include "core/math/shapes.hpp"
#include "models/physics.hpp"
#include "models/registry.hpp"
#include "protocols/filters/stationary_gains.hpp"
#include "protocols/luenberger.hpp"
#include "protocols/theory_case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace consort {
namespace {

using Kind = FilterKind;

// One protocol under examination.
class FilterExamination {
 public:
  FilterExamination(Kind kind, const TheoryCase& of, Findings& out)
      : kind_(kind),
        of_(of),
        experiment_(of.experiment),
        survey_(of.survey),
        out_(out),
        support_(of.experiment.schedule(of.experiment.seed).support(of.experiment.rounds)) {
    const Physics physics(plant_task(experiment_, experiment_.seed));
    shared_ = physics.shared();
    for (std::size_t i = 0; i < experiment_.agents; ++i) {
      const Values model = physics.knowledge(agent_at(i));
      if (!model.has("A")) return;
      if (i == 0) A_ = *model.find("A");
      C_.push_back(model.has("C") ? *model.find("C") : Matrix(0, A_.cols()));
    }
  }

  void examine() {
    if (C_.size() < experiment_.agents) return;  // the protocol itself says that it needs A
    one_plant();
    if (!seen_by_somebody()) return;
    if (kind_ != Kind::luenberger_zhang && kind_ != Kind::centralised) connected();
    if (kind_ == Kind::luenberger_zhang) groups_arrive();
    if (kind_ == Kind::centralised || kind_ == Kind::iterative) sees_enough("the measurements of i and its in-neighbours", true);
    if (kind_ == Kind::olfati_saber) {
      const bool aggregated = parameters(0).scalar("aggregated") == 1.0;
      sees_enough(aggregated ? "the measurements of i and its in-neighbours" : "its own measurement", aggregated);
    }
    if (kind_ == Kind::centralised) who_is_centralised();
    if (luenberger()) ask_no_noise(of_, out_, "the errors end within a bound, not at zero");
    stability();
  }

 private:
  void add(Rating verdict, const std::string& condition, std::string evidence, std::string consequence) {
    out_.add(verdict, condition, std::move(evidence), std::move(consequence));
  }
  [[nodiscard]] bool luenberger() const { return kind_ == Kind::luenberger_kim || kind_ == Kind::luenberger_zhang; }
  [[nodiscard]] Values parameters(std::size_t i) const { return of_.parameters(agent_at(i)); }
  [[nodiscard]] const Graph& graph() const { return *survey_.segments.front().graph; }

  // C of several agents, one below the other.
  [[nodiscard]] Matrix stacked(const std::vector<std::size_t>& agents) const {
    Eigen::Index rows = 0;
    for (const std::size_t i : agents) rows += C_[i].rows();
    Matrix C(rows, A_.cols());
    rows = 0;
    for (const std::size_t i : agents) {
      C.middleRows(rows, C_[i].rows()) = C_[i];
      rows += C_[i].rows();
    }
    return C;
  }
  // An eigenvalue of A that does not decay and that C does not see.
  [[nodiscard]] std::optional<std::complex<double>> unseen(const Matrix& C) const {
    return detectable(A_, C.rows() > 0 ? C : Matrix(Matrix::Zero(1, A_.cols()))).offending;
  }
  [[nodiscard]] std::vector<std::size_t> everybody() const {
    std::vector<std::size_t> all(experiment_.agents);
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
    return all;
  }

  void one_plant() {
    add(shared_ ? Rating::holds : Rating::refused, "all agents observe one plant", "model " + experiment_.plant->model,
        shared_ ? "estimates of one state can be combined"
                : "every agent has a state of its own here: take one of the models " + shared_plants());
  }

  // --- who sees what ------------------------------------------------------------------------------------------------------

  bool seen_by_somebody() {
    const auto mode = unseen(stacked(everybody()));
    add(mode ? Rating::refused : Rating::holds, "(A, C) is detectable, C of all agents together",
        mode ? "nobody sees the mode with eigenvalue " + text_of(*mode) : fmt::format("A is {}", shape_of(A_)),
        mode ? "no observer can follow what no measurement shows and what does not decay by itself"
             : "together the agents see all that does not decay by itself");
    return !mode;
  }

  // Whether each agent's own Riccati equation has a bounded solution.
  void sees_enough(const std::string& with, bool in_neighbours) {
    std::string evidence;
    for (std::size_t i = 0; i < experiment_.agents && evidence.empty(); ++i)
      if (const auto mode = unseen(stacked(with_in_neighbours(*support_, i, in_neighbours))))
        evidence = fmt::format("agent {} does not see the mode with eigenvalue {}", i + 1, text_of(*mode));
    const bool holds = evidence.empty();
    add(holds ? Rating::holds : Rating::fails, "(A, C) is detectable for every agent i with " + with, holds ? "every agent" : evidence,
        holds ? "every covariance P_i stays bounded" : "its covariance P_i grows without bound, and with it its gain");
  }

  void who_is_centralised() {
    std::string who;
    for (std::size_t i = 0; i < experiment_.agents; ++i)
      if (survey_.constant() && graph().in_degree(agent_at(i)) + 1 == experiment_.agents)
        who += (who.empty() ? "" : ", ") + std::to_string(i + 1);
    add(Rating::note, "agents that hear everybody in every round", who.empty() ? "none" : who,
        who.empty() ? "nobody is the centralised filter" : "they are the centralised filter, of which no linear filter has less variance");
  }

  // --- who hears whom -----------------------------------------------------------------------------------------------------

  void connected() {
    std::string torn;
    const auto reached = reached_from({0}, false), reaches = reached_from({0}, true);
    for (std::size_t i = 1; i < experiment_.agents && torn.empty(); ++i) {
      if (!reached[i])
        torn = fmt::format("no path leads from agent 1 to agent {}", i + 1);
      else if (!reaches[i])
        torn = fmt::format("no path leads from agent {} to agent 1", i + 1);
    }
    const auto weak = survey_.failure(strongly_connected);
    const std::string condition = "connected (Assumptions 1, 3)";
    if (!torn.empty())
      add(Rating::refused, condition, torn, "what some agents see never reaches others");
    else if (weak)
      add(Rating::fails, condition,
          fmt::format("not in {}, first in round {}; all rounds together are", counted(weak->count, "round"), weak->first),
          "the theorem is about a graph that is connected in every round");
    else
      add(Rating::holds, condition, "in every round", "what one agent sees reaches all others");
    std::string one_way;
    for (const auto& [edge, weight] : support_->edges())
      if (one_way.empty() && !support_->has({edge.to, edge.from}))
        one_way = fmt::format("{} -> {} has no way back", edge.from.value, edge.to.value);
    add(one_way.empty() ? Rating::holds : Rating::fails, "undirected (Assumptions 1, 3)",
        one_way.empty() ? "every edge goes both ways" : one_way,
        one_way.empty() ? "the theorem is about such graphs" : "the theorem does not cover it; see the error matrix");
  }

  // Which agents a path leads to from one of `agents`, which are among them; `backwards`: from whom a path leads to one of them.
  [[nodiscard]] std::vector<bool> reached_from(std::vector<std::size_t> agents, bool backwards) const {
    std::vector<std::vector<std::size_t>> listeners(experiment_.agents);
    for (const auto& [edge, weight] : support_->edges())
      listeners[index_of(backwards ? edge.to : edge.from)].push_back(index_of(backwards ? edge.from : edge.to));
    std::vector<bool> reached(experiment_.agents, false);
    for (const std::size_t i : agents) reached[i] = true;
    while (!agents.empty()) {
      const std::size_t from = agents.back();
      agents.pop_back();
      for (const std::size_t to : listeners[from])
        if (!reached[to]) {
          reached[to] = true;
          agents.push_back(to);
        }
    }
    return reached;
  }

  void groups_arrive() {
    const StateGroups groups = state_groups(A_);
    std::string failure;
    for (std::size_t j = 0; j < groups.size() && failure.empty(); ++j) {
      std::vector<std::size_t> who;
      for (std::size_t i = 0; i < experiment_.agents; ++i)
        if (seen_groups(groups, C_[i])[j]) who.push_back(i);
      const auto reached = reached_from(who, false);
      const auto missed = std::find(reached.begin(), reached.end(), false);
      if (who.empty())
        failure = fmt::format("nobody sees the state group {}", group_text(groups[j]));
      else if (missed != reached.end())
        failure = fmt::format("no path leads to agent {} from anybody who sees the state group {}", missed - reached.begin() + 1,
                              group_text(groups[j]));
    }
    add(failure.empty() ? Rating::holds : Rating::refused, "a path leads from those who see a state group to all others (Assumptions 6, 7)",
        failure.empty() ? fmt::format("{} state groups", groups.size()) : failure,
        failure.empty() ? "every agent can take over what it does not see" : "it can never know that part of the state");
  }

  // --- what becomes of the error ------------------------------------------------------------------------------------------

  void stability() {
    const Eigen::Index order = A_.rows() * static_cast<Eigen::Index>(experiment_.agents);
    const std::string condition = kind_ == Kind::iterative ? "all eigenvalues of the whole error matrix lie inside the unit circle"
                                                           : "all eigenvalues of the whole error matrix have a negative real part";
    if (!survey_.constant()) {
      add(Rating::note, condition, "the graph changes", "one matrix says nothing of it");
      return;
    }
    if (!of_.effort.affords(2.0 * spectrum_cost(static_cast<double>(order)) + design_cost())) {
      out_.leave_out(condition, fmt::format("a matrix of order {}", order));
      return;
    }
    try {
      if (kind_ == Kind::iterative)
        iterative_stability(condition);
      else
        continuous_stability(condition, gains().network());
    } catch (const ConfigError& error) {
      add(Rating::note, condition, "there are no stationary gains", error.what());
    } catch (const RunError& error) {
      add(Rating::note, condition, "the stationary gains were not found", error.what());
    }
  }

  void continuous_stability(const std::string& condition, const EstimatorNetwork& network) {
    const double slowest = spectral_abscissa(network.error_matrix(graph()));
    const bool stable = slowest < 0.0;
    add(stable ? Rating::holds : Rating::fails, condition, fmt::format("largest real part {} at stationary gains", text_of(slowest)),
        stable ? "without noise all errors go to zero at that rate" : "the errors do not go to zero: a larger coupling gain may help");
    if (!stable) return;
    const auto radius = [&](Seconds h) { return spectral_radius(network.sampled_error_matrix(graph(), h)); };
    double fastest = network.A.norm();
    for (std::size_t i = 0; i < experiment_.agents; ++i)
      fastest = std::max(fastest, network.A.norm() + network.injection[i].norm() +
                                      network.coupling[i].norm() * std::max(1.0, weighted_in_degree(graph(), agent_at(i))));
    const double order = static_cast<double>(network.A.rows()) * static_cast<double>(experiment_.agents);
    ask_short_step(of_, out_, "correcting and predicting in rounds", {radius, 1e-3 / fastest, spectrum_cost(order), ""},
                   "the errors decay in rounds too", "the errors do not decay in rounds");
  }
  [[nodiscard]] StationaryGains gains() const { return {kind_, of_, A_, C_, graph()}; }
  // What the stationary gains of all agents take: a Riccati equation each.
  [[nodiscard]] double design_cost() const {
    return 20.0 * static_cast<double>(experiment_.agents) * spectrum_cost(static_cast<double>(A_.rows()));
  }

  void iterative_stability(const std::string& condition) {
    const Matrix step = matrix_exponential(A_, experiment_.dt);
    const auto [filters, overshoot] = gains().iterative(step);
    const double largest = spectral_radius(iterative_error_matrix(step, filters, graph()));
    const bool stable = largest < 1.0;
    add(stable ? Rating::holds : Rating::fails, condition, fmt::format("largest modulus {} at stationary gains", text_of(largest)),
        stable ? "without noise all errors go to zero by that factor in a round"
               : "the errors do not go to zero: a smaller epsilon may help");
    add(overshoot > 1.0 ? Rating::fails : Rating::holds, "epsilon d_i |M_i| <= 1 for every agent i",
        fmt::format("at most {} at stationary gains", text_of(overshoot)),
        overshoot > 1.0 ? "the coupling overshoots: take a smaller epsilon, or bounded: 1" : "the coupling does not overshoot");
  }

  Kind kind_;
  const TheoryCase& of_;
  const Experiment& experiment_;
  const Survey& survey_;
  Findings& out_;
  std::shared_ptr<const Graph> support_;  // every edge of the run
  bool shared_ = false;
  Matrix A_;
  std::vector<Matrix> C_;  // by agent; 0 x n: measures nothing
};

}  // namespace

void examine_kalman_bucy(const TheoryCase& of, Findings& out) { FilterExamination(Kind::centralised, of, out).examine(); }
void examine_dkf_olfati_saber(const TheoryCase& of, Findings& out) { FilterExamination(Kind::olfati_saber, of, out).examine(); }
void examine_dkf_iterative(const TheoryCase& of, Findings& out) { FilterExamination(Kind::iterative, of, out).examine(); }
void examine_dkf_kim(const TheoryCase& of, Findings& out) { FilterExamination(Kind::kim, of, out).examine(); }
void examine_dlo_kim(const TheoryCase& of, Findings& out) { FilterExamination(Kind::luenberger_kim, of, out).examine(); }
void examine_dlo_zhang(const TheoryCase& of, Findings& out) { FilterExamination(Kind::luenberger_zhang, of, out).examine(); }

}  // namespace consort
