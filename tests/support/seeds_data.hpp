#pragma once
/// The publications' numerical examples as data: who starts with what, who hears whom, and which numbers must come out.
/// "given" = printed in the publication; "fixture" = a fixed case of our own where the publication leaves parameters open.

#include "core/experiment.hpp"

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace consort::seeds {

/// Park and Miller's minimal standard generator: s <- 16807 s mod (2^31 - 1), u = s / (2^31 - 1).
class Minstd {
 public:
  explicit Minstd(std::uint64_t seed) : state_(seed) {}
  double uniform() {
    state_ = state_ * 16807 % kModulus;
    return static_cast<double>(state_) / static_cast<double>(kModulus);
  }

 private:
  static constexpr std::uint64_t kModulus = 2147483647;
  std::uint64_t state_;
};

/// n numbers from `first` to `last`, evenly.
inline std::vector<double> linspace(double first, double last, std::size_t n) {
  std::vector<double> values(n);
  for (std::size_t i = 0; i < n; ++i) values[i] = first + (last - first) * static_cast<double>(i) / static_cast<double>(n - 1);
  return values;
}

inline PerAgent per_agent(const std::vector<double>& values) {
  PerAgent::List list;
  for (const double value : values) list.values.push_back(Matrix::Constant(1, 1, value));
  return {list};
}

inline std::shared_ptr<const Graph> graph_of(std::size_t agents, const std::vector<std::pair<unsigned, unsigned>>& sender_receiver) {
  std::vector<Edge> edges;
  for (const auto& [from, to] : sender_receiver) edges.push_back({AgentId{from}, AgentId{to}});
  return std::make_shared<const Graph>(agents, std::span<const Edge>(edges));
}

inline FixedSchedule always(std::shared_ptr<const Graph> graph) { return {{{std::move(graph), 1}}, false}; }

/// Scalar states x and covariances P, one protocol without parameters, ideal links.
inline Experiment scalar_experiment(std::string protocol, const std::vector<double>& x, const std::vector<double>& P, TopologySpec topology,
                                    Round rounds) {
  Experiment e;
  e.name = "fixture";
  e.mode = Mode::simulate;
  e.agents = x.size();
  e.rounds = rounds;
  e.report_every = 1;
  e.protocols = {{std::move(protocol), {}}};
  e.initial = {{"x", per_agent(x)}, {"P", per_agent(P)}};
  e.topology = std::move(topology);
  return e;
}

// --- Ren, Beard, Kingston 2005, II-C: meet for dinner ---------------------------------------------------------------------
namespace dinner {
inline constexpr std::size_t kAgents = 10;
inline constexpr Round kRounds = 300;
inline constexpr double kQ = 0.1, kOmega = 0.1;
inline constexpr double kLeaderP = 0.001;  // agent 10
inline const std::array<unsigned, 10> kFirstPartners{5, 9, 10, 7, 1, 8, 4, 6, 2, 3};

inline std::vector<double> x() { return linspace(5.0, 7.0, kAgents); }
inline std::vector<double> P(bool leader) {
  auto values = linspace(0.8, 1.2, kAgents);
  if (leader) values.back() = kLeaderP;
  return values;
}

/// Fixture: perfect matchings from MINSTD seed 11 (Fisher-Yates, neighbouring entries pair up), each kept for 1 + int(8u) rounds.
inline FixedSchedule matchings() {
  Minstd random(11);
  FixedSchedule schedule;
  for (Round rounds = 0; rounds < kRounds;) {
    std::array<unsigned, kAgents> order{};
    for (unsigned i = 0; i < kAgents; ++i) order[i] = i + 1;
    for (unsigned k = kAgents - 1; k >= 1; --k) std::swap(order[k], order[static_cast<unsigned>(random.uniform() * (k + 1))]);
    std::vector<std::pair<unsigned, unsigned>> edges;
    for (unsigned i = 0; i < kAgents; i += 2) {
      edges.emplace_back(order[i], order[i + 1]);
      edges.emplace_back(order[i + 1], order[i]);
    }
    const Round dwell = 1 + static_cast<Round>(8 * random.uniform());
    schedule.intervals.push_back({graph_of(kAgents, edges), dwell});
    rounds += dwell;
  }
  return schedule;
}

inline Experiment experiment(bool leader, bool self_term) {
  Experiment e = scalar_experiment("kalman_consensus", x(), P(leader), matchings(), kRounds);
  e.protocols[0].parameters.set("Q", kQ);
  e.protocols[0].parameters.set("Omega", kOmega);
  e.protocols[0].parameters.set("self_term", self_term ? 1.0 : 0.0);
  return e;
}

/// Fixture results, noise-free.
struct Expected {
  bool self_term, leader;
  double x_limit, P_limit;
  Round rounds_to_spread_below_1e_3;
};
inline constexpr Expected kEqual{false, false, 5.937286, 0.1, 57};
inline constexpr Expected kLeader{true, true, 6.102881, 0.05, 66};
/// Fixture, noise of covariance 0.1 on every link and on the self term, leader, 300 runs: mean and standard deviation over the runs
/// of the agents' final mean; mean of the final standard deviation among the agents.
inline constexpr double kNoise = 0.1, kNoisyMean = 6.103, kNoisyStd = 0.844, kNoisyAmongAgents = 0.33;
inline constexpr int kNoisyRuns = 300;
}  // namespace dinner

// --- Alighanbari, How 2006, Fig. 1 ----------------------------------------------------------------------------------------
namespace fig1 {
inline std::vector<double> x() { return {4, 5, 6}; }
inline std::vector<double> P() { return {1, 1, 1}; }
/// The one strongly connected graph with out-degrees 2, 1, 1 that gives the figure's numbers.
inline std::shared_ptr<const Graph> graph() { return graph_of(3, {{1, 2}, {1, 3}, {2, 3}, {3, 1}}); }
inline constexpr double kKalmanLimit = 4.894558;  // given: 4.89
inline constexpr double kUnbiased = 5.0;          // given
inline constexpr double kSelfTermLimit = 5.0562;  // (8) to the letter, with j = i in the sum
/// Kalman consensus after rounds 1..4.
inline const std::array<std::array<double, 3>, 4> kKalmanIterates{
    {{5, 4.5, 5}, {5, 4.75, 4.857143}, {4.916667, 4.888889, 4.875}, {4.892857, 4.904762, 4.891892}}};
inline const std::array<double, 3> kInformationLimits{1.2, 0.6, 1.2};
}  // namespace fig1

// --- Alighanbari, How 2006, Table I ---------------------------------------------------------------------------------------
namespace table1 {
inline constexpr std::size_t kAgents = 10;
inline constexpr double kLeaderP = 0.01;  // printed 0.001, which no draw can fit
inline std::vector<double> x() { return linspace(5.0, 7.0, kAgents); }
/// Fixture B: covariances that give the table's centralised values.
inline std::vector<double> P(bool leader) {
  std::vector<double> values{1.014458, 1.198471, 1.097039, 1.130915, 0.88784, 1.119624, 1.116574, 1.050972, 0.880113, 0.854735};
  if (leader) values.back() = kLeaderP;
  return values;
}
inline std::vector<std::pair<unsigned, unsigned>> ring_edges() {
  return {{7, 1}, {1, 4}, {4, 2}, {2, 10}, {10, 9}, {9, 5}, {5, 6}, {6, 3}, {3, 8}, {8, 7}};
}
inline const std::array<std::pair<unsigned, unsigned>, 4> kExtraLinks{{{4, 1}, {2, 4}, {2, 5}, {1, 7}}};
inline std::shared_ptr<const Graph> ring() { return graph_of(kAgents, ring_edges()); }  // cases 1, 2: balanced
inline std::shared_ptr<const Graph> unbalanced() {                                      // cases 3 to 6
  auto edges = ring_edges();
  edges.insert(edges.end(), kExtraLinks.begin(), kExtraLinks.end());
  return graph_of(kAgents, edges);
}
/// Ring plus extra link k mod 4 in round k.
inline FixedSchedule time_varying() {
  FixedSchedule schedule;
  schedule.periodic = true;
  for (const auto& link : kExtraLinks) {
    auto edges = ring_edges();
    edges.push_back(link);
    schedule.intervals.push_back({graph_of(kAgents, edges), 1});
  }
  return schedule;
}

inline constexpr double kCentralised = 6.042808, kCentralisedLeader = 6.913738;
inline constexpr double kCentralisedLeaderAsPrinted = 6.990710;  // with P = 0.001
inline constexpr double kLeastWithPrintedLeader = 6.97775;       // whatever x in [5, 7] and P in [0.8, 1.2]
inline constexpr double kKalmanCase3 = 5.641648, kKalmanCase4 = 6.238940;
inline constexpr double kKalmanTimeVarying = 5.983108;
/// Omega = 0.01 in the gains, no noise: mean of the agents after 400 rounds (the spread is still 0.1 and 0.4 then).
inline constexpr double kUnbiasedOmegaCase5 = 5.9067, kUnbiasedOmegaCase6 = 6.1895;

/// Cases 5 and 6: noise of covariance 0.01 in the messages; mean and standard deviation over 300 runs of the agents' final mean.
struct Noisy {
  const char* protocol;
  bool leader;
  double Omega;
  Round rounds;
  double mean, deviation;
};
inline constexpr double kNoise = 0.01;
inline constexpr int kNoisyRuns = 300;
inline constexpr std::array<Noisy, 8> kNoisy{{{"kalman_consensus", false, 0.0, 25, 5.646, 0.114},
                                              {"unbiased_kalman_consensus", false, 0.0, 25, 6.048, 0.081},
                                              {"kalman_consensus", true, 0.0, 25, 6.236, 0.105},
                                              {"unbiased_kalman_consensus", true, 0.0, 25, 6.922, 0.124},
                                              {"kalman_consensus", false, 0.01, 100, 5.634, 0.055},
                                              {"unbiased_kalman_consensus", false, 0.01, 100, 5.909, 0.054},
                                              {"kalman_consensus", true, 0.01, 100, 5.928, 0.050},
                                              {"unbiased_kalman_consensus", true, 0.01, 100, 6.242, 0.047}}};
}  // namespace table1

}  // namespace consort::seeds
