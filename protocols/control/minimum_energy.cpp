#include "protocols/control/minimum_energy.hpp"

#include "core/math/decompositions.hpp"
#include "core/math/discretise.hpp"
#include "core/math/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace consort {

double MinimumEnergyWeights::stationary_gain(double d) const {
  // Q_i* = B_i (1 / R + d_i / S)^(-1/2)                                                                                  (18)
  return B / std::sqrt(1.0 / R + d / S);
}

double MinimumEnergyWeights::gain_after(Seconds h, double Q, double d) const {
  // Q' = B^2 - r Q^2 from Q: Q* (Q + Q* tanh(r Q* h)) / (Q* + Q tanh(r Q* h)), Q* = B r^(-1/2)                           (17)
  const double r = 1.0 / R + d / S, limit = stationary_gain(d), grown = std::tanh(r * limit * h);
  return limit * (Q + limit * grown) / (limit + Q * grown);
}

MinimumEnergyWeights minimum_energy_weights(const Values& parameters) {
  const auto positive = [&](const char* name, double fallback) {
    const double value = parameters.scalar(name, fallback);
    if (!(value > 0.0) || !std::isfinite(value))
      throw ConfigError("protocol minimum_energy_consensus: " + std::string(name) + " is " + text_of(value) + "; allowed: above 0");
    return value;
  };
  MinimumEnergyWeights weights;
  weights.R = positive("R", 1.0);
  weights.G = positive("G", 1.0);
  weights.S = positive("S", weights.R + weights.G);
  weights.B = positive("B", 1.0);
  if (weights.S < weights.G)
    throw ConfigError("protocol minimum_energy_consensus: S is " + text_of(weights.S) + "; allowed: at least G, " + text_of(weights.G));
  const double gain = parameters.scalar("gain", 0.0);
  if (gain != 0.0 && gain != 1.0)
    throw ConfigError("protocol minimum_energy_consensus: gain is " + text_of(gain) + "; allowed: stationary (0) or riccati (1)");
  weights.stationary = gain == 0.0;
  return weights;
}

Vector MinimumEnergyNetwork::deviation(const Vector& state) const {
  Vector out = state;
  out.head(gains.size()).array() -= left.dot(state);
  return out;
}

MinimumEnergyNetwork minimum_energy_network(const Graph& graph, std::span<const MinimumEnergyWeights> weights) {
  const auto n = static_cast<Eigen::Index>(graph.agents());
  check(weights.size() == graph.agents(), "minimum_energy_network is given the weights of every agent");
  const Matrix L = laplacian(graph);
  MinimumEnergyNetwork network{Matrix::Zero(2 * n, 2 * n), Vector(2 * n), Vector(n), L.diagonal()};
  // x' = -(G/S) (L x + Delta e),   e' = -Q* [ (L x) / S + (1 / R + Delta / S) e ]                                        (23)
  // left = [ (S/G) (1 + R d / S) omega ; -R d / Q* omega ] up to scale, omega' L = 0                                     (24)
  const Vector omega = left_null_vector(graph);
  for (Eigen::Index i = 0; i < n; ++i) {
    const MinimumEnergyWeights& w = weights[static_cast<std::size_t>(i)];
    const double d = network.degrees[i], Q = w.stationary_gain(d);
    network.gains[i] = Q;
    network.F.row(i).head(n) = -(w.G / w.S) * L.row(i);
    network.F(i, n + i) = -(w.G / w.S) * d;
    network.F.row(n + i).head(n) = -(Q / w.S) * L.row(i);
    network.F(n + i, n + i) = -Q * (1.0 / w.R + d / w.S);
    network.left[i] = (w.S / w.G) * (1.0 + w.R * d / w.S) * omega[i];
    network.left[n + i] = -w.R * d / Q * omega[i];
  }
  network.left /= network.left.head(n).sum();
  return network;
}

Decay decay_of(const MinimumEnergyNetwork& network) {
  constexpr int kSamples = 1000;
  constexpr double kTimeConstants = 10.0;
  const Eigen::Index size = network.F.rows(), n = size / 2;
  // Eigenvalues on the space of deviations: without the one that is zero.
  const Eigen::VectorXcd spectrum = eigenvalues(network.F, "F (23)");
  Eigen::Index zero = 0;
  spectrum.cwiseAbs().minCoeff(&zero);
  double slowest = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < size; ++i)
    if (i != zero) slowest = std::min(slowest, -spectrum[i].real());
  Decay decay{0.999 * slowest, 0.0};
  // b = sup over t of |e^(F t) (I - [1; 0] left')| e^(a t), in the spectral norm, on a grid
  Matrix rest = Matrix::Identity(size, size);
  rest.topRows(n).rowwise() -= network.left.transpose();
  const double h = kTimeConstants / decay.a / kSamples;
  const Matrix step = matrix_exponential(network.F, h) * std::exp(decay.a * h);
  for (int k = 0; k <= kSamples; ++k) {
    decay.b = std::max(decay.b, spectral_norm(rest));
    rest = step * rest;
  }
  return decay;
}

double disturbance_bound(const MinimumEnergyNetwork& network, std::span<const MinimumEnergyWeights> weights, double measurement,
                         double state) {
  // eps sum_i N_i / S + delta sum_i B_i (in x and again in e) + Q_max [ N eps / R + eps / S sum_i N_i ]                   (29)
  double on_x = 0.0, on_e = 0.0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const MinimumEnergyWeights& w = weights[i];
    const double d = network.degrees[static_cast<Eigen::Index>(i)];
    on_x += measurement * d * w.G / w.S + state;
    on_e += network.gains.maxCoeff() * (measurement / w.R + measurement * d / w.S) + state;
  }
  return on_x + on_e;
}

}  // namespace consort
