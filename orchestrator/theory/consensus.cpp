#include "orchestrator/theory/consensus.hpp"

#include "core/counted.hpp"
#include "core/math/decompositions.hpp"
#include "core/math/shapes.hpp"
#include "core/metrics/metrics.hpp"
#include "models/physics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace consort {
namespace {

std::string vector_text(const Vector& value) {
  if (value.size() == 1) return text_of(value[0]);
  std::string out;
  for (const double component : value) out += (out.empty() ? "" : ", ") + text_of(component);
  return "(" + out + ")";
}

bool zero(const Values& values, std::string_view name) {
  const Matrix* value = values.find(name);
  return value == nullptr || value->isZero(0.0);
}

bool gains_without_noise(const TheoryCase& of) {
  const auto clean = [](const Values& values) { return zero(values, "Q") && zero(values, "Omega"); };
  return clean(of.choice.parameters) && std::all_of(of.experiment.overrides.begin(), of.experiment.overrides.end(),
                                                    [&](const auto& entry) { return clean(entry.second.parameters); });
}

Vector weighted_in_degrees(const Graph& graph) {
  Vector in = Vector::Zero(static_cast<Eigen::Index>(graph.agents()));
  for (std::size_t i = 0; i < graph.agents(); ++i)
    for (const Neighbour& j : graph.in_neighbours(agent_at(i))) in[static_cast<Eigen::Index>(i)] += j.weight;
  return in;
}

/// Are the sums of the weights equal with which the others hear each agent?
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

// --- local voting (Knotek, thesis, (2.8)-(2.14)) --------------------------------------------------------------------------

/// What the agents start from, one column each: the plant's states, or what they keep.
Matrix starting_values(const Experiment& experiment, const Survey::Members& members) {
  std::optional<Physics> physics;
  if (experiment.plant) physics.emplace(plant_task(experiment, experiment.seed));
  Matrix out;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const auto state = physics ? physics->state(members[i]) : std::span<const double>();
    const Vector x = physics ? Vector(Eigen::Map<const Vector>(state.data(), static_cast<Eigen::Index>(state.size())))
                             : experiment.initial_of(members[i], experiment.seed).vector("x");
    if (i == 0) out.resize(x.size(), static_cast<Eigen::Index>(members.size()));
    out.col(static_cast<Eigen::Index>(i)) = x;
  }
  return out;
}

/// A lower bound of the largest eigenvalue of L, L symmetric, without a decomposition: Rayleigh's quotient after some steps of the power
/// iteration, from a vector that no graph is likely to be orthogonal to.
double largest_eigenvalue_at_least(const Graph& graph, const Vector& degrees) {
  constexpr int kSteps = 60;
  Vector x(degrees.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = std::sin(1.0 + 2.3 * static_cast<double>(i * i % 1009) + static_cast<double>(i));
  double quotient = 0.0;
  for (int step = 0; step < kSteps; ++step) {
    x.normalize();
    Vector Lx = degrees.cwiseProduct(x);
    for (std::size_t i = 0; i < graph.agents(); ++i)
      for (const Neighbour& j : graph.in_neighbours(agent_at(i)))
        Lx[static_cast<Eigen::Index>(i)] -= j.weight * x[static_cast<Eigen::Index>(index_of(j.id))];
    quotient = x.dot(Lx);
    if (Lx.isZero(0.0)) break;
    x = Lx;
  }
  return quotient;
}

constexpr std::string_view kEigenvalues = "all eigenvalues of I - dt L other than one 1 lie inside the unit circle";
constexpr const char* kUnsettled = "the states do not settle: take a smaller dt, or a graph with a spanning tree";

/// One graph throughout, and its eigenvalues known.
void judge_voting(const TheoryCase& of, Findings& out, const Spectra::Spectrum& spectrum) {
  const double dt = of.experiment.dt;
  double largest = 0.0, step = std::numeric_limits<double>::infinity();
  for (const auto& lambda : spectrum) {
    largest = std::max(largest, std::abs(1.0 - dt * lambda));
    // |1 - dt lambda| < 1 exactly if dt < 2 Re(lambda) / |lambda|^2
    step = std::min(step, 2.0 * lambda.real() / std::norm(lambda));
  }
  const bool holds = spectrum.empty() || largest < 1.0 - 1e-12;
  std::string value;
  if (const Graph& graph = *of.survey.graphs.front(); holds && has_spanning_tree(graph)) {
    const Vector agreed = starting_values(of.experiment, *of.survey.members.front()) * left_null_vector(graph);
    value = fmt::format("the states converge to w^T x(0) = {}{}, w the left null vector of L (Knotek, thesis, (2.13))", vector_text(agreed),
                        limits_of_prediction(of));
  }
  out.judge(holds, kEigenvalues,
            spectrum.empty() ? "one agent"
                             : fmt::format("largest modulus {}; dt = {}, allowed below {}", text_of(largest), text_of(dt), text_of(step)),
            value, kUnsettled);
}

/// One graph throughout, too large for its eigenvalues: what bounds of them say.
void judge_large_voting(const TheoryCase& of, Findings& out) {
  const Graph& graph = *of.survey.graphs.front();
  const Vector degrees = weighted_in_degrees(graph);
  const double dt = of.experiment.dt, highest = 2.0 * degrees.maxCoeff();
  if (dt * highest < 2.0 && has_spanning_tree(graph)) {
    out.add(Rating::holds, kEigenvalues,
            fmt::format("by Gershgorin's circles: dt times the largest in-degree is {}, below 1", text_of(0.5 * dt * highest)),
            "the states converge");
    return;
  }
  // The mean of the eigenvalues other than zero, and where L is symmetric Rayleigh's quotient, are below the largest real part.
  double lowest = degrees.sum() / static_cast<double>(graph.agents() - 1);
  if (undirected(graph) && of.effort.affords(120.0 * static_cast<double>(graph.agents() + graph.edge_count())))
    lowest = std::max(lowest, largest_eigenvalue_at_least(graph, degrees));
  if (dt * lowest >= 2.0)
    out.add(Rating::fails, kEigenvalues,
            fmt::format("an eigenvalue of L has a real part of at least {}; dt = {}, allowed below {}", text_of(lowest), text_of(dt),
                        text_of(2.0 / lowest)),
            kUnsettled);
  else if (!has_spanning_tree(graph))
    out.add(Rating::fails, kEigenvalues, "a second eigenvalue of L is zero: no spanning tree", kUnsettled);
  else
    out.leave_out(kEigenvalues, fmt::format("L is of order {}; surely stable with dt below {}, surely not from {} on", graph.agents(),
                                            text_of(2.0 / highest), text_of(2.0 / lowest)));
}

// --- Kalman consensus (Ren, Beard, Kingston 2005; Alighanbari, How 2006) --------------------------------------------------

/// The limit of (4)-(5) with Q = Omega = 0 on a constant strongly connected graph: information Y_i+ = sum (I + g)_ij Y_j and the same for
/// Y_i x_i, so both line up with the left Perron vector w of I + g: limit (sum w_i Y_i)^-1 sum w_i Y_i x_i.
Vector kalman_limit(const Experiment& experiment, const Graph& graph) {
  const auto n = static_cast<Eigen::Index>(experiment.agents);
  const auto [values, vectors] = eigen((Matrix::Identity(n, n) + adjacency(graph)).transpose(), "I + g");
  Eigen::Index largest = 0;
  values.real().maxCoeff(&largest);
  const Vector w = vectors.col(largest).real().cwiseAbs();
  Matrix information;
  Vector weighted;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Values initial = experiment.initial_of(agent_at(static_cast<std::size_t>(i)), experiment.seed);
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

/// ": limit 4.9, centralised 5", where that can be said.
std::string kalman_value(const TheoryCase& of) {
  const Experiment& experiment = of.experiment;
  const bool everybody = of.survey.graphs.front()->agents() == experiment.agents;
  const bool steady = everybody && of.survey.constant() && strongly_connected(*of.survey.graphs.front());
  if (!steady || !of.effort.affords(2.0 * spectrum_cost(static_cast<double>(experiment.agents)))) return "";
  return fmt::format(": limit {}, centralised {}{}", vector_text(kalman_limit(experiment, *of.survey.graphs.front())),
                     vector_text(centralised_estimate(experiment, experiment.seed)), limits_of_prediction(of));
}

/// Largest eigenvalue of P_i sum_j g_ij (P_j + Omega)^-1 at the start, over agents and graphs.
double largest_gain(const TheoryCase& of, const std::vector<const Graph*>& graphs) {
  std::vector<Matrix> P;
  for (std::size_t i = 0; i < of.experiment.agents; ++i) {
    const Values initial = of.experiment.initial_of(agent_at(i), of.experiment.seed);
    P.push_back(initial.covariance("P", initial.vector("x").size(), 1.0, true));
  }
  double largest = 0.0;
  for (std::size_t i = 0; i < of.experiment.agents; ++i) {
    const Matrix Omega = of.experiment.parameters_of(of.choice, agent_at(i)).covariance("Omega", P[i].rows(), 0.0);
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

void examine_local_voting(const TheoryCase& of, Findings& out) {
  ask_spanning_windows(of, out, "everybody hears, however indirectly, of somebody");
  if (of.survey.constant()) {
    const auto spectrum = of.spectra.without_zero(of.survey);
    if (spectrum)
      judge_voting(of, out, *spectrum);
    else
      judge_large_voting(of, out);
    return;
  }
  const double dt = of.experiment.dt;
  const auto failure =
      of.survey.failure([dt](const Graph& graph) { return graph.agents() == 0 || dt * weighted_in_degrees(graph).maxCoeff() < 1.0; });
  out.judge(!failure, "dt times the largest in-degree is below 1 in every round", evidence_of(of.survey, failure),
            "I - dt L is stochastic with a positive diagonal, so spanning unions give consensus (Ren, Beard, Kingston 2005, Lemmas 3.5 and "
            "3.7)",
            "I - dt L has a weight that is not positive on the diagonal: the products of stochastic matrices say nothing, take a smaller "
            "dt");
}

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
    const auto own = of.experiment.parameters_of(of.choice, agent_at(i));
    const bool its = own.scalar("method", 0.0) == 1.0;
    euler = euler || its;
    // x_i decays at the gain towards what it hears, P_i at twice the gain towards its limit.
    bound = std::min(bound, own.scalar("steps", 1.0) * (its ? 1.0 : 0.5 * kRungeKutta) / gain);
  }
  out.judge(of.experiment.dt < bound, condition,
            fmt::format("largest gain at the start {}{}; dt = {}, allowed below {}{}", text_of(gain),
                        graphs.size() == 1 ? "" : " (the worst of the run's graphs)", text_of(of.experiment.dt), text_of(bound),
                        euler ? " (Euler)" : ""),
            fmt::format("a round is integrated stably; holding what is heard over it costs an error of about {} of a difference",
                        text_of(0.5 * gain * of.experiment.dt)),
            "the integration overshoots: take a shorter dt or more steps");
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
            "it converges to the centralised estimate " + vector_text(centralised_estimate(of.experiment, of.experiment.seed)) +
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
            "it converges to the centralised estimate " + vector_text(centralised_estimate(of.experiment, of.experiment.seed)) +
                " at every loss below 1 (Hadjicostis, Vaidya, Dominguez-Garcia 2016, Theorem 1)",
            "what is lost while an edge is new, or just before it goes, is gone; the centralised estimate is not promised");
  const bool cut = any_link(of, [](const LinkSpec& link) { return link.mean_loss() >= 1.0; });
  out.judge(!cut, "every loss is below 1", cut ? "some link loses every message" : "as far as it does not depend on distances",
            "what is lost comes with a later message", "nothing ever arrives over such a link: cut it instead");
}

}  // namespace consort
