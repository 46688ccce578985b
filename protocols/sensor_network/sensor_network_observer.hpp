#pragma once
/// Agents that share one linear plant observe it together: each corrects its estimate of the whole state by its own sensor, if it has one,
/// and draws it to the estimates it hears, most where its own sensor tells least.
///
///     zhat_i' = A zhat_i + G_i (y_i - C_i zhat_i) + F_i sum_j w_ij (zhat_j - zhat_i)                                    (3.22)
///     G_i = T_i' [M_i^-1 C_io' R_i^-1; 0],    F_i = gamma T_i' blkdiag(M_i^-1, I / alpha_j) T_i                  (3.28), (3.31)
///     M_i^-1 A_io' + A_io M_i^-1 + Q_io - M_i^-1 C_io' R_i^-1 C_io M_i^-1 = 0                                           (3.29)
///     alpha_j = min(1, beta min_i alpha_ij^max),    alpha_ij^max = balance lambda_min(M_i Q_io M_i) / ((p - 1) lambda_max(A_j + A_j'))
///                                                                                                              (3.85), (3.86)
/// Source: Knotek, thesis, chapter 3, with Algorithm 3.2. The state groups j are the blocks that A does not couple; T_i sorts those that
/// C_i sees (o) before the others, and alpha_j belongs to the others. A group is seen if its columns of C_i are not zero.
///
/// alpha_ij^max travels by flooding (protocols/sensor_network/flooding.hpp, as its inverse, so that no bound is 0): it ends by itself, also
/// after somebody joined or left. Until it has ended for the first time an agent corrects by its own sensor alone; later, until it has
/// ended again, it keeps the alpha it had. `alpha` given: no agent waits. p is the agreed maximum number of agents. w_min / w_max, of the
/// left null vector of the leaders' Laplacian, is a fact of the whole graph: `balance`, agreed beforehand, says how small it may be. gamma
/// not given: 1 if lambda_max(A + A') <= 0; else 1.1 times the bound (3.83) of the worst strongly connected graph of p agents whose edges
/// weigh at least 1, lambda_max(A + A') / (2 balance (1 - cos(pi / p))), since W L + L'W is then a Laplacian that weighs every edge of some
/// connected graph at least w_min. (3.84), of those who follow the leaders, depends on the graph: `consort validate`.
///
/// One exchange per round, corrected and then moved on by the plant's own dynamics, so that data of the same instant meet:
///     zhat_i+ = exp(A h) [ zhat_i + h G_i (y_i - C_i zhat_i) + S_i sum_j w_ij (zhat_j - zhat_i) ],    S_i = (I - exp(-F_i d_i h)) / d_i
/// with d_i = sum_j w_ij; the consensus part is stable whatever h, the correction for h rho(G_i C_i) < 1.
/// Assumes: one plant for all (shared), linear; every group seen by an agent that reaches all others (3.21), Assumption 10.
/// A missing message is an absent edge: its term is missing from the sum and its weight from d_i. With no message an agent goes on with its
/// own sensor. A delayed estimate is moved on to the present by the plant's dynamics. Link noise disturbs the estimate alone.

#include "core/counted.hpp"
#include "core/math/discretise.hpp"
#include "protocols/adapter.hpp"
#include "protocols/sensor_network/design.hpp"
#include "protocols/sensor_network/flooding.hpp"
#include "protocols/sensor_network/metrics.hpp"
#include "protocols/sensor_network/theory.hpp"

namespace consort {

struct SensorNetworkObserver {
  static constexpr std::string_view name = "sensor_network_observer";
  static constexpr std::string_view summary = "observers of one plant, some with a sensor, share what each cannot see";
  static constexpr std::string_view source = "Knotek, thesis, (3.22)-(3.31), Algorithm 3.2";
  static constexpr std::string_view assumptions = "one shared linear plant, every state group seen by a leader; leaders strongly connected";
  static constexpr bool needs_plant = true;
  static constexpr Truth truth = Truth::state;
  static constexpr auto& metrics = kNetworkMetrics;
  static constexpr auto examine = examine_sensor_network;
  static constexpr std::array parameters{
      ValueDoc{"Q", "covariance n x n (scalar, diagonal or matrix)", "1", "intensity Omega of the plant's process noise, > 0"},
      ValueDoc{"R", "covariance p x p (scalar, diagonal or matrix)", "1", "intensity Xi_i of the own sensor's noise, > 0"},
      ValueDoc{"gamma", "scalar", "bound (3.83)", "gamma, how strongly estimates are drawn together, > 0"},
      ValueDoc{"alpha", "scalar or vector of groups", "Algorithm 3.2", "alpha_j of the state groups not seen, > 0"},
      ValueDoc{"beta", "scalar", "1", "beta of (3.86), in (0, 1]"},
      ValueDoc{"balance", "scalar", "1", "w_min / w_max of the leaders' left null vector at least, in (0, 1]; 1: balanced graph"},
      ValueDoc{"flooding_rounds", "scalar", "maximum number of agents", "L: rounds after which a value is final or forgotten"}};
  static constexpr std::array initial{ValueDoc{"x", "vector n", "0", "initial estimate zhat_i(0); a scalar stands for every component"}};
  static constexpr std::array estimate_values{ValueDoc{"x", "vector n", "", "estimate zhat_i of the plant's state"},
                                              ValueDoc{"alpha", "vector of groups", "", "alpha_j of the state groups; 0: not yet known"},
                                              ValueDoc{"flooding", "scalar", "", "1: values are still flooded"}};
  static constexpr std::array recorded_values{ValueDoc{"F", "matrix n x n", "", "consensus gain F_i; absent until alpha is known"}};

  struct Params {
    StateGroups groups;
    LocalObserver own;
    Matrix C, E;  ///< C_i, exp(A h)
    SensorTuning agreed;
    Vector inverse_bound;  ///< 1 / alpha_ij^max by group
  };
  struct State {
    Vector record;  ///< zhat_i (n); alpha_j of every group, 0: not yet known; whether the flooding is under way
    FloodedMaximum flooding;
    Matrix F, S;                   ///< F_i; S_i for in-degree d
    double d = -1.0;               ///< -1: S is not that of F
    Vector sum, step, innovation;  ///< of the present round: n, n, p
    [[nodiscard]] Eigen::Map<const Vector> z() const { return {record.data(), sum.size()}; }
    [[nodiscard]] bool knows_alpha() const { return record[sum.size()] > 0.0; }
  };
  struct Message {
    Numbers x, bound, age;
    static constexpr std::array<std::string_view, 3> field_names{"x", "bound", "age"};
    static constexpr std::string_view noisy_field = "x";
    static auto fields(auto& m) { return std::tie(m.x, m.bound, m.age); }
  };

  static Params params(const Values& values, const Setup& setup) {
    const Matrix* A = setup.model.find("A");
    if (A == nullptr) refuse(setup, "does not know the plant's A; allowed: a linear plant that all agents share");
    Params p;
    p.groups = state_groups(*A);
    p.C = setup.model.has("C") ? *setup.model.find("C") : Matrix(0, A->cols());
    if (p.C.rows() != static_cast<Eigen::Index>(setup.measurement_size))
      refuse(setup,
             "measures " + counted(setup.measurement_size, "number") + "; allowed: the " + std::to_string(p.C.rows()) + " of its C alone");
    p.E = matrix_exponential(*A, setup.dt);
    p.own = local_observer(setup.self, *A, p.groups, p.C, values.covariance("Q", A->rows(), 1.0, true),
                           p.C.rows() == 0 ? Matrix(0, 0) : values.covariance("R", p.C.rows(), 1.0, true));
    p.agreed = sensor_tuning(setup.self, values, *A, p.groups.size(), setup.agents);
    p.inverse_bound = inverse_alpha_bounds(p.own, *A, p.groups, setup.agents, p.agreed.balance);
    return p;
  }

  static State init(const Params& p, const Setup& setup) {
    const Eigen::Index n = p.E.rows(), l = p.inverse_bound.size();
    State s{
        Vector::Zero(n + l + 1), FloodedMaximum(p.inverse_bound, p.agreed.flooding_rounds), {}, {}, -1.0, Vector::Zero(n), Vector::Zero(n),
        Vector::Zero(p.C.rows())};
    if (setup.initial.has("x")) {
      const Vector x = setup.initial.vector("x");
      if (x.size() != n && x.size() != 1)
        refuse(setup,
               "found an initial x of length " + std::to_string(x.size()) + "; allowed: that of the plant's state, " + std::to_string(n));
      s.record.head(n) = x.size() == n ? x : Vector::Constant(n, x[0]);
    }
    s.record[n + l] = 1.0;
    if (p.agreed.alpha.size() > 0) use(p, s, p.agreed.alpha);
    return s;
  }
  static Message message(const Params&, const State& s, const Sense&) {
    return {s.z(), view(s.flooding.largest()), view(s.flooding.ages())};
  }

  /// State at k + 1 (z: n x 1, in the units of the plant's state).
  static void transition(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    if (sense.y.size() < static_cast<std::size_t>(p.C.rows()))
      check(false, "an agent with a sensor is given its measurement in every round");
    auto z = s.record.head(s.sum.size());
    double d = 0.0;
    s.sum.setZero();
    for (const auto& [from, sent, w_ij, heard] : inbox) {
      if (sent == sense.k)
        s.sum += w_ij * (heard.x.vector() - z);
      else
        s.sum += w_ij * (moved_on(p, heard.x.vector(), sense.k - sent) - z);
      d += w_ij;
    }
    s.step.setZero();
    if (d > 0.0 && s.knows_alpha()) {
      if (d != s.d) {
        s.S = consensus_step(s.F, d, sense.dt);
        s.d = d;
      }
      s.step.noalias() += s.S * s.sum;
    }
    if (p.C.rows() > 0) {
      s.innovation = Eigen::Map<const Vector>(sense.y.data(), p.C.rows());
      s.innovation.noalias() -= p.C * z;
      s.innovation *= sense.dt;
      s.step.noalias() += p.own.G * s.innovation;
    }
    // zhat_i+ = exp(A h) [ zhat_i + h G_i (y_i - C_i zhat_i) + S_i sum_j w_ij (zhat_j - zhat_i) ]
    s.step += z;
    z.noalias() = p.E * s.step;
    flood(p, s, sense, inbox);
  }

  /// zhat_i, then alpha and whether the flooding is under way.
  static const Vector& estimate(const State& s) { return s.record; }
  static auto recorded(const Params&, const State& s) {
    const Eigen::Index n = s.sum.size();
    return std::make_tuple(s.F.size() > 0 ? s.F : Matrix(Matrix::Constant(n, n, kAbsent)));
  }
  static std::vector<Field> estimate_fields(const State& s) {
    const auto n = static_cast<std::size_t>(s.sum.size()), l = static_cast<std::size_t>(s.record.size()) - n - 1;
    return {{"x", n, 1}, {"alpha", l, 1}, {"flooding", 1, 1}};
  }

 private:
  /// zhat_j of so many rounds ago, where the plant's dynamics have brought it by now.
  static Vector moved_on(const Params& p, Vector z_j, Round rounds) {
    for (Round r = 0; r < rounds; ++r) z_j = (p.E * z_j).eval();
    return z_j;
  }

  static void flood(const Params& p, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    s.flooding.begin();
    for (const auto& [from, sent, w_ij, heard] : inbox) s.flooding.heard(heard.bound.vector(), heard.age.vector(), sense.k - sent);
    s.flooding.end();
    double& under_way = s.record[s.record.size() - 1];
    const bool ended = s.flooding.ended();
    // alpha_j = min(1, beta min_i alpha_ij^max), once everybody has been heard                                          (3.86)
    if (ended && under_way != 0.0 && p.agreed.alpha.size() == 0) use(p, s, alpha_of(s.flooding.largest(), p.agreed.beta));
    under_way = ended ? 0.0 : 1.0;
  }

  static void use(const Params& p, State& s, const Vector& alpha) {
    auto used = s.record.segment(s.sum.size(), alpha.size());
    if (used == alpha) return;
    used = alpha;
    s.F = consensus_gain(p.own, p.groups, p.agreed.gamma, alpha.cwiseInverse());
    s.d = -1.0;
  }

  static Numbers view(const Vector& vector) { return {Eigen::Map<const Vector>(vector.data(), vector.size())}; }
  [[noreturn]] static void refuse(const Setup& setup, const std::string& what) {
    throw ConfigError("protocol sensor_network_observer: agent " + std::to_string(setup.self.value) + " " + what);
  }
};

}  // namespace consort
