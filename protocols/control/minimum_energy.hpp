#pragma once
/// Minimum-energy consensus (Zamani, Shames, Ugrinovskii 2014) as mathematics: the gain of one agent, and what follows for a whole network.
/// Equation numbers are that paper's; L here is diag(d) - adjacency, the negative of its (1).

#include "core/network/graph.hpp"
#include "core/values.hpp"

#include <span>
#include <vector>

namespace consort {

/// One agent's tuning.
struct MinimumEnergyWeights {
  double R = 1.0, G = 1.0, S = 2.0, B = 1.0;
  bool stationary = true;  ///< Q_i is (18), not the solution of (17)

  /// Q_i* of (18) for (weighted) in-degree d.
  [[nodiscard]] double stationary_gain(double d) const;
  /// Q_i after h seconds of (17) with d held, from Q_i = Q > 0: exact.
  [[nodiscard]] double gain_after(Seconds h, double Q, double d) const;
};

/// From the protocol's parameters. Throws ConfigError on a value that is not allowed.
MinimumEnergyWeights minimum_energy_weights(const Values& parameters);

/// The disturbance-free network [x; e]' = F [x; e], e_i = xhat_i - x_i (23), every agent with its stationary gain.
struct MinimumEnergyNetwork {
  Matrix F;        ///< 2N x 2N, 1/s
  Vector left;     ///< left null vector of F, its first N entries summing to 1: left' [x(0); e(0)] = x* (24)
  Vector gains;    ///< Q_i*, s
  Vector degrees;  ///< d_i

  /// [x; e] minus the point of agreement that it tends to without disturbances.
  [[nodiscard]] Vector deviation(const Vector& state) const;
};

/// `weights` by agent. The graph needs a spanning tree (ContractViolation otherwise).
MinimumEnergyNetwork minimum_energy_network(const Graph& graph, std::span<const MinimumEnergyWeights> weights);

/// (25) for the distance to the point of agreement (the letter, for [x; e] itself, is not true: F has an eigenvalue 0):
/// |deviation(t)| <= b |deviation(0)| e^(-a t).
struct Decay {
  double a = 0.0;  ///< 1/s; 0.999 of the slowest mode's rate, so that a b exists even if that mode is defective
  double b = 0.0;
};
/// Takes some hundred products of 2N x 2N matrices.
Decay decay_of(const MinimumEnergyNetwork& network);

/// phi_max (29): bounds what disturbances push [x; e] by, 1/s. `measurement` bounds every measurement error D eps, `state` every B_i
/// delta_i. The publication forgets that delta_i moves e_i = xhat_i - x_i as well as x_i, (27); its own number is this one minus N * state.
double disturbance_bound(const MinimumEnergyNetwork& network, std::span<const MinimumEnergyWeights> weights, double measurement,
                         double state);

}  // namespace consort
