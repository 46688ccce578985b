#pragma once
/// What the protocols share by which agents observe one plant together: what an agent knows of the plant and of its sensor, the filters'
/// state, and estimates that come late.

#include "core/counted.hpp"
#include "core/math/discretise.hpp"
#include "models/registry.hpp"
#include "protocols/filters/estimator_network.hpp"
#include "protocols/parameters.hpp"

#include <string>

namespace consort {

/// x' = A x, y_i = C_i x, as agent i knows it.
struct ObservedPlant {
  Matrix A;     ///< n x n
  Matrix C;     ///< p x n; 0 x n if the agent measures nothing
  Matrix step;  ///< exp(A dt)
};

/// Throws ConfigError if the plant tells its agents no A, or an agent measures something else than y = C x.
inline ObservedPlant observed_plant(std::string_view who, const Setup& setup) {
  const std::string place = "protocol " + std::string(who) + ": agent " + std::to_string(setup.self.value);
  const Matrix* A = setup.model.find("A");
  if (A == nullptr)
    throw ConfigError(place + " is not told how the plant moves; allowed: a plant with matrices A and C, " + shared_plants());
  const Matrix* C = setup.model.find("C");
  const std::size_t outputs = C == nullptr ? 0 : static_cast<std::size_t>(C->rows());
  if (outputs != setup.measurement_size)
    throw ConfigError(place + " measures " + counted(setup.measurement_size, "number") + ", but its C has " + counted(outputs, "row") +
                      "; allowed: y = C x and nothing else");
  return {*A, C == nullptr ? Matrix(0, A->cols()) : *C, matrix_exponential(*A, setup.dt)};
}

/// The initial x (n x 1), zero if none is given. Throws ConfigError on another length.
inline Vector initial_estimate(std::string_view who, const Setup& setup, Eigen::Index n) {
  if (!setup.initial.has("x")) return Vector::Zero(n);
  Vector x = setup.initial.vector("x");
  if (x.size() != n)
    throw ConfigError("protocol " + std::string(who) + ": agent " + std::to_string(setup.self.value) + ": found an initial x of length " +
                      std::to_string(x.size()) + "; allowed: the length of the plant's state, " + std::to_string(n));
  return x;
}

/// Of what a filter is made.
struct FilterParams {
  ObservedPlant plant;
  Matrix Q;  ///< process noise, n x n
  Sensor sensor;
};
inline constexpr std::array kFilterParameters{
    ValueDoc{"Q", "covariance n x n (scalar, diagonal or matrix)", "", "intensity of the plant's process noise, unit of x^2 per s"},
    ValueDoc{"R", "covariance p x p (scalar, diagonal or matrix)", "",
             "intensity of the agent's measurement noise, > 0; not for agents "
             "without a sensor"}};
inline constexpr std::array kFilterInitial{
    ValueDoc{"x", "vector n", "0", "estimate at the start"},
    ValueDoc{"P", "covariance n x n (scalar, diagonal or matrix)", "1", "covariance P_i(0) of that estimate"}};
inline constexpr std::array kFilterEstimate{ValueDoc{"x", "vector n", "", "estimate of the plant's state"},
                                            ValueDoc{"P", "covariance n x n", "", "its covariance P_i (unit of x squared)"}};

/// Throws ConfigError.
inline FilterParams filter_params(std::string_view who, const Values& values, const Setup& setup) {
  ObservedPlant plant = observed_plant(who, setup);
  const Eigen::Index p = plant.C.rows();
  const Matrix Q = values.covariance("Q", plant.A.rows());
  const Sensor own = sensor(plant.C, p == 0 ? Matrix(0, 0) : values.covariance("R", p, {}, true));
  return {std::move(plant), Q, own};
}

/// Estimate x (n x 1) and, below it, its covariance P (n x n, column after column).
class FilterState {
 public:
  FilterState(const Vector& x, const Matrix& P) : x_P_(x.size() + P.size()), n_(x.size()) {
    this->x() = x;
    this->covariance() = P;
  }
  [[nodiscard]] Eigen::Map<const Vector> x() const { return {x_P_.data(), n_}; }
  [[nodiscard]] Eigen::Map<Vector> x() { return {x_P_.data(), n_}; }
  [[nodiscard]] Eigen::Map<const Matrix> covariance() const { return {x_P_.data() + n_, n_, n_}; }
  [[nodiscard]] Eigen::Map<Matrix> covariance() { return {x_P_.data() + n_, n_, n_}; }
  [[nodiscard]] const Vector& both() const { return x_P_; }
  [[nodiscard]] std::vector<Field> fields() const {
    const auto n = static_cast<std::size_t>(n_);
    return {{"x", n, 1}, {"P", n, n}};
  }

 private:
  Vector x_P_;
  Eigen::Index n_;
};

/// Throws ConfigError.
inline FilterState initial_filter_state(std::string_view who, const FilterParams& p, const Setup& setup) {
  const Eigen::Index n = p.plant.A.rows();
  return {initial_estimate(who, setup, n), setup.initial.covariance("P", n, 1.0)};
}

/// C'R^-1 y of this round (n x 1).
inline Vector sensed(const Sensor& sensor, const Sense& sense) { return sensor.to_u * measured(sense); }

/// What an estimate x of round `sent` says of round `now`: moved on with the plant.
inline Vector brought_forward(const Matrix& step, Vector x, Round sent, Round now) {
  for (; sent < now; ++sent) x = step * x;
  return x;
}

}  // namespace consort
