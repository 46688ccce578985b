#include "protocols/consensus/theory.hpp"

#include "core/counted.hpp"
#include "core/math/decompositions.hpp"
#include "core/math/shapes.hpp"
#include "core/metrics/metrics.hpp"
#include "protocols/theory_case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace consort {
namespace {

bool zero(const Values& values, std::string_view name) {
  const Matrix* value = values.find(name);
  return value == nullptr || value->isZero(0.0);
}

bool gains_without_noise(const TheoryCase& of) {
  const auto clean = [](const Values& values) { return zero(values, "Q") && zero(values, "Omega"); };
  return clean(of.choice.parameters) && std::all_of(of.experiment.overrides.begin(), of.experiment.overrides.end(),
                                                    [&](const auto& entry) { return clean(entry.second.parameters); });
}

// Are the sums of the weights equal with which the others hear each agent?
bool equal_listeners(const Graph& graph) {
  Vector out = Vector::Zero(static_cast<Eigen::Index>(graph.agents()));
  for (std::size_t i = 0; i < graph.agents(); ++i)
    for (const Neighbour& j : graph.in_neighbours(agent_at(i))) out[static_cast<Eigen::Index>(index_of(j.id))] += j.weight;
  return out.size() == 0 || out.maxCoeff() - out.minCoeff() <= 1e-12 * std::max(1.0, out.maxCoeff());
}

bool unit_weights(const Graph& graph) {
  for (std::size_t i = 0; i < graph.agents(); ++i)
    for (const Neighbour& j : graph.in_neighbours(agent_at(i)))
      if (j.weight != 1.0) return false;
  return true;
}

// --- Kalman consensus (Ren, Beard, Kingston 2005; Alighanbari, How 2006) --------------------------------------------------

// The limit of (4)-(5) with Q = Omega = 0 on a constant strongly connected graph: information Y_i+ = sum (I + g)_ij Y_j and the same for
// Y_i x_i, so both line up with the left Perron vector w of I + g: limit (sum w_i Y_i)^-1 sum w_i Y_i x_i.
Vector kalman_limit(const TheoryCase& of, const Graph& graph) {
  const auto n = static_cast<Eigen::Index>(of.experiment.agents);
  const auto [values, vectors] = eigen((Matrix::Identity(n, n) + adjacency(graph)).transpose(), "I + g");
  Eigen::Index largest = 0;
  values.real().maxCoeff(&largest);
  const Vector w = vectors.col(largest).real().cwiseAbs();
  Matrix information;
  Vector weighted;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Values initial = of.initial(agent_at(static_cast<std::size_t>(i)));
    const Vector x = initial.vector("x");
    const Matrix Y = initial.covariance("P", x.size(), {}, true).llt().solve(Matrix::Identity(x.size(), x.size()));
    if (i == 0) {
      information = Matrix::Zero(x.size(), x.size());
      weighted = Vector::Zero(x.size());
    }
    information += w[i] * Y;
    weighted += w[i] * (Y * x);
  }
  return information.llt().solve(weighted);
}

// ": limit 4.9, centralised 5", where that can be said.
std::string kalman_value(const TheoryCase& of) {
  const Experiment& experiment = of.experiment;
  const bool everybody = of.survey.graphs.front()->agents() == experiment.agents;
  const bool steady = everybody && of.survey.constant() && strongly_connected(*of.survey.graphs.front());
  if (!steady || !of.effort.affords(2.0 * spectrum_cost(static_cast<double>(experiment.agents)))) return "";
  return fmt::format(": limit {}, centralised {}{}", text_of(kalman_limit(of, *of.survey.graphs.front())),
                     text_of(centralised_estimate(experiment, experiment.seed)), limits_of_prediction(of));
}

// Largest eigenvalue of P_i sum_j g_ij (P_j + Omega)^-1 at the start, over agents and graphs.
double largest_gain(const TheoryCase& of, const std::vector<const Graph*>& graphs) {
  std::vector<Matrix> P;
  for (std::size_t i = 0; i < of.experiment.agents; ++i) {
    const Values initial = of.initial(agent_at(i));
    P.push_back(initial.covariance("P", initial.vector("x").size(), {}, true));
  }
  double largest = 0.0;
  for (std::size_t i = 0; i < of.experiment.agents; ++i) {
    const Matrix Omega = of.parameters(agent_at(i)).covariance("Omega", P[i].rows());
    const Matrix root = P[i].llt().matrixL();
    for (const Graph* graph : graphs) {
      Matrix certainty = Matrix::Zero(P[i].rows(), P[i].rows());
      for (const Neighbour& j : graph->in_neighbours(agent_at(i)))
        certainty += j.weight * inverse(P[index_of(j.id)] + Omega, "P_j + Omega");
      const Matrix gains = root.transpose() * certainty * root;
      largest = std::max(largest, symmetric_eigenvalues(gains).maxCoeff());
    }
  }
  return largest;
}

}  // namespace

void examine_kalman_consensus(const TheoryCase& of, Findings& out) {
  ask_spanning_windows(of, out,
                       "it reaches agreement (Ren, Beard, Kingston 2005, Theorem 3.9: discrete-time scheme, no communication noise)");
  const auto unequal = of.survey.failure(equal_listeners);
  const std::string condition = "in every round all agents have the same number of listeners";
  if (!gains_without_noise(of)) {
    out.add(unequal ? Rating::fails : Rating::note, condition, evidence_of(of.survey, unequal),
            "with Q or Omega above 0 the limit is not the centralised estimate even then (Alighanbari, How 2006, (6) assumes both zero)");
    return;
  }
  const std::string value = kalman_value(of);
  out.judge(!unequal, condition, evidence_of(of.survey, unequal),
            "the consensus is the centralised estimate (Alighanbari, How 2006, (7))" + value,
            "the consensus is biased towards agents with many listeners (Alighanbari, How 2006, section IV)" + value);
}

void examine_continuous_kalman_consensus(const TheoryCase& of, Findings& out) {
  constexpr double kRungeKutta = 2.785;  // where RK4's interval of stability on the negative real axis ends
  ask_spanning_windows(of, out, "it reaches agreement (Ren, Beard, Kingston 2005, without communication noise)");
  // The graphs of all agents: those that are absent have no edges.
  std::set<const Graph*> seen;
  std::vector<const Graph*> graphs;
  double work = 0.0;
  for (const auto& segment : of.survey.segments) {
    if (!seen.insert(segment.graph.get()).second) continue;
    graphs.push_back(segment.graph.get());
    work += static_cast<double>(segment.graph->edge_count());
  }
  const auto n = static_cast<double>(of.experiment.initial_of(agent_at(0), of.experiment.seed).vector("x").size());
  const std::string condition = "the integration steps are short against 1 / the largest gain P_i sum_j g_ij (P_j + Omega)^-1";
  if (!of.effort.affords(1000.0 * work + work * 20.0 * n * n * n)) {
    out.leave_out(condition, fmt::format("{} {} in the run's graphs", work, noun(work, "edge")));
    return;
  }
  const double gain = largest_gain(of, graphs);
  Seconds bound = std::numeric_limits<double>::infinity();
  bool euler = false;
  for (std::size_t i = 0; i < of.experiment.agents; ++i) {
    const Values own = of.parameters(agent_at(i));
    const bool its = own.scalar("method") == 1.0;
    euler = euler || its;
    // x_i decays at the gain towards what it hears, P_i at twice the gain towards its limit.
    bound = std::min(bound, own.scalar("steps") * (its ? 1.0 : 0.5 * kRungeKutta) / gain);
  }
  out.judge(of.experiment.dt < bound, condition,
            fmt::format("largest gain at the start {}{}; dt = {}, allowed below {}{}", text_of(gain),
                        graphs.size() == 1 ? "" : " (the worst of the run's graphs)", text_of(of.experiment.dt), text_of(bound),
                        euler ? " (Euler)" : ""),
            fmt::format("a round is integrated stably; holding what is heard over it costs an error of about {} of a difference",
                        text_of(0.5 * gain * of.experiment.dt)),
            "the integration overshoots: " + step_remedy(of.experiment.dt, bound) + (bound > 0.0 ? ", or more steps" : ""));
}

void examine_unbiased_consensus(const TheoryCase& of, Findings& out) {
  const auto weak = of.survey.failure(strongly_connected);
  const bool clean = gains_without_noise(of), weighted = of.survey.failure(unit_weights).has_value();
  std::string evidence = "strongly connected: " + evidence_of(of.survey, weak) + (clean ? "; Q = Omega = 0" : "; Q or Omega is above 0");
  if (weighted) evidence += "; some edges have a weight other than 1";
  std::string otherwise = "the centralised estimate is not promised";
  if (!clean) otherwise += ": once P is small against Omega all gains are alike, and the number of listeners decides again";
  const std::string theorem = " (Alighanbari, How 2006, Theorem 7)";
  out.judge(!weak && clean && !weighted, "strongly connected in every round, gains without Q and Omega", evidence,
            "it converges to the centralised estimate " + text_of(centralised_estimate(of.experiment, of.experiment.seed)) +
                limits_of_prediction(of) + theorem,
            otherwise + theorem);
  ask_no_loss(of, out,
              "what a lost message carried is gone, so the value agreed on is biased: agents divide by listeners, not by deliveries");
}

void examine_robust_information_consensus(const TheoryCase& of, Findings& out) {
  const bool loses = any_link(of, [](const LinkSpec& link) { return link.loses(); });
  const auto weak = of.survey.failure(strongly_connected);
  const bool holds = !weak && (of.survey.constant() || !loses);
  std::string evidence = "strongly connected: " + evidence_of(of.survey, weak);
  if (!of.survey.constant()) evidence += loses ? "; edges come and go, and links lose messages" : "; edges come and go, nothing is lost";
  out.judge(holds, "strongly connected, without switching where links lose", evidence,
            "it converges to the centralised estimate " + text_of(centralised_estimate(of.experiment, of.experiment.seed)) +
                " at every loss below 1 (Hadjicostis, Vaidya, Dominguez-Garcia 2016, Theorem 1)",
            "what is lost while an edge is new, or just before it goes, is gone; the centralised estimate is not promised");
  const bool cut = any_link(of, [](const LinkSpec& link) { return link.mean_loss() >= 1.0; });
  out.judge(!cut, "every loss is below 1", cut ? "some link loses every message" : "as far as it does not depend on distances",
            "what is lost comes with a later message", "nothing ever arrives over such a link: cut it instead");
}

}  // namespace consort
