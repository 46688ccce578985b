#include "orchestrator/theory.hpp"

#include "core/decompositions.hpp"
#include "core/metrics.hpp"
#include "orchestrator/survey.hpp"
#include "orchestrator/theory_adaptive.hpp"
#include "orchestrator/theory_control.hpp"
#include "orchestrator/theory_filters.hpp"
#include "orchestrator/theory_observer.hpp"
#include "orchestrator/theory_sensor_network.hpp"
#include "plant/model_physics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace consort {

namespace {

std::string short_number(double value) { return fmt::format("{:.6g}", value); }

std::string vector_text(const Vector& value) {
  if (value.size() == 1) return short_number(value[0]);
  std::string out;
  for (const double component : value) out += (out.empty() ? "" : ", ") + short_number(component);
  return "(" + out + ")";
}

bool zero(const Values& values, std::string_view name) {
  const Matrix* value = values.find(name);
  return value == nullptr || value->isZero(0.0);
}

// Sum of the weights with which the others hear each agent.
Vector weighted_out_degrees(const Graph& graph) {
  Vector out = Vector::Zero(static_cast<Eigen::Index>(graph.agents()));
  for (const auto& [edge, weight] : graph.edges()) out[static_cast<Eigen::Index>(index_of(edge.from))] += weight;
  return out;
}

bool equal_out_degrees(const Graph& graph) {
  const Vector degrees = weighted_out_degrees(graph);
  return degrees.size() == 0 || degrees.maxCoeff() - degrees.minCoeff() <= 1e-12 * std::max(1.0, degrees.maxCoeff());
}

double largest_in_degree(const Graph& graph) {
  double largest = 0.0;
  for (std::size_t i = 0; i < graph.agents(); ++i) {
    double degree = 0.0;
    for (const auto& neighbour : graph.in_neighbours(agent_at(i))) degree += neighbour.weight;
    largest = std::max(largest, degree);
  }
  return largest;
}

// One experiment under examination.
class Examination {
 public:
  explicit Examination(const Experiment& experiment)
      : experiment_(experiment), survey_(survey(experiment.schedule(experiment.seed), experiment.rounds)) {}

  std::vector<Finding> findings() {
    scope();
    connectivity();
    for (const auto& choice : experiment_.protocols) {
      if (!choice.first()) continue;
      if (choice.name == "local_voting") local_voting();
      if (choice.name == "kalman_consensus") kalman(choice);
      for (Finding& finding : examine_control(experiment_, survey_, choice)) out_.push_back(std::move(finding));
      for (Finding& finding : examine_filters(experiment_, survey_, choice)) out_.push_back(std::move(finding));
      for (Finding& finding : examine_sensor_network(experiment_, survey_, choice)) out_.push_back(std::move(finding));
      if (choice.name == "unbiased_kalman_consensus" || choice.name == "unbiased_information_consensus") unbiased(choice);
      if (choice.name == "robust_information_consensus") robust();
      if (adapts_gains(choice.name)) examine_adaptive(experiment_, choice, survey_, out_);
      if (observes_everybody(choice.name)) examine_observer(experiment_, choice, survey_, out_);
    }
    links();
    return std::move(out_);
  }

 private:
  void add(Rating verdict, std::string condition, std::string evidence, std::string consequence) {
    out_.push_back({verdict, std::move(condition), std::move(evidence), std::move(consequence)});
  }

  [[nodiscard]] const Graph& graph() const { return *survey_.segments.front().graph; }
  [[nodiscard]] bool random() const { return !std::holds_alternative<FixedSchedule>(experiment_.topology); }

  void scope() {
    std::set<const Graph*> distinct;
    for (const auto& segment : survey_.segments) distinct.insert(segment.graph.get());
    std::string evidence = fmt::format("{}: {} graphs in rounds 0 to {}", experiment_.topology_text, distinct.size(), survey_.rounds - 1);
    if (survey_.constant())
      evidence = fmt::format("{}: the same graph in rounds 0 to {}, {} edges", experiment_.topology_text, survey_.rounds - 1,
                             graph().edge_count());
    if (!survey_.complete) evidence += fmt::format(" (of {}: more would take long)", experiment_.rounds);
    add(Rating::note, "what was examined", evidence,
        random() ? fmt::format("the topology is random: what follows is true of the rounds drawn with seed {}", experiment_.seed.value)
                 : "what follows is exact for these rounds");
  }

  // Evidence for a property of every round's graph.
  std::string evidence_of(const std::optional<Survey::Failure>& failure) const {
    if (!failure) return survey_.constant() ? "the constant graph" : fmt::format("all {} rounds", survey_.rounds);
    return survey_.constant() ? "the constant graph is not"
                              : fmt::format("not in {} of {} rounds, first in round {}", failure->count, survey_.rounds, failure->first);
  }

  void connectivity() {
    strong_ = survey_.failure(strongly_connected);
    add(strong_ ? Rating::fails : Rating::holds, "strongly connected in every round", evidence_of(strong_),
        strong_ ? "see the union over windows, which is what agreement needs" : "everybody's value reaches everybody in every round");
    const auto spanning = survey_.spanning();
    const std::string theorem = "(Ren, Beard, Kingston 2005, Theorem 3.9: discrete-time scheme, no communication noise)";
    if (spanning.window) {
      add(Rating::holds, "the union of the graphs over bounded windows has a spanning tree",
          *spanning.window == 1 ? "in every single round" : fmt::format("over every {} rounds on end", *spanning.window),
          "Kalman consensus reaches agreement " + theorem);
    } else {
      add(Rating::fails, "the union of the graphs over bounded windows has a spanning tree",
          fmt::format("not from round {} on", spanning.broken_from), "no consensus is promised " + theorem);
    }
    const auto unbalanced = survey_.failure(balanced);
    add(unbalanced ? Rating::fails : Rating::holds, "balanced (in-degree = out-degree at every agent) in every round",
        evidence_of(unbalanced),
        unbalanced
            ? "the value agreed on favours some agents: local voting does not keep the mean of the states, Kalman consensus is biased"
            : "local voting keeps the mean of the states; Kalman consensus is unbiased if also all agents have equally many listeners");
    if (survey_.constant() && experiment_.agents > 1 && experiment_.agents <= kLargestSpectrum)
      add(Rating::note, "algebraic connectivity", short_number(algebraic_connectivity(graph())),
          "smallest real part of the Laplacian's eigenvalues other than one zero: the larger, the faster the agreement");
  }

  /// Does some link, at some time, in some case of a sweep, have the property?
  template <class Property>
  [[nodiscard]] bool any_link(Property property) const {
    bool found = false;
    for (const ProtocolChoice& choice : experiment_.protocols)
      experiment_.links_of(choice).for_each([&](const LinkSpec& spec) { found = found || property(spec); });
    return found;
  }
  [[nodiscard]] bool ideal_links() const {
    return !any_link([](const LinkSpec& link) { return !link.ideal(); });
  }
  [[nodiscard]] std::string limits_of_prediction() const { return ideal_links() ? "" : " with ideal links"; }

  void local_voting() {
    if (survey_.constant() && experiment_.agents <= kLargestSpectrum) {
      local_voting_constant();
      return;
    }
    const double dt = experiment_.dt;
    const auto failure = survey_.failure([dt](const Graph& graph) { return dt * largest_in_degree(graph) < 1.0; });
    add(failure ? Rating::note : Rating::holds, "local_voting: dt times the largest in-degree is below 1 in every round",
        evidence_of(failure),
        failure ? "I - dt L has a weight that is not positive on the diagonal: the products of stochastic matrices say nothing"
                : "I - dt L is stochastic with a positive diagonal, so spanning unions give consensus (Ren, Beard, Kingston 2005, Lemmas "
                  "3.5 and 3.7)");
  }

  // What local voting starts from, one column per agent: the plant's states, or what the agents keep.
  [[nodiscard]] Matrix starting_values() const {
    std::optional<Physics> physics;
    if (experiment_.plant) physics.emplace(plant_task(experiment_, experiment_.seed));
    Matrix out;
    for (std::size_t i = 0; i < experiment_.agents; ++i) {
      const auto state = physics ? physics->state(agent_at(i)) : std::span<const double>();
      const Vector x = physics ? Vector(Eigen::Map<const Vector>(state.data(), static_cast<Eigen::Index>(state.size())))
                               : experiment_.initial_of(agent_at(i), experiment_.seed).vector("x");
      if (i == 0) out.resize(x.size(), static_cast<Eigen::Index>(experiment_.agents));
      out.col(static_cast<Eigen::Index>(i)) = x;
    }
    return out;
  }

  void local_voting_constant() {
    auto spectrum = laplacian_spectrum(graph());
    const auto zero_at =
        std::min_element(spectrum.begin(), spectrum.end(), [](const auto& a, const auto& b) { return std::abs(a) < std::abs(b); });
    if (zero_at != spectrum.end()) spectrum.erase(zero_at);
    double largest = 0.0, step = std::numeric_limits<double>::infinity();
    for (const auto& lambda : spectrum) {
      largest = std::max(largest, std::abs(1.0 - experiment_.dt * lambda));
      // |1 - dt lambda| < 1 exactly if dt < 2 Re(lambda) / |lambda|^2
      step = std::min(step, 2.0 * lambda.real() / std::norm(lambda));
    }
    const bool holds = spectrum.empty() || largest < 1.0 - 1e-12;
    const std::string condition = "local_voting: all eigenvalues of I - dt L other than one 1 lie inside the unit circle";
    const std::string evidence = spectrum.empty() ? "one agent"
                                                  : fmt::format("largest modulus {}; dt = {}, allowed below {}", short_number(largest),
                                                                short_number(experiment_.dt), short_number(step));
    std::string consequence = "the states do not settle: take a smaller dt, or a graph with a spanning tree";
    if (holds && has_spanning_tree(graph())) {
      const Vector value = starting_values() * left_null_vector(graph());
      consequence = fmt::format("the states converge to w^T x(0) = {}{}, w the left null vector of L (Knotek, thesis, (2.13))",
                                vector_text(value), limits_of_prediction());
    }
    add(holds ? Rating::holds : Rating::fails, condition, evidence, consequence);
  }

  // The limit of (4)-(5) with Q = Omega = 0 on a constant strongly connected graph: information Y_i+ = sum (I + g)_ij Y_j and the same for
  // Y_i x_i, so both line up with the left Perron vector w of I + g: limit (sum w_i Y_i)^-1 sum w_i Y_i x_i.
  [[nodiscard]] Vector kalman_limit() const {
    const auto n = static_cast<Eigen::Index>(experiment_.agents);
    const auto [values, vectors] = eigen((Matrix::Identity(n, n) + adjacency(graph())).transpose(), "I + g");
    Eigen::Index largest = 0;
    values.real().maxCoeff(&largest);
    const Vector w = vectors.col(largest).real().cwiseAbs();
    Matrix information;
    Vector weighted;
    for (Eigen::Index i = 0; i < n; ++i) {
      const Values initial = experiment_.initial_of(agent_at(static_cast<std::size_t>(i)), experiment_.seed);
      const Vector x = initial.vector("x");
      const Matrix Y = initial.covariance("P", x.size(), 1.0, true).llt().solve(Matrix::Identity(x.size(), x.size()));
      if (i == 0) {
        information = Matrix::Zero(x.size(), x.size());
        weighted = Vector::Zero(x.size());
      }
      information += w[i] * Y;
      weighted += w[i] * (Y * x);
    }
    return information.llt().solve(weighted);
  }

  [[nodiscard]] bool gains_without_noise(const ProtocolChoice& choice) const {
    const auto clean = [](const Values& values) { return zero(values, "Q") && zero(values, "Omega"); };
    return clean(choice.parameters) && std::all_of(experiment_.overrides.begin(), experiment_.overrides.end(),
                                                   [&](const auto& entry) { return clean(entry.second.parameters); });
  }

  void kalman(const ProtocolChoice& choice) {
    const auto unequal = survey_.failure(equal_out_degrees);
    const std::string condition = "kalman_consensus: in every round all agents have the same number of listeners";
    if (!gains_without_noise(choice)) {
      add(unequal ? Rating::fails : Rating::note, condition, evidence_of(unequal),
          "with Q or Omega above 0 the limit is not the centralised estimate even then (Alighanbari, How 2006, (6) assumes both zero)");
      return;
    }
    std::string value;
    if (survey_.constant() && !strong_ && experiment_.agents <= kLargestSpectrum) {
      const Vector limit = kalman_limit();
      value = fmt::format(": limit {}, centralised {}{}", vector_text(limit),
                          vector_text(centralised_estimate(experiment_, experiment_.seed)), limits_of_prediction());
    }
    add(unequal ? Rating::fails : Rating::holds, condition, evidence_of(unequal),
        (unequal ? "the consensus is biased towards agents with many listeners (Alighanbari, How 2006, section IV)"
                 : "the consensus is the centralised estimate (Alighanbari, How 2006, (7))") +
            value);
  }

  void unbiased(const ProtocolChoice& choice) {
    const bool clean = gains_without_noise(choice);
    const bool weighted = survey_
                              .failure([](const Graph& graph) {
                                const auto edges = graph.edges();
                                return std::all_of(edges.begin(), edges.end(), [](const WeightedEdge& edge) { return edge.weight == 1.0; });
                              })
                              .has_value();
    const bool holds = !strong_ && clean && !weighted;
    std::string evidence = "strongly connected: " + evidence_of(strong_) + (clean ? "; Q = Omega = 0" : "; Q or Omega is above 0");
    if (weighted) evidence += "; some edges have a weight other than 1";
    std::string consequence = "it converges to the centralised estimate " +
                              vector_text(centralised_estimate(experiment_, experiment_.seed)) + limits_of_prediction();
    if (!holds) consequence = "the centralised estimate is not promised";
    if (!clean) consequence += ": once P is small against Omega all gains are alike, and the number of listeners decides again";
    add(holds ? Rating::holds : Rating::fails, choice.name + ": strongly connected in every round, gains without Q and Omega", evidence,
        consequence + " (Alighanbari, How 2006, Theorem 7)");
  }

  void robust() {
    const bool loses = any_link([](const LinkSpec& link) { return link.loses(); });
    const bool steady = survey_.constant() && !strong_;
    const bool holds = steady || (!strong_ && !loses);
    std::string evidence = "strongly connected: " + evidence_of(strong_);
    if (!survey_.constant()) evidence += loses ? "; edges come and go, and links lose messages" : "; edges come and go, nothing is lost";
    add(holds ? Rating::holds : Rating::fails, "robust_information_consensus: strongly connected, without switching where links lose",
        evidence,
        holds ? "it converges to the centralised estimate " + vector_text(centralised_estimate(experiment_, experiment_.seed)) +
                    " at every loss below 1 (Hadjicostis, Vaidya, Dominguez-Garcia 2016, Theorem 1)"
              : "what is lost while an edge is new, or just before it goes, is gone; the centralised estimate is not promised");
  }

  void links() {
    const auto any = [this](auto property) { return any_link(property); };
    if (any([](const LinkSpec& link) { return link.loses(); })) {
      add(Rating::note, "links lose messages", "a lost message is a missing edge in its round; the graphs above are the scheduled ones",
          "the value agreed on depends on what was lost; unbiased_kalman_consensus loses what the message carried, so it is biased (it "
          "divides by listeners, not by deliveries); robust_information_consensus recovers it with the next message");
    }
    if (any([](const LinkSpec& link) { return link.noise_covariance.size() > 0 && !link.noise_covariance.isZero(0.0); })) {
      add(Rating::note, "links add noise", "noise covariance above 0",
          "agreement is never exact and the common value wanders; the theorems above ask for zero noise");
    }
    if (any([](const LinkSpec& link) { return link.quantiser.has_value(); })) {
      add(Rating::note, "links quantise", "numbers of a message are rounded to so many bits",
          "agreement is no closer than the rounding lets it be");
    }
    if (any([](const LinkSpec& link) { return link.delays() || link.duplication > 0.0; })) {
      add(Rating::note, "links delay messages", "delay, reordering or copies",
          "the theorems above are about messages of the same round and do not cover this");
    }
    if (experiment_.links.overrides.empty()) return;
    const Graph support = experiment_.schedule(experiment_.seed).support(experiment_.rounds);
    for (const auto& [edge, spec] : experiment_.links.overrides)
      if (!support.has(edge))
        add(Rating::note, fmt::format("link override on {} -> {}", edge.from.value, edge.to.value), "the topology never has this edge",
            "the override has no effect");
  }

  const Experiment& experiment_;
  Survey survey_;
  std::optional<Survey::Failure> strong_;
  std::vector<Finding> out_;
};

}  // namespace

std::vector<Finding> examine(const Experiment& experiment) { return Examination(experiment).findings(); }

}  // namespace consort
