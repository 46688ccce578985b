#pragma once
/// One linear time-invariant plant that every agent observes through its own sensor, or through none:
///
///     x' = A x + sum_i B_i u_i + d,    y_i = C_i x
///
/// Moved from round to round exactly, with u and d held over the step. It moves whoever is absent.

#include "core/math/discretise.hpp"
#include "core/value_doc.hpp"
#include "models/model.hpp"
#include "models/values.hpp"

#include <array>
#include <memory>

namespace consort {

/// The one plant and the sensors and inputs of all agents. Other models of a shared plant are made of it.
class SharedPlant final : public PlantModel {
 public:
  struct Part {
    Matrix B, C;  ///< n x m_i, p_i x n; p_i = 0: this agent measures nothing
  };
  /// `known` is what every agent may know beside its A, B, C. Throws ConfigError where a part does not fit A.
  SharedPlant(Matrix A, std::vector<Part> parts, Vector x, Layout layout, Seconds dt, Values known = {})
      : A_(std::move(A)), parts_(std::move(parts)), x_(std::move(x)), layout_(std::move(layout)), dt_(dt), known_(std::move(known)) {
    const Eigen::Index n = A_.rows();
    Eigen::Index m = 0;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const std::string agent = "agent " + std::to_string(i + 1) + ": ";
      if (parts_[i].B.rows() != n)
        throw ConfigError(agent + "parameter 'B': found " + shape_text(parts_[i].B) + "; allowed: " + std::to_string(n) +
                          " rows, as A has");
      if (parts_[i].C.cols() != n)
        throw ConfigError(agent + "parameter 'C': found " + shape_text(parts_[i].C) + "; allowed: " + std::to_string(n) +
                          " columns, as A has");
      m += parts_[i].B.cols();
    }
    Matrix inputs(n, m + n);
    m = 0;
    for (const Part& part : parts_) {
      inputs.middleCols(m, part.B.cols()) = part.B;
      m += part.B.cols();
    }
    inputs.rightCols(n).setIdentity();
    const Discrete exact = discretise(A_, inputs, {}, dt_);
    step_A_ = exact.A;
    step_B_ = exact.B.leftCols(m);
    step_G_ = exact.B.rightCols(n);
  }

  [[nodiscard]] bool shared() const override { return true; }
  [[nodiscard]] const Layout& state_layout(AgentId) const override { return layout_; }
  [[nodiscard]] std::size_t control_size(AgentId i) const override { return static_cast<std::size_t>(part(i).B.cols()); }
  [[nodiscard]] std::size_t output_size(AgentId i) const override { return static_cast<std::size_t>(part(i).C.rows()); }
  [[nodiscard]] Vector initial_state(AgentId) const override { return x_; }
  /// A; B and C where the agent has any; what the model adds.
  [[nodiscard]] Values knowledge(AgentId i) const override {
    Values known = known_;
    known.set("A", A_);
    if (part(i).B.size() > 0) known.set("B", part(i).B);
    if (part(i).C.size() > 0) known.set("C", part(i).C);
    return known;
  }
  void output(AgentId i, Seconds, const Whole& whole, std::span<double> y) const override {
    Eigen::Map<Vector>(y.data(), static_cast<Eigen::Index>(y.size())) = part(i).C * in(whole.x);
  }
  void advance(Seconds, const Input& input, std::span<double> x) const override {
    // x(k+1) = e^{A h} x(k) + (integral of e^{A s} over the step) (sum_i B_i u_i + d)
    Eigen::Map<Vector> state(x.data(), static_cast<Eigen::Index>(x.size()));
    state = (step_A_ * state + step_B_ * in(input.control) + step_G_ * in(input.disturbance)).eval();
  }
  [[nodiscard]] Matrix increment_covariance(AgentId, const Matrix& intensity) const override {
    return discretise(A_, {}, intensity, dt_).Q;
  }

 private:
  [[nodiscard]] const Part& part(AgentId i) const { return parts_.at(index_of(i)); }
  static Eigen::Map<const Vector> in(std::span<const double> x) { return {x.data(), static_cast<Eigen::Index>(x.size())}; }
  Matrix A_;
  std::vector<Part> parts_;
  Vector x_;
  Layout layout_;
  Seconds dt_;
  Values known_;
  Matrix step_A_, step_B_, step_G_;
};

/// A from the experiment, the same for all; B_i and C_i of each agent.
struct SharedLinear {
  static constexpr std::string_view name = "shared_linear";
  static constexpr std::string_view summary =
      "x' = A x + sum_i B_i u_i, y_i = C_i x: one plant that every agent observes through its own C";
  static constexpr bool shared = true;
  static constexpr std::array parameters{ValueDoc{"A", "matrix n x n", "", "dynamics, 1/s; the same for all"},
                                         ValueDoc{"B", "matrix n x m", "none", "input matrix of an agent"},
                                         ValueDoc{"C", "matrix p x n", "none", "output matrix of an agent; none: it measures nothing"}};
  static constexpr std::array initial{ValueDoc{"x", "vector n", "0", "initial state x(0); the same for all"}};

  static std::unique_ptr<PlantModel> make(const PlantSetup& setup) {
    const Matrix* A = setup.parameters.at(0).find("A");
    if (A == nullptr || A->rows() != A->cols()) throw ConfigError("parameter 'A': expected a square matrix, the dynamics of the plant");
    const Eigen::Index n = A->rows();
    const Vector x = initial_vector(setup.initial.at(0), "x", n);
    std::vector<SharedPlant::Part> parts;
    for (std::size_t i = 0; i < setup.agents; ++i) {
      const Values& own = setup.parameters[i];
      if (!own.has("A") || *own.find("A") != *A || initial_vector(setup.initial[i], "x", n) != x)
        throw ConfigError("agent " + std::to_string(i + 1) + ": its plant has another A or initial x; allowed: one plant for all");
      parts.push_back({own.has("B") ? *own.find("B") : Matrix(n, 0), own.has("C") ? *own.find("C") : Matrix(0, n)});
    }
    return std::make_unique<SharedPlant>(*A, std::move(parts), x, Layout{{{"x", static_cast<std::size_t>(n), 1}}}, setup.dt);
  }
};

}  // namespace consort
