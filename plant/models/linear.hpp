#pragma once
/// Linear time-invariant parts, one per agent and not coupled:
///
///     x_i' = A_i x_i + B_i u_i + d_i,    y_i = C_i x_i
///
/// Moved from round to round exactly, with u and d held over the step.

#include "core/discretise.hpp"
#include "core/value_doc.hpp"
#include "plant/model.hpp"
#include "plant/model_values.hpp"

#include <array>
#include <memory>

namespace consort {

/// One agent's part, and what it was made from.
struct LinearPart {
  Matrix A, B, C;  ///< n x n, n x m, p x n
  Vector x;        ///< n: initial state
  Layout layout;   ///< names of the n numbers
};

/// Parts of any size, exactly discretised. Other models of linear parts are made of it.
class LinearParts final : public PlantModel {
 public:
  LinearParts(std::vector<LinearPart> parts, Seconds dt) : parts_(std::move(parts)), dt_(dt) {
    for (const LinearPart& part : parts_) {
      const Eigen::Index n = part.A.rows(), m = part.B.cols();
      Matrix inputs(n, m + n);
      inputs << part.B, Matrix::Identity(n, n);
      const Discrete exact = discretise(part.A, inputs, {}, dt);
      steps_.push_back({exact.A, exact.B.leftCols(m), exact.B.rightCols(n)});
    }
  }

  [[nodiscard]] const Layout& state_layout(AgentId i) const override { return part(i).layout; }
  [[nodiscard]] std::size_t control_size(AgentId i) const override { return static_cast<std::size_t>(part(i).B.cols()); }
  [[nodiscard]] std::size_t output_size(AgentId i) const override { return static_cast<std::size_t>(part(i).C.rows()); }
  [[nodiscard]] Vector initial_state(AgentId i) const override { return part(i).x; }
  [[nodiscard]] Values knowledge(AgentId i) const override {
    Values known;
    known.set("A", part(i).A);
    known.set("B", part(i).B);
    known.set("C", part(i).C);
    return known;
  }
  void output(AgentId i, Seconds, std::span<const double> x, std::span<double> y) const override { in(y) = part(i).C * in(x); }

  void advance(Seconds, const Input& input, std::span<double> x) const override {
    std::size_t at = 0, control_at = 0;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const auto& [A, B, G] = steps_[i];
      const auto n = static_cast<std::size_t>(A.rows()), m = static_cast<std::size_t>(B.cols());
      if (input.active[i] != 0) {
        // x_i(k+1) = e^{A h} x_i(k) + (integral of e^{A s} over the step) (B u_i + d_i)
        auto state = in(x.subspan(at, n));
        state = (A * state + B * in(input.control.subspan(control_at, m)) + G * in(input.disturbance.subspan(at, n))).eval();
      }
      at += n;
      control_at += m;
    }
  }

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
  std::vector<LinearPart> parts_;
  std::vector<Step> steps_;
  Seconds dt_;
};

/// The general model: A, B, C of each agent from the experiment.
struct Linear {
  static constexpr std::string_view name = "linear";
  static constexpr std::string_view summary = "x_i' = A x_i + B u_i, y_i = C x_i; common matrices or an agent's own";
  static constexpr std::array parameters{ValueDoc{"A", "matrix n x n", "", "dynamics, 1/s"},
                                         ValueDoc{"B", "matrix n x m", "identity", "input matrix"},
                                         ValueDoc{"C", "matrix p x n", "identity", "output matrix"}};
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
        throw ConfigError("parameter 'B': found " + shape_text(part.B) + "; allowed: " + std::to_string(n) + " rows, as A has");
      if (part.C.cols() != n)
        throw ConfigError("parameter 'C': found " + shape_text(part.C) + "; allowed: " + std::to_string(n) + " columns, as A has");
      part.layout.fields = {{"x", static_cast<std::size_t>(n), 1}};
      parts.push_back(std::move(part));
    }
    return std::make_unique<LinearParts>(std::move(parts), setup.dt);
  }
};

}  // namespace consort
