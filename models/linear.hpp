#pragma once
/// Linear time-invariant parts, one per agent, each of its own size, which may act on each other:
///
///     x_i' = A_i x_i + B_i u_i + sum_j A_ij x_j + d_i,    y_i = C_i x_i + sum_j C_ij x_j
///
/// Moved from round to round exactly, with u and d held over the step. An absent agent acts on nobody.

#include "core/counted.hpp"
#include "core/math/discretise.hpp"
#include "core/value_doc.hpp"
#include "models/model.hpp"
#include "models/values.hpp"

#include <array>
#include <map>
#include <memory>
#include <mutex>

namespace consort {

/// One agent's part, and what it was made from.
struct LinearPart {
  Matrix A, B, C;  ///< n x n, n x m, p x n
  Vector x;        ///< n: initial state
  Layout layout;   ///< names of the n numbers
  /// What agent `from`, of n_j states, does to this part; an empty matrix: nothing.
  struct Coupling {
    AgentId from;
    Matrix A, C;  ///< n x n_j, p x n_j
  };
  std::vector<Coupling> couplings = {};  ///< ascending by agent
};

/// Parts of any size, exactly discretised. Other models of linear parts are made of it.
class LinearParts final : public PlantModel {
 public:
  /// Throws ConfigError where a coupling does not fit the parts.
  LinearParts(std::vector<LinearPart> parts, Seconds dt) : parts_(std::move(parts)), dt_(dt) {
    for (const LinearPart& part : parts_) {
      const Eigen::Index n = part.A.rows(), m = part.B.cols();
      starts_.push_back(n_);
      control_starts_.push_back(m_);
      n_ += n;
      m_ += m;
      Matrix inputs(n, m + n);
      inputs << part.B, Matrix::Identity(n, n);
      const Discrete exact = discretise(part.A, inputs, {}, dt);
      steps_.push_back({exact.A, exact.B.leftCols(m), exact.B.rightCols(n)});
    }
    for (std::size_t i = 0; i < parts_.size(); ++i) check_couplings(agent_at(i));
  }

  [[nodiscard]] const Layout& state_layout(AgentId i) const override { return part(i).layout; }
  [[nodiscard]] std::size_t control_size(AgentId i) const override { return static_cast<std::size_t>(part(i).B.cols()); }
  [[nodiscard]] std::size_t output_size(AgentId i) const override { return static_cast<std::size_t>(part(i).C.rows()); }
  [[nodiscard]] Vector initial_state(AgentId i) const override { return part(i).x; }
  /// A, B, C; A_2, C_2, ... of the agents that act on it.
  [[nodiscard]] Values knowledge(AgentId i) const override {
    Values known;
    known.set("A", part(i).A);
    known.set("B", part(i).B);
    known.set("C", part(i).C);
    for (const LinearPart::Coupling& coupling : part(i).couplings) {
      const std::string suffix = "_" + std::to_string(coupling.from.value);
      if (coupling.A.size() > 0) known.set("A" + suffix, coupling.A);
      if (coupling.C.size() > 0) known.set("C" + suffix, coupling.C);
    }
    return known;
  }
  void output(AgentId i, Seconds, const Whole& whole, std::span<double> y) const override {
    in(y) = part(i).C * state(whole.x, i);
    for (const LinearPart::Coupling& coupling : part(i).couplings)
      if (coupling.C.size() > 0 && whole.active[index_of(coupling.from)] != 0) in(y) += coupling.C * state(whole.x, coupling.from);
  }

  void advance(Seconds, const Input& input, std::span<double> x) const override {
    if (coupled_) {
      const std::shared_ptr<const Step> step = whole_step(input.active);
      // x(k+1) = e^{A h} x(k) + (integral of e^{A s} over the step) (B u + d), of all parts at once
      in(x) = (step->A * in(std::span<const double>(x)) + step->B * in(input.control) + step->G * in(input.disturbance)).eval();
      return;
    }
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (input.active[i] == 0) continue;
      const auto& [A, B, G] = steps_[i];
      const auto at = static_cast<std::size_t>(starts_[i]), n = static_cast<std::size_t>(A.rows());
      const auto control_at = static_cast<std::size_t>(control_starts_[i]), m = static_cast<std::size_t>(B.cols());
      // x_i(k+1) = e^{A h} x_i(k) + (integral of e^{A s} over the step) (B u_i + d_i)
      auto own = in(x.subspan(at, n));
      own = (A * own + B * in(input.control.subspan(control_at, m)) + G * in(input.disturbance.subspan(at, n))).eval();
    }
  }

  /// Of the agent's own dynamics: what its noise does to others within the step is left out (of the order h^2).
  [[nodiscard]] Matrix increment_covariance(AgentId i, const Matrix& intensity) const override {
    return discretise(part(i).A, {}, intensity, dt_).Q;
  }

 private:
  struct Step {
    Matrix A, B, G;
  };
  [[nodiscard]] const LinearPart& part(AgentId i) const { return parts_.at(index_of(i)); }
  static Eigen::Map<Vector> in(std::span<double> x) { return {x.data(), static_cast<Eigen::Index>(x.size())}; }
  static Eigen::Map<const Vector> in(std::span<const double> x) { return {x.data(), static_cast<Eigen::Index>(x.size())}; }
  [[nodiscard]] Eigen::Map<const Vector> state(std::span<const double> x, AgentId i) const {
    return {x.data() + starts_[index_of(i)], part(i).A.rows()};
  }

  void check_couplings(AgentId i) {
    const LinearPart& own = part(i);
    for (const LinearPart::Coupling& coupling : own.couplings) {
      const std::string edge = "coupling " + std::to_string(coupling.from.value) + " -> " + std::to_string(i.value) + ": ";
      if (index_of(coupling.from) >= parts_.size() || coupling.from == i)
        throw ConfigError(edge + "allowed: another agent, from 1 to " + std::to_string(parts_.size()));
      const Eigen::Index columns = part(coupling.from).A.rows();
      const auto fits = [&](const char* name, const Matrix& given, Eigen::Index rows) {
        if (given.size() == 0 || (given.rows() == rows && given.cols() == columns)) return;
        throw ConfigError(edge + name + " is " + shape_text(given) + "; allowed: " + std::to_string(rows) + " x " +
                          std::to_string(columns));
      };
      fits("A", coupling.A, own.A.rows());
      fits("C", coupling.C, own.C.rows());
      coupled_ = coupled_ || coupling.A.size() > 0;
    }
  }

  /// The step of all parts together, those that are absent standing still and acting on nobody.
  [[nodiscard]] std::shared_ptr<const Step> whole_step(std::span<const char> active) const {
    const std::lock_guard lock(mutex_);
    std::shared_ptr<const Step>& step = whole_steps_[{active.begin(), active.end()}];
    if (step) return step;
    Matrix A = Matrix::Zero(n_, n_), inputs = Matrix::Zero(n_, m_ + n_);
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (active[i] == 0) continue;
      const LinearPart& own = parts_[i];
      const Eigen::Index at = starts_[i], n = own.A.rows();
      A.block(at, at, n, n) = own.A;
      for (const LinearPart::Coupling& coupling : own.couplings)
        if (coupling.A.size() > 0 && active[index_of(coupling.from)] != 0)
          A.block(at, starts_[index_of(coupling.from)], n, coupling.A.cols()) = coupling.A;
      inputs.block(at, control_starts_[i], n, own.B.cols()) = own.B;
      inputs.block(at, m_ + at, n, n).setIdentity();
    }
    const Discrete exact = discretise(A, inputs, {}, dt_);
    step = std::make_shared<const Step>(Step{exact.A, exact.B.leftCols(m_), exact.B.rightCols(n_)});
    return step;
  }

  std::vector<LinearPart> parts_;
  std::vector<Eigen::Index> starts_, control_starts_;  // by agent, in the state and the controls of the whole
  Eigen::Index n_ = 0, m_ = 0;
  std::vector<Step> steps_;  // by agent
  Seconds dt_;
  bool coupled_ = false;
  mutable std::mutex mutex_;  // guards what follows: computed when an attendance is met first
  mutable std::map<std::vector<char>, std::shared_ptr<const Step>> whole_steps_;
};

/// The general model: A, B, C of each agent from the experiment.
struct Linear {
  static constexpr std::string_view name = "linear";
  static constexpr std::string_view summary =
      "x_i' = A x_i + B u_i + sum_j A_ij x_j, y_i = C x_i + sum_j C_ij x_j; common matrices or an agent's own";
  static constexpr std::array parameters{ValueDoc{"A", "matrix n x n", "", "dynamics, 1/s"},
                                         ValueDoc{"B", "matrix n x m", "identity", "input matrix"},
                                         ValueDoc{"C", "matrix p x n", "identity", "output matrix"}};
  static constexpr std::array couplings{ValueDoc{"A", "matrix n_i x n_j", "0", "what x_j does to x_i', 1/s"},
                                        ValueDoc{"C", "matrix p_i x n_j", "0", "what x_j does to y_i"}};
  static constexpr std::array initial{ValueDoc{"x", "vector n", "0", "initial state x_i(0)"}};

  static std::unique_ptr<PlantModel> make(const PlantSetup& setup) {
    std::vector<LinearPart> parts;
    for (std::size_t i = 0; i < setup.agents; ++i) {
      const Values& given = setup.parameters[i];
      const Matrix* A = given.find("A");
      if (A == nullptr || A->rows() != A->cols()) throw ConfigError("parameter 'A': expected a square matrix, the dynamics of an agent");
      const Eigen::Index n = A->rows();
      LinearPart part{*A,
                      given.has("B") ? *given.find("B") : Matrix::Identity(n, n),
                      given.has("C") ? *given.find("C") : Matrix::Identity(n, n),
                      initial_vector(setup.initial[i], "x", n),
                      {}};
      if (part.B.rows() != n)
        throw ConfigError("parameter 'B': found " + shape_text(part.B) + "; allowed: " + counted(static_cast<std::uint64_t>(n), "row") +
                          ", as A has");
      if (part.C.cols() != n)
        throw ConfigError("parameter 'C': found " + shape_text(part.C) + "; allowed: " + counted(static_cast<std::uint64_t>(n), "column") +
                          ", as A has");
      part.layout.fields = {{"x", static_cast<std::size_t>(n), 1}};
      for (std::size_t j = 0; j < setup.agents; ++j) {
        const std::string suffix = "_" + std::to_string(j + 1);
        const Matrix *Aij = given.find("A" + suffix), *Cij = given.find("C" + suffix);
        if (Aij != nullptr || Cij != nullptr)
          part.couplings.push_back({agent_at(j), Aij != nullptr ? *Aij : Matrix(), Cij != nullptr ? *Cij : Matrix()});
      }
      parts.push_back(std::move(part));
    }
    return std::make_unique<LinearParts>(std::move(parts), setup.dt);
  }
};

}  // namespace consort
