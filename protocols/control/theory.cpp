#include "protocols/control/theory.hpp"

#include "core/math/controllability.hpp"
#include "core/math/decompositions.hpp"
#include "core/math/discretise.hpp"
#include "core/math/riccati.hpp"
#include "core/math/shapes.hpp"
#include "models/physics.hpp"
#include "protocols/control/minimum_energy.hpp"
#include "protocols/theory_case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace consort {
namespace {

using Complex = std::complex<double>;

// Below this h every 1 + h s, s of `spectrum`, has modulus below one: |1 + h s| < 1 exactly if h < -2 Re(s) / |s|^2.
Seconds euler_bound(const std::vector<Complex>& spectrum) {
  double step = std::numeric_limits<double>::infinity();
  for (const Complex& s : spectrum) step = std::min(step, -2.0 * s.real() / std::norm(s));
  return step;
}

std::string where(const TheoryCase& of) { return of.survey.constant() ? "" : " (the worst of the run's graphs)"; }

constexpr const char* kTooLarge = "too many graphs or agents for eigenvalues";

void judge_step(const TheoryCase& of, Findings& out, const std::string& what, Seconds bound, const std::string& how) {
  const std::string allowed = bound > 0.0 ? "allowed below " + text_of(bound) : "no dt is allowed";
  out.judge(of.experiment.dt < bound * (1.0 - 1e-9), "dt is short enough for " + what,
            fmt::format("dt = {}, {}{}", text_of(of.experiment.dt), allowed, where(of)), "the sampled loop is stable, " + how,
            "the sampled loop is unstable: " + step_remedy(of.experiment.dt, bound) + ", " + how);
}

void ask_sensed_neighbours(const TheoryCase& of, Findings& out) {
  const bool holds = of.experiment.plant->sensing == PlantSpec::Sensing::neighbours;
  out.judge(holds, "agents measure their in-neighbours", holds ? "sensing: neighbours" : "sensing: own", "y_i holds y_ii and every y_ij",
            "the run ends in its first round: set plant.sensing to neighbours");
}

void ask_single_integrators(const TheoryCase& of, const Physics& physics, Findings& out) {
  std::string other;
  for (std::size_t i = 0; i < of.experiment.agents && other.empty(); ++i) {
    const Values model = physics.knowledge(agent_at(i));
    const Matrix *A = model.find("A"), *B = model.find("B");
    const bool integrates = A != nullptr && B != nullptr && A->isZero(0.0) && B->rows() == B->cols() && B->isIdentity(0.0);
    if (!integrates) other = fmt::format("not agent {}: A is not zero, or B not the identity", i + 1);
  }
  out.judge(other.empty(), "all agents are single integrators", other.empty() ? "x' = u at every agent" : other,
            "the law is made for such agents", "nothing is said about agents that do not move exactly as u tells them");
}

// --- static consensus (Knotek, thesis, 2.3.3) -----------------------------------------------------------------------------

bool ask_common_dynamics(const TheoryCase& of, const Physics& physics, Findings& out) {
  const Values model = physics.knowledge(agent_at(0));
  const Matrix& A = *model.find("A");
  const Matrix& B = *model.find("B");
  bool common = true;
  for (std::size_t i = 1; i < of.experiment.agents; ++i) {
    const Values other = physics.knowledge(agent_at(i));
    common = common && *other.find("A") == A && *other.find("B") == B;
  }
  out.judge(common, "all agents have the same A and B", common ? "the plant's parameters" : "they differ",
            "(2.26) splits into one loop per eigenvalue of L", "(2.27) says nothing about agents that differ");
  const auto reached = stabilisable(A, B);
  out.judge(static_cast<bool>(reached), "(A, B) is stabilisable",
            reached ? shape_of(A) + " and " + shape_of(B) : "B does not reach the eigenvalue " + text_of(*reached.offending),
            "the Riccati equation (2.22) has its solution", "(2.22) has none");
  return static_cast<bool>(reached);
}

void judge_coupling(const TheoryCase& of, Findings& out, const Matrix& A, const Matrix& B, const Matrix& K) {
  double smallest_c = std::numeric_limits<double>::infinity(), largest_c = 0.0;
  for (std::size_t i = 0; i < of.experiment.agents; ++i) {
    const double c = of.parameters(agent_at(i)).scalar("c");
    smallest_c = std::min(smallest_c, c);
    largest_c = std::max(largest_c, c);
  }
  const std::string condition = "c >= 1 / (2 min Re lambda), lambda the eigenvalues of L other than zero (2.27)";
  const auto spectrum = of.spectra.without_zero(of.survey);
  if (!spectrum) {
    out.leave_out(condition, kTooLarge);
    return;
  }
  if (of.survey.failure(has_spanning_tree)) {
    out.add(Rating::fails, condition, "a second eigenvalue is zero: no spanning tree" + where(of), "no c is enough while that lasts");
    return;
  }
  if (spectrum->empty()) return;
  double slowest = std::numeric_limits<double>::infinity();
  for (const Complex& lambda : *spectrum) slowest = std::min(slowest, lambda.real());
  const double bound = 1.0 / (2.0 * slowest);
  out.judge(smallest_c >= bound * (1.0 - 1e-9), condition,
            fmt::format("c = {}, the bound is {}{}", text_of(smallest_c), text_of(bound), where(of)), "the states agree (Lemma 6)",
            "agreement is not promised; the condition is sufficient only");
  // x_i(k+1) = Ad x_i(k) + Bd u_i(k): disagreement along an eigenvector of L moves by Ad - c lambda Bd K.
  const auto radius = [&, largest_c](Seconds h) {
    const Discrete exact = discretise(A, B, {}, h);
    double largest = 0.0;
    for (const Complex& lambda : *spectrum) {
      const Eigen::MatrixXcd loop = exact.A.cast<Complex>() - (largest_c * lambda) * (exact.B * K).cast<Complex>();
      largest = std::max(largest, spectral_radius(loop, "Ad - c lambda Bd K"));
    }
    return largest;
  };
  double fastest = A.norm();
  for (const Complex& lambda : *spectrum) fastest = std::max(fastest, (A.norm() + largest_c * std::abs(lambda) * (B * K).norm()));
  const double cost = 4.0 * static_cast<double>(spectrum->size()) * (1000.0 + spectrum_cost(static_cast<double>(A.rows())));
  ask_short_step(of, out, "the control it holds over a round", {radius, 1e-3 / fastest, cost, where(of)},
                 "the sampled loop is stable, from the eigenvalues of Ad - c lambda Bd K",
                 "the sampled loop is unstable by the eigenvalues of Ad - c lambda Bd K");
}

}  // namespace

void examine_static_consensus(const TheoryCase& of, Findings& out) {
  const Physics physics(plant_task(of.experiment, of.experiment.seed));
  ask_spanning_tree(of, out, "everybody hears, however indirectly, of somebody");
  if (!ask_common_dynamics(of, physics, out)) return;
  const Values model = physics.knowledge(agent_at(0));
  const Matrix& A = *model.find("A");
  const Matrix& B = *model.find("B");
  const Values own = of.parameters(agent_at(0));
  judge_coupling(of, out, A, B, lqr_gain(A, B, own.covariance("Q", A.rows()), own.covariance("R", B.cols(), {}, true)));
}

// --- Zamani, Shames, Ugrinovskii 2014 -------------------------------------------------------------------------------------

void examine_minimum_energy_consensus(const TheoryCase& of, Findings& out) {
  ask_single_integrators(of, Physics(plant_task(of.experiment, of.experiment.seed)), out);
  ask_sensed_neighbours(of, out);
  ask_strongly_connected(of, out, "without disturbances everybody tends to x* (24) (Theorem 1)", "Theorem 1 does not apply");
  if (of.survey.failure(has_spanning_tree)) return;
  Seconds bound = std::numeric_limits<double>::infinity();
  for (const std::size_t s : of.survey.distinct()) {
    std::vector<MinimumEnergyWeights> weights;
    for (const AgentId agent : *of.survey.members[s])
      weights.push_back(minimum_energy_weights(of.experiment.parameters_of(of.choice, agent)));
    if (!of.effort.affords(spectrum_cost(2.0 * static_cast<double>(weights.size())))) {
      out.leave_out("dt is short enough for Euler's rule", kTooLarge);
      return;
    }
    const Eigen::VectorXcd F = eigenvalues(minimum_energy_network(*of.survey.graphs[s], weights).F, "F (23)");
    std::vector<Complex> spectrum(F.begin(), F.end());
    spectrum.erase(std::min_element(spectrum.begin(), spectrum.end(), [](auto a, auto b) { return std::abs(a) < std::abs(b); }));
    bound = std::min(bound, euler_bound(spectrum));
  }
  judge_step(of, out, "Euler's rule", bound, "from the eigenvalues of F (23) with stationary gains");
}

void examine_measured_consensus(const TheoryCase& of, Findings& out) {
  ask_single_integrators(of, Physics(plant_task(of.experiment, of.experiment.seed)), out);
  ask_sensed_neighbours(of, out);
  ask_spanning_tree(of, out, "without disturbances everybody tends to one value");
  auto spectrum = of.spectra.without_zero(of.survey);
  if (!spectrum) {
    out.leave_out("dt is short enough for the control it holds over a round", kTooLarge);
    return;
  }
  for (Complex& lambda : *spectrum) lambda = -lambda;
  judge_step(of, out, "the control it holds over a round", euler_bound(*spectrum),
             "from the eigenvalues of I - dt L (a second one of L at zero allows none)");
}

}  // namespace consort
