#pragma once
/// How the values of an experiment become an agent's design of the distributed observer: gains, weights, the law of its input.

#include "core/values.hpp"
#include "protocols/everybody/observed_system.hpp"

#include <string>

namespace consort {

/// u(t) = amplitude sin(frequency t + phase), component by component: an input that follows a law everybody can be told.
struct InputLaw {
  Vector amplitude, phase;  // m
  double frequency = 1.0;   // rad/s
  [[nodiscard]] Vector at(Seconds t) const { return (amplitude.array() * (frequency * t + phase.array()).sin()).matrix(); }
  [[nodiscard]] bool zero() const { return amplitude.isZero(0.0); }
};

// In all of these `who` begins the text of a ConfigError.
/// From input_amplitude, input_frequency, input_phase: one number or one per input, m of them.
InputLaw input_law(const Values& values, Eigen::Index m, const std::string& who);
/// From inputs: everybody's inputs enter the estimates, not the agent's own alone.
bool inputs_known(const Values& parameters);
/// From weights.
ConsensusWeights consensus_weights(const Values& parameters);
/// From scheme.
SampledScheme sampled_scheme(const Values& parameters);
/// From mu, or mu_rule and rho (default: the spectral radius of the agent's own A) for `agents` agents at most.
double coupling_gain(const Values& parameters, std::size_t agents, const Matrix& A, const std::string& who);
/// F (n x p) as a matrix or, for n = p, its diagonal or one number.
Matrix observer_gain(const Values& parameters, Eigen::Index n, Eigen::Index p, const std::string& who);

}  // namespace consort
