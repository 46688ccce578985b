#pragma once
/// What every nonlinear model shares: x_i' = f_i(t, x_i, u_i) + d_i integrated by the classical Runge-Kutta method (RK4) in sub-steps,
/// with u and d held over the round.

#include "models/model.hpp"
#include "models/values.hpp"

namespace consort {

class NonlinearParts : public PlantModel {
 public:
  /// `layout` and the m inputs are those of every agent; the whole state is measured.
  NonlinearParts(std::vector<Vector> initial, Layout layout, std::size_t controls, Seconds dt, Eigen::Index substeps)
      : initial_(std::move(initial)), layout_(std::move(layout)), controls_(controls), dt_(dt), substeps_(substeps) {}

  [[nodiscard]] const Layout& state_layout(AgentId) const override { return layout_; }
  [[nodiscard]] std::size_t control_size(AgentId) const override { return controls_; }
  [[nodiscard]] std::size_t output_size(AgentId) const override { return layout_.size(); }
  [[nodiscard]] Vector initial_state(AgentId i) const override { return initial_.at(index_of(i)); }
  void output(AgentId i, Seconds, const Whole& whole, std::span<double> y) const override {
    const std::span<const double> x = whole.x.subspan(index_of(i) * layout_.size(), layout_.size());
    std::copy(x.begin(), x.end(), y.begin());
  }

  void advance(Seconds t, const Input& input, std::span<double> x) const override {
    const std::size_t n = layout_.size();
    const double h = dt_ / static_cast<double>(substeps_);
    for (std::size_t i = 0; i < initial_.size(); ++i) {
      if (input.active[i] == 0) continue;
      const Eigen::Map<const Vector> u(input.control.data() + i * controls_, static_cast<Eigen::Index>(controls_));
      const Eigen::Map<const Vector> d(input.disturbance.data() + i * n, static_cast<Eigen::Index>(n));
      Eigen::Map<Vector> state(x.data() + i * n, static_cast<Eigen::Index>(n));
      const auto slope = [&](double at, const Vector& value) -> Vector { return derivative(agent_at(i), at, value, u) + d; };
      for (Eigen::Index s = 0; s < substeps_; ++s) {
        const double at = t + static_cast<double>(s) * h;
        const Vector k1 = slope(at, state);
        const Vector k2 = slope(at + 0.5 * h, state + 0.5 * h * k1);
        const Vector k3 = slope(at + 0.5 * h, state + 0.5 * h * k2);
        const Vector k4 = slope(at + h, state + h * k3);
        state += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
      }
    }
  }

  /// To first order in the step: W h.
  [[nodiscard]] Matrix increment_covariance(AgentId, const Matrix& intensity) const override { return dt_ * intensity; }

 protected:
  /// f_i(t, x_i, u_i), n x 1.
  [[nodiscard]] virtual Vector derivative(AgentId agent, Seconds t, const Vector& x, const Vector& u) const = 0;

 private:
  std::vector<Vector> initial_;
  Layout layout_;
  std::size_t controls_;
  Seconds dt_;
  Eigen::Index substeps_;
};

}  // namespace consort
