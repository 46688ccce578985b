#pragma once
/// The fully distributed observer as a whole: what its error does, and the gains that agents choose alone.
///
/// Source: Huang, Jiang, Zhao, Cheng, Wu 2025, "Fully Distributed State Estimation for Multi-agent Systems and its Application in
/// Cooperative Localization", (6)-(19). Agent i keeps an estimate hat_j^(i) of every agent j and a second one of itself, bar_i:
///
///     hat_j^(i)' = A_jj hat_j^(i) + B_jj u_j + sum_l A_jl hat_l^(i) + mu [ sum_l w_il^(j) (hat_j^(l) - hat_j^(i))
///                                                                          + w_i0^(i) (bar_i - hat_i^(i)) if j = i ]     (6a), (6b)
///     bar_i'     = A_ii bar_i + B_ii u_i + sum_l A_il hat_l^(i) + F_i [ y_i - C_ii bar_i - sum_l C_il hat_l^(i) ]             (6c)
///
/// Corrected misprints: in (9) the lower left block is +mu O^(j), not -O^(j); in Q^(jl) it is agent j's own estimate that couples (b_j, not
/// b_l); (13) takes moduli where real parts decide.

#include "core/network/graph.hpp"

#include <map>
#include <optional>
#include <vector>

namespace consort {

/// How an agent weighs what it hears of agent j. The graph counts bar_j as one more sender, which agent j alone hears.
enum class ConsensusWeights {
  binary,     ///< 1
  in_degree,  ///< (11): 1 / the number of those the receiver hears, bar_j among them
  out_degree  ///< (12): 1 / the number of those that hear the sender; 1 for bar_j
};

/// w_il^(j) of an edge with weight `edge` (1 unless the topology says otherwise). `heard`: |N_i| in the graph with bar_j;
/// `listeners`: |S_l|.
double consensus_weight(ConsensusWeights rule, double edge, std::size_t heard, std::size_t listeners);

/// S^(j) of (7), m x m: the Laplacian of the graph with bar_j, without the row and the column of bar_j.
Matrix consensus_matrix(const Graph& communication, AgentId j, ConsensusWeights rule);

/// The error dynamics' consensus eigenvalues: lambda_q(S^(j)) over all q and all j of `agents`.
struct ConsensusSpectrum {
  double smallest_modulus = 0.0;
  double smallest_real = 0.0;
};
ConsensusSpectrum consensus_spectrum(const Graph& communication, ConsensusWeights rule);

/// How the correction of one round is carried over it.
enum class SampledScheme {
  first_order,  ///< as it stands at the beginning of the round; stable however large mu is
  second_order  ///< growing as it did in the round before (ETD2); for mu h of the order of 1 at most
};

/// The weights of what drives an estimate, N, and of its growth since the round before, if N relaxes the estimate at `rate`
/// (1/s): h phi_1(-rate h) and h phi_2(-rate h).
struct Relaxation {
  Seconds now = 0.0, growth = 0.0;
};
Relaxation relaxation(double rate, Seconds h);

/// The numbers of groups of those that are coupled, directly or through others, by agent.
std::vector<std::size_t> coupled_groups(std::size_t agents, const std::vector<Edge>& couplings);

/// One agent of (1)-(2) and the gain it has chosen.
struct ObservedAgent {
  Matrix A, B, C, F;                      ///< n x n, n x m, p x n, n x p; no rows in C: nothing measured
  std::map<AgentId, Matrix> A_from = {};  ///< A_il (n x n_l)
  std::map<AgentId, Matrix> C_from = {};  ///< C_il (p x n_l)
};
struct ObservedSystem {
  std::vector<ObservedAgent> agents;
  Graph communication;
  ConsensusWeights weights = ConsensusWeights::binary;
  double mu = 1.0;
  SampledScheme scheme = SampledScheme::first_order;

  // Errors are estimate - truth, stacked: hat^(1), ..., hat^(m), bar_1, ..., bar_m, each hat^(i) agent after agent.
  [[nodiscard]] Eigen::Index error_size() const;
  [[nodiscard]] Eigen::Index at_hat(AgentId i, AgentId j) const;  ///< where hat_j^(i) begins
  [[nodiscard]] Eigen::Index at_bar(AgentId i) const;
  [[nodiscard]] Eigen::Index states() const;  ///< sum of n_j
};

/// R of (10) in the order of the errors above: E' = R E with the inputs known to everybody.
Matrix error_matrix(const ObservedSystem& system);

/// What one round of the sampled scheme does to E: with the data of one moment, every estimate is corrected (bar_i by h F_i, hat_j^(i) by
/// (1 - e^(-mu d h)) / d of its weighted differences, d the sum of the weights), then everything moves by the exact model over h.
/// Second order: twice the size, for [E; what N of one round is compared with in the next].
Matrix sampled_error_matrix(const ObservedSystem& system, Seconds h);

/// What unknown inputs do to E if everybody knows its own alone (18): E' = R E + D u, D = -B_jj wherever i != j.
Matrix unknown_input_matrix(const ObservedSystem& system);

/// (19): |exp(R t)| <= kappa exp(-eta t), eta being 0.9 of the slowest mode's rate and kappa the smallest for it (on a grid of 1000 times).
struct ErrorDecay {
  double eta = 0.0;  ///< 1/s
  double kappa = 0.0;
};
/// Nothing if R is not stable.
std::optional<ErrorDecay> error_decay(const Matrix& R);
/// What (19) promises at last: kappa |B| ubar / eta.
double ultimate_bound(const ErrorDecay& decay, double input_norm, double ubar);

// Bounds of the smallest |lambda(S^(j))|, and the mu that follows for an agreed maximum of m agents.
/// (14), undirected graph with binary weights: (lambda_2 / (lambda_2 + 1))^(m - 1) / m.
double undirected_consensus_bound(const Graph& communication);
/// (16), directed, strongly connected, normalised weights: 1 - (1 - 1 / (m + 1)!)^(1 / m).
double directed_consensus_bound(std::size_t m);
/// (15): rho ((m^2 - m + 4) / 4)^(m - 1) m, which mu must exceed.
double undirected_gain(std::size_t m, double rho);
/// (17): rho / directed_consensus_bound(m), which mu must exceed.
double directed_gain(std::size_t m, double rho);
/// The smallest whole number above `bound`.
double smallest_whole_above(double bound);

}  // namespace consort
