#include "protocols/everybody/observer_design.hpp"

#include "core/errors.hpp"
#include "core/math/schur.hpp"
#include "core/math/shapes.hpp"

#include <cmath>

namespace consort {
namespace {

// A vector of n numbers from one number or n.
Vector numbers(const Values& values, std::string_view name, Eigen::Index n, const std::string& who) {
  const Matrix* given = values.find(name);
  if (given == nullptr) return Vector::Zero(n);
  if (given->size() == 1) return Vector::Constant(n, (*given)(0, 0));
  if (given->cols() == 1 && given->rows() == n) return given->col(0);
  throw ConfigError(who + ": " + std::string(name) + " is " + shape_of(*given) + "; allowed: one number, or one per input, " +
                    std::to_string(n));
}

}  // namespace

InputLaw input_law(const Values& values, Eigen::Index m, const std::string& who) {
  return {numbers(values, "input_amplitude", m, who), numbers(values, "input_phase", m, who), values.scalar("input_frequency", 1.0)};
}

bool inputs_known(const Values& parameters) { return parameters.scalar("inputs", 0.0) == 0.0; }

ConsensusWeights consensus_weights(const Values& parameters) {
  return static_cast<ConsensusWeights>(static_cast<int>(parameters.scalar("weights", 0.0)));
}

SampledScheme sampled_scheme(const Values& parameters) {
  return static_cast<SampledScheme>(static_cast<int>(parameters.scalar("scheme", 0.0)));
}

double coupling_gain(const Values& parameters, std::size_t agents, const Matrix& A, const std::string& who) {
  const double rule = parameters.scalar("mu_rule", 0.0);
  double mu = parameters.scalar("mu", 1.0);
  if (rule != 0.0) {
    if (parameters.has("mu")) throw ConfigError(who + ": found mu and a mu_rule that computes it; allowed: one of them");
    const double rho = parameters.scalar("rho", spectral_radius(A));
    mu = smallest_whole_above(rule == 1.0 ? undirected_gain(agents, rho) : directed_gain(agents, rho));
  } else if (parameters.has("rho")) {
    throw ConfigError(who + ": found rho with mu as given; allowed: rho with mu_rule undirected or directed");
  }
  if (!(mu > 0.0 && std::isfinite(mu))) throw ConfigError(who + ": mu is " + text_of(mu) + "; allowed: above 0");
  return mu;
}

Matrix observer_gain(const Values& parameters, Eigen::Index n, Eigen::Index p, const std::string& who) {
  const Matrix* given = parameters.find("F");
  if (given == nullptr) throw ConfigError(who + ": parameter 'F' is missing; allowed: the gain of the agent's own measurements");
  if (given->rows() == n && given->cols() == p) return *given;
  if (n == p && given->size() == 1) return (*given)(0, 0) * Matrix::Identity(n, n);
  if (n == p && given->cols() == 1 && given->rows() == n) return given->col(0).asDiagonal();
  throw ConfigError(who + ": F is " + shape_of(*given) + "; allowed: " + std::to_string(n) + " x " + std::to_string(p) +
                    (n == p ? ", its diagonal, or one number" : ""));
}

}  // namespace consort
