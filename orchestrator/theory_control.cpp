#include "orchestrator/theory_control.hpp"

#include "core/controllability.hpp"
#include "core/decompositions.hpp"
#include "core/discretise.hpp"
#include "core/minimum_energy.hpp"
#include "core/riccati.hpp"
#include "core/shapes.hpp"
#include "plant/model_physics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace consort {
namespace {

using Complex = std::complex<double>;

/// Eigenvalues other than the one nearest to zero.
std::vector<Complex> without_zero(std::vector<Complex> spectrum) {
  const auto zero =
      std::min_element(spectrum.begin(), spectrum.end(), [](const auto& a, const auto& b) { return std::abs(a) < std::abs(b); });
  if (zero != spectrum.end()) spectrum.erase(zero);
  return spectrum;
}

/// Below this h every I + h s, s of `spectrum`, has modulus below one: |1 + h s| < 1 exactly if h < -2 Re(s) / |s|^2.
Seconds euler_bound(const std::vector<Complex>& spectrum) {
  double step = std::numeric_limits<double>::infinity();
  for (const Complex& s : spectrum) step = std::min(step, -2.0 * s.real() / std::norm(s));
  return step;
}

/// One protocol under examination.
class ControlExamination {
 public:
  ControlExamination(const Experiment& experiment, const Survey& survey, const ProtocolChoice& choice)
      : experiment_(experiment), survey_(survey), choice_(choice) {}

  std::vector<Finding> findings() {
    if (choice_.name == "static_consensus") static_consensus();
    if (choice_.name == "minimum_energy_consensus") minimum_energy();
    if (choice_.name == "measured_consensus") measured();
    if (choice_.name == "continuous_kalman_consensus") continuous_kalman();
    return std::move(out_);
  }

 private:
  void add(Rating verdict, const std::string& condition, std::string evidence, std::string consequence) {
    out_.push_back({verdict, choice_.name + ": " + condition, std::move(evidence), std::move(consequence)});
  }

  /// The different graphs of the run, if they are few and small enough for eigenvalues.
  [[nodiscard]] std::vector<const Graph*> graphs() const {
    std::set<const Graph*> seen;
    std::vector<const Graph*> out;
    for (const auto& segment : survey_.segments)
      if (seen.insert(segment.graph.get()).second) out.push_back(segment.graph.get());
    if (out.size() > kMostGraphs || experiment_.agents > kLargestSpectrum) out.clear();
    return out;
  }
  [[nodiscard]] std::string where() const { return survey_.constant() ? "" : " (the worst of the run's graphs)"; }
  [[nodiscard]] bool spanning() const { return !survey_.failure(has_spanning_tree); }

  void step_finding(const std::string& what, Seconds bound, const std::string& how) {
    const bool holds = experiment_.dt < bound * (1.0 - 1e-9);
    add(holds ? Rating::holds : Rating::fails, "dt is short enough for " + what,
        fmt::format("dt = {}, allowed below {}{}", text_of(experiment_.dt), text_of(bound), where()),
        holds ? "the sampled loop is stable, " + how : "the sampled loop is unstable: take a shorter dt, " + how);
  }

  void sensing_neighbours() {
    const bool holds = experiment_.plant->sensing == PlantSpec::Sensing::neighbours;
    add(holds ? Rating::holds : Rating::fails, "agents measure their in-neighbours", holds ? "sensing: neighbours" : "sensing: own",
        holds ? "y_i holds y_ii and every y_ij" : "the run ends in its first round: set plant.sensing to neighbours");
  }

  // --- static consensus (Knotek, thesis, 2.3.3) ---------------------------------------------------------------------------

  void static_consensus() {
    const Physics physics(plant_task(experiment_, experiment_.seed));
    const Values model = physics.knowledge(agent_at(0));
    const Matrix& A = *model.find("A");
    const Matrix& B = *model.find("B");
    bool common = true;
    for (std::size_t i = 1; i < experiment_.agents; ++i) {
      const Values other = physics.knowledge(agent_at(i));
      common = common && *other.find("A") == A && *other.find("B") == B;
    }
    add(common ? Rating::holds : Rating::fails, "all agents have the same A and B", common ? "the plant's parameters" : "they differ",
        common ? "(2.26) splits into one loop per eigenvalue of L" : "(2.27) says nothing about agents that differ");
    const auto reached = stabilisable(A, B);
    add(reached ? Rating::holds : Rating::fails, "(A, B) is stabilisable",
        reached ? shape_of(A) + " and " + shape_of(B) : "B does not reach the eigenvalue " + text_of(*reached.offending),
        reached ? "the Riccati equation (2.22) has its solution" : "(2.22) has none");
    if (!reached) return;
    const auto own = experiment_.parameters_of(choice_, agent_at(0));
    const Matrix K = lqr_gain(A, B, own.covariance("Q", A.rows(), 1.0), own.covariance("R", B.cols(), 1.0, true));
    coupling(A, B, K);
  }

  void coupling(const Matrix& A, const Matrix& B, const Matrix& K) {
    double smallest_c = std::numeric_limits<double>::infinity(), largest_c = 0.0;
    for (std::size_t i = 0; i < experiment_.agents; ++i) {
      const double c = experiment_.parameters_of(choice_, agent_at(i)).scalar("c");
      smallest_c = std::min(smallest_c, c);
      largest_c = std::max(largest_c, c);
    }
    const std::string condition = "c >= 1 / (2 min Re lambda), lambda the eigenvalues of L other than zero (2.27)";
    const auto all = graphs();
    if (all.empty()) {
      add(Rating::note, condition, "too many graphs or agents for eigenvalues", "the bound was not computed");
      return;
    }
    if (!spanning()) {
      add(Rating::fails, condition, "a second eigenvalue is zero: no spanning tree" + where(), "no c is enough while that lasts");
      return;
    }
    std::vector<Complex> spectrum;
    for (const Graph* graph : all) {
      const auto some = without_zero(laplacian_spectrum(*graph));
      spectrum.insert(spectrum.end(), some.begin(), some.end());
    }
    if (spectrum.empty()) return;
    double slowest = std::numeric_limits<double>::infinity();
    for (const Complex& lambda : spectrum) slowest = std::min(slowest, lambda.real());
    const double bound = 1.0 / (2.0 * slowest);
    const bool enough = smallest_c >= bound * (1.0 - 1e-9);
    add(enough ? Rating::holds : Rating::fails, condition,
        fmt::format("c = {}, the bound is {}{}", text_of(smallest_c), text_of(bound), where()),
        enough ? "the states agree (Lemma 6)" : "agreement is not promised; the condition is sufficient only");
    // x_i(k+1) = Ad x_i(k) + Bd u_i(k): disagreement along an eigenvector of L moves by Ad - c lambda Bd K.
    const auto radius = [&](Seconds h) {
      const Discrete exact = discretise(A, B, {}, h);
      double largest = 0.0;
      for (const Complex& lambda : spectrum) {
        const Eigen::MatrixXcd loop = exact.A.cast<Complex>() - (largest_c * lambda) * (exact.B * K).cast<Complex>();
        largest = std::max(largest, eigenvalues(loop, "Ad - c lambda Bd K").cwiseAbs().maxCoeff());
      }
      return largest;
    };
    double fastest = A.norm();
    for (const Complex& lambda : spectrum) fastest = std::max(fastest, (A.norm() + largest_c * std::abs(lambda) * (B * K).norm()));
    step_finding("the control it holds over a round", largest_stable_step(radius, 1e-3 / fastest),
                 "from the eigenvalues of Ad - c lambda Bd K");
  }

  // --- Zamani, Shames, Ugrinovskii 2014 -----------------------------------------------------------------------------------

  void minimum_energy() {
    sensing_neighbours();
    const auto weak = survey_.failure(strongly_connected);
    add(weak ? Rating::fails : Rating::holds, "strongly connected in every round",
        weak ? fmt::format("not in {} rounds, first in round {}", weak->count, weak->first) : "all rounds",
        weak ? "Theorem 1 does not apply" : "without disturbances everybody tends to x* (24) (Theorem 1)");
    const auto all = graphs();
    if (all.empty() || !spanning()) return;
    std::vector<MinimumEnergyWeights> weights;
    for (std::size_t i = 0; i < experiment_.agents; ++i)
      weights.push_back(minimum_energy_weights(experiment_.parameters_of(choice_, agent_at(i))));
    Seconds bound = std::numeric_limits<double>::infinity();
    for (const Graph* graph : all) {
      const Eigen::VectorXcd spectrum = eigenvalues(minimum_energy_network(*graph, weights).F, "F (23)");
      bound = std::min(bound, euler_bound(without_zero({spectrum.begin(), spectrum.end()})));
    }
    step_finding("Euler's rule", bound, "from the eigenvalues of F (23) with stationary gains");
  }

  void measured() {
    sensing_neighbours();
    const auto all = graphs();
    if (all.empty()) return;
    Seconds bound = std::numeric_limits<double>::infinity();
    for (const Graph* graph : all) {
      std::vector<Complex> spectrum = without_zero(laplacian_spectrum(*graph));
      for (Complex& lambda : spectrum) lambda = -lambda;
      bound = std::min(bound, euler_bound(spectrum));
    }
    step_finding("the control it holds over a round", bound, "from the eigenvalues of I - dt L (a second one of L at zero allows none)");
  }

  // --- Ren, Beard, Kingston 2005, (1)-(3) ---------------------------------------------------------------------------------

  /// Largest eigenvalue of P_i sum_j g_ij (P_j + Omega)^-1 at the start, over agents and graphs.
  [[nodiscard]] double largest_gain(const std::vector<const Graph*>& all) const {
    std::vector<Matrix> P;
    for (std::size_t i = 0; i < experiment_.agents; ++i) {
      const Values initial = experiment_.initial_of(agent_at(i), experiment_.seed);
      P.push_back(initial.covariance("P", initial.vector("x").size(), 1.0, true));
    }
    double largest = 0.0;
    for (std::size_t i = 0; i < experiment_.agents; ++i) {
      const Matrix Omega = experiment_.parameters_of(choice_, agent_at(i)).covariance("Omega", P[i].rows(), 0.0);
      const Matrix root = P[i].llt().matrixL();
      for (const Graph* graph : all) {
        Matrix certainty = Matrix::Zero(P[i].rows(), P[i].rows());
        for (const Neighbour& j : graph->in_neighbours(agent_at(i)))
          certainty += j.weight * inverse(P[index_of(j.id)] + Omega, "P_j + Omega");
        const Matrix gains = root.transpose() * certainty * root;
        largest = std::max(largest, symmetric_eigenvalues(gains).maxCoeff());
      }
    }
    return largest;
  }

  void continuous_kalman() {
    constexpr double kRungeKutta = 2.785;  // where RK4's interval of stability on the negative real axis ends
    auto all = graphs();
    const bool sampled = all.empty();
    if (sampled) all = {survey_.segments.front().graph.get()};
    const double gain = largest_gain(all);
    Seconds bound = std::numeric_limits<double>::infinity();
    bool euler = false;
    for (std::size_t i = 0; i < experiment_.agents; ++i) {
      const auto own = experiment_.parameters_of(choice_, agent_at(i));
      const bool its = own.scalar("method", 0.0) == 1.0;
      euler = euler || its;
      // x_i decays at the gain towards what it hears, P_i at twice the gain towards its limit.
      bound = std::min(bound, own.scalar("steps", 1.0) * (its ? 1.0 : 0.5 * kRungeKutta) / gain);
    }
    const bool holds = experiment_.dt < bound;
    add(holds ? Rating::holds : Rating::fails,
        "the integration steps are short against 1 / the largest gain P_i sum_j g_ij (P_j + Omega)^-1",
        fmt::format("largest gain at the start {}{}; dt = {}, allowed below {}{}", text_of(gain),
                    sampled ? " (in the first round)" : where(), text_of(experiment_.dt), text_of(bound), euler ? " (Euler)" : ""),
        holds ? fmt::format("a round is integrated stably; holding what is heard over it costs an error of about {} of a difference",
                            text_of(0.5 * gain * experiment_.dt))
              : "the integration overshoots: take a shorter dt or more steps");
  }

  const Experiment& experiment_;
  const Survey& survey_;
  const ProtocolChoice& choice_;
  std::vector<Finding> out_;
};

}  // namespace

std::vector<Finding> examine_control(const Experiment& experiment, const Survey& survey, const ProtocolChoice& choice) {
  return ControlExamination(experiment, survey, choice).findings();
}

Seconds largest_stable_step(const std::function<double(Seconds)>& radius, Seconds shortest) {
  constexpr double kGrowth = 1.2, kFarthest = 1e6, kDigits = 1e-7;
  Seconds stable = shortest;
  if (!(radius(stable) < 1.0)) return 0.0;
  while (radius(stable * kGrowth) < 1.0) {
    stable *= kGrowth;
    if (stable > kFarthest * shortest) return std::numeric_limits<double>::infinity();
  }
  Seconds unstable = stable * kGrowth;
  while (unstable - stable > kDigits * stable) {
    const Seconds middle = 0.5 * (stable + unstable);
    (radius(middle) < 1.0 ? stable : unstable) = middle;
  }
  return stable;
}

}  // namespace consort
