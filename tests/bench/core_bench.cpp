/// What the core costs: one Philox draw, one message through a mailbox, one segment of a random schedule, one Riccati equation. Items
/// per second are draws, messages, segments, equations.

#include "core/math/riccati.hpp"
#include "core/network/mailbox.hpp"
#include "core/network/schedule.hpp"

#include <benchmark/benchmark.h>

namespace consort {
namespace {

constexpr std::size_t kAgents = 100;
constexpr std::size_t kNumbers = 8;

void keyed_uniform(benchmark::State& state) {
  constexpr Purpose kPurpose{"bench"};
  std::uint64_t round = 0;
  for (auto _ : state) benchmark::DoNotOptimize(Seed{1}.stream(kPurpose, 1, 2, round++).uniform());
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(keyed_uniform);

void streamed_normal(benchmark::State& state) {
  Stream stream = Seed{1}.stream(Purpose{"bench"});
  for (auto _ : state) benchmark::DoNotOptimize(stream.normal());
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(streamed_normal);

LinkSpec link_of(const benchmark::State& state) {
  LinkSpec spec;
  if (state.range(0) == 1) spec.loss_probability = 0.1;
  if (state.range(0) == 2) spec.noise_covariance = Matrix::Constant(1, 1, 0.1);
  if (state.range(0) == 3) spec.delay_rounds = 2;
  return spec;
}

/// All mailboxes of a complete graph of 100 agents; `turn(box, k, in-neighbours, numbers)` closes one round of one of them.
template <class Turn>
void turn_mailboxes(benchmark::State& state, const Turn& turn) {
  const Graph graph = complete(kAgents);
  const Layout layout{{{"x", kNumbers, 1}}, 0, kNumbers};
  const std::vector<double> numbers(kAgents * kNumbers, 1.0);
  std::vector<Mailbox> boxes;
  for (std::size_t i = 0; i < kAgents; ++i) {
    std::vector<AgentId> senders;
    for (const Neighbour& neighbour : graph.in_neighbours(agent_at(i))) senders.push_back(neighbour.id);
    boxes.emplace_back(agent_at(i), std::move(senders), layout, LinkModel{link_of(state), {}}, Seed{1}, Round{8});
  }
  Round k = 0;
  for (auto _ : state) {
    for (std::size_t i = 0; i < kAgents; ++i) {
      const Inbox inbox = turn(boxes[i], k, graph.in_neighbours(agent_at(i)), std::span<const double>(numbers));
      benchmark::DoNotOptimize(inbox.data());
    }
    ++k;
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(graph.edge_count()));
  state.SetLabel(std::array{"ideal", "lossy", "noisy", "delayed"}[static_cast<std::size_t>(state.range(0))]);
}

void mailbox_post_and_take(benchmark::State& state) {
  turn_mailboxes(state, [](Mailbox& box, Round k, std::span<const Neighbour> in_neighbours, std::span<const double> numbers) {
    for (const Neighbour& neighbour : in_neighbours)
      box.post(neighbour.id, k, numbers.subspan(index_of(neighbour.id) * kNumbers, kNumbers));
    return box.take(k, in_neighbours);
  });
}
BENCHMARK(mailbox_post_and_take)->DenseRange(0, 3);

void mailbox_take_from(benchmark::State& state) {
  turn_mailboxes(state, [](Mailbox& box, Round k, std::span<const Neighbour> in_neighbours, std::span<const double> numbers) {
    return box.take_from(k, in_neighbours, [numbers](std::size_t i) { return numbers.subspan(i * kNumbers, kNumbers); });
  });
}
BENCHMARK(mailbox_take_from)->DenseRange(0, 3);

void random_pairs_segment(benchmark::State& state) {
  const Schedule schedule(static_cast<std::size_t>(state.range(0)), RandomPairs{1, 8}, {}, Seed{1});
  Round k = 0;
  for (auto _ : state) {
    const auto segment = schedule.segment(k);
    benchmark::DoNotOptimize(segment.graph.get());
    k = segment.last + 1;
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(random_pairs_segment)->Arg(10)->Arg(100)->Arg(1000);

void random_links_round(benchmark::State& state) {
  const Schedule schedule(10, RandomLinks{std::make_shared<const Graph>(complete(10)), 0.5}, {}, Seed{1});
  Round k = 0;
  for (auto _ : state) benchmark::DoNotOptimize(schedule.at(k++).get());
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(random_links_round);

/// A chain of n integrators with one input.
void riccati(benchmark::State& state) {
  const Eigen::Index n = state.range(0);
  Matrix A = Matrix::Zero(n, n);
  A.diagonal(1).setOnes();
  const Matrix B = Matrix::Identity(n, n).rightCols(1), Q = Matrix::Identity(n, n), R = Matrix::Identity(1, 1);
  for (auto _ : state) benchmark::DoNotOptimize(continuous_riccati(A, B, Q, R).residual);
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(riccati)->Arg(2)->Arg(20);

}  // namespace
}  // namespace consort

BENCHMARK_MAIN();
