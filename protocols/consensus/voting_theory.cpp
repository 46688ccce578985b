// Local voting: Knotek, thesis, (2.8)-(2.14).

#include "core/math/decompositions.hpp"
#include "core/math/shapes.hpp"
#include "models/physics.hpp"
#include "protocols/consensus/theory.hpp"
#include "protocols/theory_case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace consort {
namespace {

Vector weighted_in_degrees(const Graph& graph) {
  Vector in = Vector::Zero(static_cast<Eigen::Index>(graph.agents()));
  for (std::size_t i = 0; i < graph.agents(); ++i)
    for (const Neighbour& j : graph.in_neighbours(agent_at(i))) in[static_cast<Eigen::Index>(i)] += j.weight;
  return in;
}

// What the agents start from, one column each: the plant's states, or what they keep.
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

// A lower bound of the largest eigenvalue of L, L symmetric, without a decomposition: Rayleigh's quotient after some steps of the power
// iteration, from a vector that no graph is likely to be orthogonal to.
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
constexpr double kRounding = 1e-12;
constexpr const char* kTorn = "take a graph with a spanning tree";
std::string unsettled(const std::string& remedy) { return "the states do not settle: " + remedy; }

// One graph throughout, and its eigenvalues known.
void judge_voting(const TheoryCase& of, Findings& out, const Spectra::Spectrum& spectrum) {
  const double dt = of.experiment.dt;
  double largest = 0.0, step = std::numeric_limits<double>::infinity();
  for (const auto& lambda : spectrum) {
    largest = std::max(largest, std::abs(1.0 - dt * lambda));
    // |1 - dt lambda| < 1 exactly if dt < 2 Re(lambda) / |lambda|^2
    step = std::min(step, 2.0 * lambda.real() / std::norm(lambda));
  }
  const bool holds = spectrum.empty() || largest < 1.0 - kRounding;
  const Graph& graph = *of.survey.graphs.front();
  const bool connected = has_spanning_tree(graph);
  std::string value;
  if (holds && connected) {
    const Vector agreed = starting_values(of.experiment, *of.survey.members.front()) * left_null_vector(graph);
    value = fmt::format("the states converge to w^T x(0) = {}{}, w the left null vector of L (Knotek, thesis, (2.13))", text_of(agreed),
                        limits_of_prediction(of));
  }
  out.judge(holds, kEigenvalues,
            spectrum.empty() ? "one agent"
                             : fmt::format("largest modulus {}; dt = {}, allowed below {}", text_of(largest), text_of(dt), text_of(step)),
            value, unsettled(connected ? step_remedy(dt, step) : kTorn));
}

// One graph throughout, too large for its eigenvalues: what bounds of them say.
void judge_large_voting(const TheoryCase& of, Findings& out) {
  const Graph& graph = *of.survey.graphs.front();
  const Vector degrees = weighted_in_degrees(graph);
  const double dt = of.experiment.dt, highest = 2.0 * degrees.maxCoeff();
  if (dt * highest < 2.0 && has_spanning_tree(graph)) {
    out.judge(dt * highest > kRounding, kEigenvalues,
              fmt::format("by Gershgorin's circles: dt times the largest in-degree is {}, below 1", text_of(0.5 * dt * highest)),
              "the states converge", unsettled(step_remedy(dt, 2.0 / highest)));
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
            unsettled(step_remedy(dt, 2.0 / lowest)));
  else if (!has_spanning_tree(graph))
    out.add(Rating::fails, kEigenvalues, "a second eigenvalue of L is zero: no spanning tree", unsettled(kTorn));
  else
    out.leave_out(kEigenvalues, fmt::format("L is of order {}; surely stable with dt below {}, surely not from {} on", graph.agents(),
                                            text_of(2.0 / highest), text_of(2.0 / lowest)));
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

}  // namespace consort
