#include "protocols/adaptive/theory.hpp"

#include "core/math/controllability.hpp"
#include "core/math/decompositions.hpp"
#include "core/math/shapes.hpp"
#include "models/physics.hpp"
#include "protocols/adaptive/asked_graph.hpp"
#include "protocols/adaptive/gains.hpp"
#include "protocols/adaptive/reference.hpp"
#include "protocols/theory_case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numbers>
#include <optional>

namespace consort {
namespace {

struct Demand {
  AskedGraph asks;
  std::string_view theorem;
  bool linear = false;     // gains from the Riccati equation of the agent's own (A, B)
  bool noiseless = false;  // gains that only grow, as long as anything disturbs the agents
  // Names of values, where the protocol has any:
  std::string_view constant = {};   // the parameter that is its gain, which it does not adapt
  std::string_view velocity = {};   // the parameter that weighs the velocity, where K is not from the Riccati equation
  std::string_view reference = {};  // the initial value that its gains decay to
  std::string_view further = {};    // the initial value of further gains
  bool cubed = false;               // gains are multiplied by (1 + xi' P xi)^3
};

// algebraic_connectivity(), with the spectrum at hand.
double connectivity_of(const Graph& graph, const Spectra::Spectrum& spectrum) {
  if (graph.agents() < 2 || !has_spanning_tree(graph)) return 0.0;
  const auto zero =
      std::min_element(spectrum.begin(), spectrum.end(), [](const auto& a, const auto& b) { return std::abs(a) < std::abs(b); });
  return spectrum[zero == spectrum.begin() ? 1 : 0].real();
}

double largest_modulus(const std::vector<std::complex<double>>& spectrum) {
  double largest = 0.0;
  for (const auto& lambda : spectrum) largest = std::max(largest, std::abs(lambda));
  return largest;
}

// One protocol of one experiment under examination.
class AdaptiveExamination {
 public:
  AdaptiveExamination(const TheoryCase& of, const Demand& demand, Findings& out)
      : of_(of), experiment_(of.experiment), choice_(of.choice), demand_(demand), out_(out), graphs_(of.survey.graphs) {}

  void examine() {
    connectivity();
    if (demand_.noiseless)
      ask_no_noise(of_, out_, "the gains grow as long as anything disturbs the agents, and with them what they ask of dt");
    if (!experiment_.plant) return;
    const Physics physics(plant_task(experiment_, experiment_.seed));
    if (demand_.linear && !stabilisable_agents(physics)) return;
    if (!spectra()) {
      out_.leave_out(step_condition(), "too many graphs or agents for eigenvalues");
      return;
    }
    step(physics);
    if (estimates_eigenvalues()) resolution();
  }

 private:
  void add(Rating verdict, const std::string& condition, std::string evidence, std::string consequence) {
    out_.add(verdict, condition, std::move(evidence), std::move(consequence));
  }
  [[nodiscard]] std::string step_condition() const {
    return demand_.constant.empty() ? "dt < 2 / (c lambda_max(K B) lambda_max(L)) at the largest gain c" : "dt < 2 / (c lambda_max(L))";
  }
  [[nodiscard]] bool estimates_eigenvalues() const {
    return !demand_.reference.empty() &&
           Reference::rule(out_.protocol(), choice_.parameters, experiment_.dt).kind == Reference::Kind::eigenvalue;
  }

  void connectivity() {
    const auto unfit = of_.survey.failure([this](const Graph& graph) { return suits(graph, demand_.asks); });
    const std::string condition = std::string(wording(demand_.asks)) + ", in every round";
    if (!unfit) {
      add(Rating::holds, condition, of_.survey.constant() ? "the constant graph" : "among the agents that are there",
          fmt::format("the agents come to agree, as far as the gains suffice ({})", demand_.theorem));
      return;
    }
    const auto segment = std::find_if(of_.survey.segments.begin(), of_.survey.segments.end(),
                                      [&](const Schedule::Segment& one) { return one.first == unfit->first; });
    const Graph& graph = *graphs_[static_cast<std::size_t>(segment - of_.survey.segments.begin())];
    add(Rating::fails, condition, fmt::format("not in round {}", unfit->first),
        has_spanning_tree(graph) ? fmt::format("a spanning tree is there, but {} does not cover this graph", demand_.theorem)
                                 : "there is no spanning tree: the agents cannot agree");
  }

  bool stabilisable_agents(const Physics& physics) {
    for (std::size_t i = 0; i < experiment_.agents; ++i) {
      const Values known = physics.knowledge(agent_at(i));
      const Matrix *A = known.find("A"), *B = known.find("B");
      if (A == nullptr || B == nullptr) return false;  // the protocol refuses such a plant itself
      if (const Verdict verdict = stabilisable(*A, *B); !verdict) {
        add(Rating::fails, "(A, B) is stabilisable",
            fmt::format("agent {}: eigenvalue {} of A is out of reach of u", i + 1, text_of(*verdict.offending)),
            "no gain K makes the differences vanish, the Riccati equation (4.28) has no stabilising solution");
        return false;
      }
    }
    add(Rating::holds, "(A, B) is stabilisable", "every agent", "the Riccati equation (4.28) has a stabilising solution");
    return true;
  }

  bool spectra() {
    for (const std::size_t s : of_.survey.distinct()) {
      const Spectra::Spectrum* spectrum = of_.spectra.of(*graphs_[s]);
      if (spectrum == nullptr) return false;
      largest_ = std::max(largest_, largest_modulus(*spectrum));
      smallest_ = std::min(smallest_, connectivity_of(*graphs_[s], *spectrum));
    }
    return true;
  }

  [[nodiscard]] double largest_initial(std::string_view name, std::optional<double> fallback = {}) const {
    double largest = 0.0;
    for (std::size_t i = 0; i < experiment_.agents; ++i) largest = std::max(largest, of_.initial(agent_at(i)).scalar(name, fallback));
    return largest;
  }

  // Gains known before the run that the loop has to bear, and where they come from.
  struct KnownGain {
    double value;
    std::string text;
  };
  [[nodiscard]] KnownGain known_gain(const Physics& physics, const ConsensusGains& gains) const {
    const double c = largest_initial("c");
    KnownGain known{c, "c(0) = " + text_of(c)};
    const auto raise = [&](double value, const std::string& text) {
      if (value > known.value) known = {value, text + text_of(value)};
    };
    if (!demand_.reference.empty()) raise(largest_initial(demand_.reference, c), std::string(demand_.reference) + " = ");
    if (estimates_eigenvalues() && smallest_ > 0.0) raise(0.5 / smallest_, "kappa = 1 / (2 lambda_2) = ");
    if (!demand_.further.empty()) raise(largest_initial(demand_.further), std::string(demand_.further) + "(0) = ");
    if (demand_.cubed) raise(c * largest_rho(physics, gains.P), "c(0) rho(0) = ");
    return known;
  }

  // Largest (1 + xi_i' P xi_i)^3 at the start, in round 0.
  [[nodiscard]] double largest_rho(const Physics& physics, const Matrix& P) const {
    const Graph graph = *experiment_.schedule(experiment_.seed).at(0);
    double largest = 1.0;
    for (std::size_t i = 0; i < experiment_.agents; ++i) {
      const auto state = [&](AgentId j) { return Eigen::Map<const Vector>(physics.state(j).data(), P.rows()); };
      Vector xi = Vector::Zero(P.rows());
      for (const Neighbour& j : graph.in_neighbours(agent_at(i))) xi += j.weight * (state(agent_at(i)) - state(j.id));
      largest = std::max(largest, std::pow(1.0 + xi.dot(P * xi), 3.0));
    }
    return largest;
  }

  // A loop of gain c adds poles down to -c lambda_max(K B) lambda_max(L) (exact as c grows); held over dt it rings up beyond 2 / dt.
  void step(const Physics& physics) {
    if (largest_ <= 0.0) return;
    double stiffness = 1.0;  // lambda_max(K B), of the velocity feedback where K is not from the Riccati equation
    ConsensusGains gains;
    if (demand_.linear) {
      const Values model = physics.knowledge(agent_at(0)), none;
      gains = consensus_gains(choice_.name, choice_.parameters,
                              Setup{agent_at(0), experiment_.agents, experiment_.dt, none, model, physics.measurement_size(agent_at(0))});
      const Eigen::VectorXcd of_KB = eigenvalues(Matrix(gains.K * *model.find("B")), "K B");
      stiffness = largest_modulus({of_KB.begin(), of_KB.end()});
    }
    if (!demand_.velocity.empty()) stiffness = of_.parameters().scalar(demand_.velocity);
    const double allowed = 2.0 / (experiment_.dt * stiffness * largest_);
    if (!demand_.constant.empty()) {
      const double c = of_.parameters().scalar(demand_.constant);
      add(c < allowed ? Rating::holds : Rating::fails, step_condition(),
          fmt::format("c = {}, lambda_max(L) = {}: dt = {}, allowed below {}", text_of(c), text_of(largest_), text_of(experiment_.dt),
                      text_of(2.0 / (c * largest_))),
          c < allowed ? "held over a round, the coupling does not ring up" : "held over a round, the coupling rings up: take a smaller dt");
      return;
    }
    const KnownGain known = known_gain(physics, gains);
    const bool fits = known.value < allowed;
    add(fits ? Rating::note : Rating::fails, step_condition(),
        fmt::format("dt = {} allows gains up to {} (lambda_max(L) = {}); known: {}", text_of(experiment_.dt), text_of(allowed),
                    text_of(largest_), known.text),
        fits ? "how far the gains rise on the way depends on the initial differences: compare gain_peak with this after the run"
             : "held over a round, the loop rings up: take a smaller dt");
  }

  // Algorithm 4.2 against the experiment's graphs.
  void resolution() {
    const Reference::Rule rule = Reference::rule(choice_.name, choice_.parameters, experiment_.dt);
    const bool symmetric = std::all_of(graphs_.begin(), graphs_.end(), [](const auto& graph) { return undirected(*graph); });
    const std::string source = "(Knotek, thesis, Algorithm 4.2)";
    add(symmetric ? Rating::holds : Rating::fails, "undirected, for the estimation of eigenvalues",
        symmetric ? "every graph" : "not every graph",
        (symmetric ? "the artificial states neither grow nor decay " : "the artificial states grow or decay and show no frequency ") +
            source);
    const double window = rule.dt * rule.sample_rounds * static_cast<double>(rule.samples), pi = std::numbers::pi;
    const auto limit = [&](bool holds, const std::string& condition, double value, const char* relation, double bound,
                           const char* otherwise) {
      add(holds ? Rating::holds : Rating::fails, condition, fmt::format("{} {} {}", text_of(value), relation, text_of(bound)),
          (holds ? "the smallest eigenvalue can be told apart " : otherwise) + source);
    };
    const double low = rule.xi * smallest_ * window, high = rule.xi * largest_, sampling = 1.0 / (rule.dt * rule.sample_rounds);
    limit(low >= 4.0 * pi, "xi lambda_2 window >= 4 pi", low, low >= 4.0 * pi ? ">=" : "<", 4.0 * pi,
          "the window is too short for the smallest eigenvalue: a larger one is taken for it, and kappa comes out too small ");
    limit(high < pi * sampling, "xi lambda_max < pi f_s", high, high < pi * sampling ? "<" : ">=", pi * sampling,
          "the sampling folds large eigenvalues onto small ones ");
    limit(rule.dt * high < 1.0, "dt xi lambda_max < 1", rule.dt * high, rule.dt * high < 1.0 ? "<" : ">=", 1.0,
          "the artificial states grow without bound ");
  }

  const TheoryCase& of_;
  const Experiment& experiment_;
  const ProtocolChoice& choice_;
  const Demand& demand_;
  Findings& out_;
  const std::vector<std::shared_ptr<const Graph>>& graphs_;                    // of the agents that are there, one per segment
  double largest_ = 0.0, smallest_ = std::numeric_limits<double>::infinity();  // eigenvalues of L over all graphs
};

}  // namespace

void examine_adaptive_consensus(const TheoryCase& of, Findings& out) {
  const Demand demand{
      .asks = AskedGraph::strong_or_led, .theorem = "Knotek, thesis, Theorems 12 to 15", .linear = true, .reference = "kappa"};
  AdaptiveExamination(of, demand, out).examine();
}

void examine_su_consensus(const TheoryCase& of, Findings& out) {
  const Demand demand{
      .asks = AskedGraph::undirected_followers_led, .theorem = "Su, Chen, Wang, Lin 2011, Theorem 1", .noiseless = true, .further = "m"};
  AdaptiveExamination(of, demand, out).examine();
}

void examine_yu_consensus(const TheoryCase& of, Findings& out) {
  const Demand demand{.asks = AskedGraph::undirected_followers,
                      .theorem = "Yu, Ren, Zheng, Chen, Lu 2013, Theorems 1 and 2",
                      .noiseless = true,
                      .velocity = "beta"};
  AdaptiveExamination(of, demand, out).examine();
}

void examine_li_edge_consensus(const TheoryCase& of, Findings& out) {
  const Demand demand{.asks = AskedGraph::undirected, .theorem = "Li, Ren, Liu, Fu 2013, Theorem 1", .linear = true, .noiseless = true};
  AdaptiveExamination(of, demand, out).examine();
}

void examine_li_agent_consensus(const TheoryCase& of, Findings& out) {
  const Demand demand{.asks = AskedGraph::led, .theorem = "Li, Wen, Duan, Ren 2015", .linear = true, .cubed = true};
  AdaptiveExamination(of, demand, out).examine();
}

void examine_das_neural_consensus(const TheoryCase& of, Findings& out) {
  const Demand demand{.asks = AskedGraph::strong_or_led, .theorem = "Das, Lewis 2010, Theorem 1", .constant = "c"};
  AdaptiveExamination(of, demand, out).examine();
}

}  // namespace consort
