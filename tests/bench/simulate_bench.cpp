// simulate() beside bare Eigen loops that do the same arithmetic without agents, links, mailboxes, hashes or reports.

#include "rounds/simulate.hpp"
#include "tests/support/seeds_data.hpp"

#include <benchmark/benchmark.h>

namespace consort {
namespace {

using namespace seeds;
using Array = Eigen::ArrayXd;

constexpr double kVariance = 0.1;  // Q = Omega

Experiment kalman(std::size_t n, TopologySpec topology, Round rounds) {
  Experiment e = scalar_experiment("kalman_consensus", linspace(5.0, 7.0, n), linspace(0.8, 1.2, n), std::move(topology), rounds);
  e.protocols[0].parameters.set("Q", kVariance);
  e.protocols[0].parameters.set("Omega", kVariance);
  e.report_every.reset();  // the default number of reports
  return e;
}

Experiment voting_ring(std::size_t n, std::size_t dimension, Round rounds) {
  Experiment e = scalar_experiment("local_voting", linspace(0.0, 1.0, n), linspace(1.0, 1.0, n),
                                   always(std::make_shared<const Graph>(ring(n))), rounds);
  e.initial = {{"x", {PerAgent::Linspace{0.0, 1.0, dimension}}}};
  e.dt = 0.25;
  e.report_every.reset();
  return e;
}

void run(benchmark::State& state, const Experiment& e) {
  for (auto _ : state) {
    const Trace trace = simulate(e, e.protocols[0], e.seed);
    benchmark::DoNotOptimize(trace.hash);
  }
  state.counters["rounds_per_second"] = benchmark::Counter(static_cast<double>(state.iterations()) * e.rounds, benchmark::Counter::kIsRate);
}

template <class Loop>
void run_bare(benchmark::State& state, Round rounds, Loop&& loop) {
  for (auto _ : state) loop(rounds);
  state.counters["rounds_per_second"] = benchmark::Counter(static_cast<double>(state.iterations()) * rounds, benchmark::Counter::kIsRate);
}

/// Kalman consensus where everybody hears one partner.
void bare_pairs(benchmark::State& state, std::size_t n, Round rounds) {
  std::vector<std::vector<int>> partners;
  Minstd random(11);
  for (int m = 0; m < 64; ++m) {
    std::vector<int> order(n), partner(n);
    for (std::size_t i = 0; i < n; ++i) order[i] = static_cast<int>(i);
    for (std::size_t k = n - 1; k >= 1; --k)
      std::swap(order[k], order[static_cast<std::size_t>(random.uniform() * static_cast<double>(k + 1))]);
    for (std::size_t i = 0; i < n; i += 2) {
      partner[static_cast<std::size_t>(order[i])] = order[i + 1];
      partner[static_cast<std::size_t>(order[i + 1])] = order[i];
    }
    partners.push_back(partner);
  }
  const auto size = static_cast<Eigen::Index>(n);
  run_bare(state, rounds, [&](Round count) {
    Array x = Array::LinSpaced(size, 5.0, 7.0), P = Array::LinSpaced(size, 0.8, 1.2), gain(size), next(size), heard(size);
    for (Round k = 0; k < count; ++k) {
      const std::vector<int>& j = partners[k / 4 % partners.size()];
      gain = (P(j) + kVariance).inverse();
      heard = x(j);
      P = ((P + kVariance).inverse() + gain).inverse();
      next = x + P * gain * (heard - x);
      x.swap(next);
    }
    benchmark::DoNotOptimize(x.data());
  });
}

/// Kalman consensus where everybody hears everybody; like the agents, every receiver does its own arithmetic on every message.
void bare_complete(benchmark::State& state, std::size_t n, Round rounds) {
  const auto size = static_cast<Eigen::Index>(n);
  run_bare(state, rounds, [&](Round count) {
    const Eigen::ArrayXXd g = Eigen::ArrayXXd::Ones(size, size) - Matrix::Identity(size, size).array();
    Array x = Array::LinSpaced(size, 5.0, 7.0), P = Array::LinSpaced(size, 0.8, 1.2), x_next(size), P_next(size), gain(size);
    for (Round k = 0; k < count; ++k) {
      for (Eigen::Index i = 0; i < size; ++i) {
        gain = g.col(i) / (P + kVariance);
        P_next[i] = 1.0 / (1.0 / (P[i] + kVariance) + gain.sum());
        x_next[i] = x[i] + P_next[i] * (gain * (x - x[i])).sum();
      }
      x.swap(x_next);
      P.swap(P_next);
    }
    benchmark::DoNotOptimize(x.data());
  });
}

/// The same result with the reciprocals shared among the receivers and two matrix-vector products: what no set of agents can do.
void bare_complete_shared(benchmark::State& state, std::size_t n, Round rounds) {
  const auto size = static_cast<Eigen::Index>(n);
  run_bare(state, rounds, [&](Round count) {
    const Matrix g = Matrix::Ones(size, size) - Matrix::Identity(size, size);
    Vector x = Vector::LinSpaced(size, 5.0, 7.0), P = Vector::LinSpaced(size, 0.8, 1.2);
    Vector gain(size), gain_x(size), sum(size), sum_x(size);
    for (Round k = 0; k < count; ++k) {
      gain = (P.array() + kVariance).inverse();
      gain_x = gain.cwiseProduct(x);
      sum.noalias() = g * gain;
      sum_x.noalias() = g * gain_x;
      P = ((P.array() + kVariance).inverse() + sum.array()).inverse();
      x.array() += P.array() * (sum_x.array() - sum.array() * x.array());
    }
    benchmark::DoNotOptimize(x.data());
  });
}

/// Local voting on an undirected ring, one column of states per agent.
void bare_ring(benchmark::State& state, std::size_t n, std::size_t dimension, Round rounds) {
  const auto agents = static_cast<Eigen::Index>(n), rows = static_cast<Eigen::Index>(dimension);
  run_bare(state, rounds, [&](Round count) {
    Matrix x = Vector::LinSpaced(agents, 0.0, 1.0).transpose().replicate(rows, 1), next(rows, agents);
    for (Round k = 0; k < count; ++k) {
      for (Eigen::Index i = 0; i < agents; ++i) {
        const Eigen::Index left = i == 0 ? agents - 1 : i - 1, right = i == agents - 1 ? 0 : i + 1;
        next.col(i).noalias() = x.col(i) + 0.25 * (x.col(left) - x.col(i)) + 0.25 * (x.col(right) - x.col(i));
      }
      x.swap(next);
    }
    benchmark::DoNotOptimize(x.data());
  });
}

void add_all() {
  const auto complete_100 = std::make_shared<const Graph>(complete(100));
  constexpr auto kUnit = benchmark::kMillisecond;
  benchmark::RegisterBenchmark("Simulate/kalman_pairs_10", [](benchmark::State& s) {
    run(s, kalman(10, RandomPairs{1, 8}, 100'000));
  })->Unit(kUnit);
  benchmark::RegisterBenchmark("Bare/kalman_pairs_10", [](benchmark::State& s) { bare_pairs(s, 10, 100'000); })->Unit(kUnit);
  benchmark::RegisterBenchmark("Simulate/kalman_complete_100", [=](benchmark::State& s) {
    run(s, kalman(100, always(complete_100), 2'000));
  })->Unit(kUnit);
  benchmark::RegisterBenchmark("Bare/kalman_complete_100", [](benchmark::State& s) { bare_complete(s, 100, 20'000); })->Unit(kUnit);
  benchmark::RegisterBenchmark("BareShared/kalman_complete_100", [](benchmark::State& s) {
    bare_complete_shared(s, 100, 20'000);
  })->Unit(kUnit);
  benchmark::RegisterBenchmark("Simulate/voting_ring_100x8", [](benchmark::State& s) { run(s, voting_ring(100, 8, 10'000)); })->Unit(kUnit);
  benchmark::RegisterBenchmark("Bare/voting_ring_100x8", [](benchmark::State& s) { bare_ring(s, 100, 8, 10'000); })->Unit(kUnit);
}

}  // namespace
}  // namespace consort

int main(int argc, char** argv) {
  consort::add_all();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
