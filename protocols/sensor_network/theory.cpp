#include "protocols/sensor_network/theory.hpp"

#include "core/counted.hpp"
#include "core/math/schur.hpp"
#include "core/math/shapes.hpp"
#include "models/physics.hpp"
#include "models/registry.hpp"
#include "protocols/sensor_network/merged_findings.hpp"
#include "protocols/sensor_network/metrics.hpp"
#include "protocols/theory_case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace consort {
namespace {

constexpr std::size_t kMostRows = 12;    // agents whose variances are printed
constexpr std::size_t kMostGraphs = 20;  // different graphs of one run that are examined

std::string listed(const std::vector<AgentId>& agents) {
  std::string out = noun(agents.size(), "agent");
  for (const AgentId agent : agents) out += (agent == agents.front() ? " " : ", ") + std::to_string(agent.value);
  return out;
}

// The plant's name of each state group: that of the field with exactly its components, else their numbers.
std::vector<std::string> names_of(const StateGroups& groups, const Layout& layout) {
  std::vector<std::string> out;
  for (const auto& group : groups) {
    std::string name = noun(group.size(), "component");
    for (const Eigen::Index c : group) name += (c == group.front() ? " " : ", ") + std::to_string(c + 1);
    std::size_t at = 0;
    for (const Field& field : layout.fields) {
      const bool whole = group.size() == field.size() && static_cast<std::size_t>(group.front()) == at &&
                         static_cast<std::size_t>(group.back()) == at + field.size() - 1;
      if (whole) name = field.name;
      at += field.size();
    }
    out.push_back(name);
  }
  return out;
}

// Numbers in the errors of all agents.
double order_of(const ExaminedNetwork& examined) {
  return static_cast<double>(examined.network.A.rows()) * static_cast<double>(examined.agents.size());
}

// One graph of the run under examination.
class NetworkExamination {
 public:
  NetworkExamination(const TheoryCase& of, const ExaminedNetwork& examined, std::vector<std::string> names)
      : experiment_(of.experiment), effort_(of.effort), examined_(examined), names_(std::move(names)), findings_(of.choice.name, out_) {}

  std::vector<Finding> findings() {
    seen();
    const auto groups = leader_groups(examined_.network.graph);
    leaders(groups);
    if (groups.size() == 1) bounds(groups.front());
    const bool converges = stability();
    step();
    if (converges) covariances();
    return std::move(out_);
  }

 private:
  void add(Rating verdict, const std::string& condition, std::string evidence, std::string consequence) {
    findings_.add(verdict, condition, std::move(evidence), std::move(consequence));
  }
  [[nodiscard]] AgentId original(AgentId place) const { return examined_.agents[index_of(place)]; }
  [[nodiscard]] std::vector<AgentId> original(const std::vector<AgentId>& places) const {
    std::vector<AgentId> out;
    for (const AgentId place : places) out.push_back(original(place));
    return out;
  }
  // Those of `places` that see group j.
  [[nodiscard]] std::vector<AgentId> seeing(std::size_t j) const {
    std::vector<AgentId> out;
    for (std::size_t i = 0; i < examined_.agents.size(); ++i)
      if (examined_.observers[i].observes[j] != 0) out.push_back(agent_at(i));
    return out;
  }

  void seen() {
    std::string all, unseen;
    for (std::size_t j = 0; j < names_.size(); ++j) {
      const auto who = original(seeing(j));
      if (who.empty())
        unseen += (unseen.empty() ? "" : "; ") + names_[j];
      else
        all += (all.empty() ? "" : "; ") + names_[j] + ": " + listed(who);
    }
    add(unseen.empty() ? Rating::holds : Rating::refused, "some agent sees every state group (3.21)",
        unseen.empty() ? all : "nobody sees " + unseen,
        unseen.empty() ? "the sensors together observe the plant"
                       : "no agent can correct its estimate of it: give somebody a sensor that sees it");
  }

  void leaders(const std::vector<std::vector<AgentId>>& groups) {
    const std::string condition = "the graph has a spanning tree, and all sensing agents are its leaders (Assumption 10)";
    if (groups.size() != 1) {
      add(Rating::refused, condition,
          fmt::format("two groups hear nobody outside: {}; {}", listed(original(groups[0])), listed(original(groups[1]))),
          "what one group sees never reaches the other: add an edge between them");
      return;
    }
    const auto& leading = groups.front();
    std::vector<AgentId> outside;
    std::string missing;
    for (std::size_t i = 0; i < examined_.agents.size(); ++i)
      if (!examined_.observers[i].observable.empty() && std::find(leading.begin(), leading.end(), agent_at(i)) == leading.end())
        outside.push_back(examined_.agents[i]);
    for (std::size_t j = 0; j < names_.size(); ++j) {
      const auto who = seeing(j);
      const bool led =
          std::any_of(who.begin(), who.end(), [&](AgentId i) { return std::find(leading.begin(), leading.end(), i) != leading.end(); });
      if (!who.empty() && !led) missing += (missing.empty() ? "" : ", ") + names_[j];
    }
    if (outside.empty()) {
      add(Rating::holds, condition, "the leaders are " + listed(original(leading)),
          "Theorem 6: every estimate converges for gamma large enough");
    } else if (missing.empty()) {
      add(Rating::fails, condition, fmt::format("{}: not heard by the leaders, {}", listed(outside), listed(original(leading))),
          "their sensors help only themselves and their listeners; the leaders see every state group without them, so what they send is "
          "right");
    } else {
      add(Rating::refused, condition,
          fmt::format("{}: not heard by the leaders, {}, who do not see {}", listed(outside), listed(original(leading)), missing),
          "the leaders' estimates of it stay wrong: add a path from those who see it to the leaders");
    }
  }

  void bounds(const std::vector<AgentId>& leading) {
    const GammaBounds bound = gamma_bounds(examined_.network.A, examined_.network.graph, leading);
    const double largest = std::max(bound.leaders, bound.followers);
    const bool enough = examined_.agreed.gamma > largest;
    add(enough ? Rating::holds : Rating::fails, "gamma is above the bounds (3.83) and (3.84)",
        fmt::format("gamma = {}; leaders {}, followers {}", text_of(examined_.agreed.gamma), text_of(bound.leaders),
                    text_of(bound.followers)),
        largest == 0.0
            ? "lambda_max(A + A') is not positive: any gamma is large enough"
            : (enough ? "large enough for Theorem 6, alpha permitting" : "convergence is not promised; the bounds are sufficient only"));
    Vector inverse = Vector::Zero(static_cast<Eigen::Index>(names_.size()));
    for (const LocalObserver& observer : examined_.observers)
      inverse = inverse.cwiseMax(inverse_alpha_bounds(observer, examined_.network.A, examined_.groups, leading.size(), bound.balance));
    double smallest = std::numeric_limits<double>::infinity();  // of alpha_j^max / alpha_j
    for (const Vector& alpha : examined_.alpha) smallest = std::min(smallest, 1.0 / alpha.cwiseProduct(inverse).maxCoeff());
    const Vector& used = examined_.alpha.back();
    std::string text;
    for (std::size_t j = 0; j < names_.size(); ++j) text += (j == 0 ? "" : ", ") + text_of(used[static_cast<Eigen::Index>(j)]);
    add(smallest >= 1.0 - 1e-9 ? Rating::holds : Rating::fails, "alpha is within the bound (3.85)",
        fmt::format("alpha = {}{}; w_min / w_max = {}", text, examined_.agreed.alpha.size() > 0 ? "" : " by Algorithm 3.2",
                    text_of(bound.balance)),
        std::isinf(smallest)
            ? "no state group grows: any alpha will do"
            : fmt::format("the smallest bound is {} times the alpha used{}", text_of(smallest),
                          smallest >= 1.0 - 1e-9 ? "" : "; convergence is not promised: set `balance`, or a smaller alpha"));
  }

  bool stability() {
    const double abscissa = spectral_abscissa(error_matrix(examined_.network));
    const bool holds = abscissa < 0.0;
    add(holds ? Rating::holds : Rating::fails, "the error matrix of the whole network is stable",
        fmt::format("largest real part {} 1/s", text_of(abscissa)),
        holds ? fmt::format("the estimates converge, in the end with a time constant of {} s", text_of(-1.0 / abscissa))
              : "the estimates do not converge");
    return holds;
  }

  void step() {
    const auto radius = [this](Seconds h) { return spectral_radius(sampled_error_matrix(examined_.network, h)); };
    const double now = radius(experiment_.dt);
    std::string evidence = fmt::format("dt = {}: spectral radius {}", text_of(experiment_.dt), fmt::format("{:.9g}", now));
    std::optional<Seconds> bound;
    if (effort_.affords(kStepQuestions * spectrum_cost(order_of(examined_)))) {
      double fastest = examined_.network.A.norm();
      for (std::size_t i = 0; i < examined_.agents.size(); ++i)
        fastest = std::max(fastest, (examined_.network.G[i] * examined_.network.C[i]).norm());
      bound = largest_stable_step(radius, 0.01 / fastest);
      evidence += std::isinf(*bound) ? "; no step up to any length matters" : fmt::format("; stable below {} s", text_of(*bound));
    }
    add(now < 1.0 ? Rating::holds : Rating::fails, "dt is short enough for the sampled observers", evidence,
        now < 1.0 ? "the consensus part bears any step; the measurements ask for dt rho(G_i C_i) below about 1"
                  : "the sampled errors do not decay: " + step_remedy(experiment_.dt, bound));
  }

  // Largest variance of each group: "mode1 1.38e-4, ...".
  [[nodiscard]] std::string by_group(const Vector& variances, const std::vector<char>* observes = nullptr) const {
    std::string out;
    for (std::size_t j = 0; j < names_.size(); ++j) {
      if (observes != nullptr && (*observes)[j] == 0) continue;
      out += fmt::format("{}{} {:.4g}", out.empty() ? "" : ", ", names_[j], variances(examined_.groups[j]).maxCoeff());
    }
    return out;
  }

  void covariances() {
    const Eigen::Index n = examined_.network.A.rows();
    const Vector P = error_covariance(examined_.network).diagonal();
    double local = 0.0, observed = 0.0;
    for (std::size_t i = 0; i < examined_.agents.size(); ++i) {
      local += examined_.observers[i].M_inverse.trace();
      for (const Eigen::Index c : examined_.observers[i].observable) observed += P[static_cast<Eigen::Index>(i) * n + c];
    }
    const bool sampled = spectral_radius(sampled_error_matrix(examined_.network, experiment_.dt)) < 1.0;
    add(Rating::note, "stationary covariance of the errors (3.73), if noises are as Q and R say",
        fmt::format(
            "trace P = {:.5g}{}; of what each agent sees itself {:.5g}, by its own filter alone (3.29) {:.5g}", P.sum(),
            sampled ? fmt::format(", with steps of dt {:.5g}", sampled_error_covariance(examined_.network, experiment_.dt).trace()) : "",
            observed, local),
        "largest variances by state group: one filter with all sensors " + by_group(centralised_covariance(examined_).diagonal()));
    if (examined_.agents.size() > kMostRows) return;
    for (std::size_t i = 0; i < examined_.agents.size(); ++i) {
      const auto& [observes, observable, M_inverse, G, decay] = examined_.observers[i];
      Vector alone = Vector::Zero(n);
      for (std::size_t c = 0; c < observable.size(); ++c)
        alone[observable[c]] = M_inverse(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(c));
      add(Rating::note, "variances of agent " + std::to_string(examined_.agents[i].value),
          by_group(P.segment(static_cast<Eigen::Index>(i) * n, n)),
          observable.empty() ? "no sensor" : "by its own filter alone " + by_group(alone, &observes));
    }
  }

  const Experiment& experiment_;
  Effort& effort_;
  const ExaminedNetwork& examined_;
  std::vector<std::string> names_;
  std::vector<Finding> out_;
  Findings findings_;
};

}  // namespace

void examine_sensor_network(const TheoryCase& of, Findings& out) {
  const Physics physics(plant_task(of.experiment, of.experiment.seed));
  if (!physics.shared()) {
    out.add(Rating::refused, "one linear plant that all agents share",
            "found the model " + of.experiment.plant->model + ", of which each agent has a part",
            "agents would draw estimates of different things together: take a shared plant, " + shared_plants());
    return;
  }
  const std::string everything = "observability, leaders, stability";
  const auto graphs = of.survey.distinct();
  // Three decompositions of the whole error per graph, and two Riccati equations per agent.
  const auto n = static_cast<double>(physics.knowledge(agent_at(0)).find("A")->rows()), N = static_cast<double>(of.experiment.agents);
  if (graphs.size() > kMostGraphs ||
      !of.effort.affords(static_cast<double>(graphs.size()) * (3.0 * spectrum_cost(n * N) + 40.0 * N * spectrum_cost(n)))) {
    out.leave_out(everything, fmt::format("{}, {} numbers in the errors of all agents", counted(graphs.size(), "graph"), n * N));
    return;
  }
  MergedFindings merged;
  for (const std::size_t s : graphs) {
    if (of.survey.members[s]->empty()) continue;
    const Schedule::Segment& segment = of.survey.segments[s];
    const auto examined = examined_network(of.experiment, of.choice, *segment.graph, segment.first);
    if (!examined) {
      out.leave_out(everything, fmt::format("{} numbers in the errors of all agents", n * N));
      return;
    }
    merged.add(NetworkExamination(of, *examined, names_of(examined->groups, physics.state_layout())).findings(), segment.first);
  }
  for (Finding& finding : merged.take()) out.add(std::move(finding));
}

}  // namespace consort
