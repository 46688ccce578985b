/// Random experiments, checked from outside the algorithms. CONSORT_SWARM_SEED=N runs one of them again, in every mode.

#include "tests/swarm/swarm.hpp"

#include "core/math/decompositions.hpp"
#include "orchestrator/script/script.hpp"
#include "tests/support/process_run.hpp"
#include "tests/support/same_trace.hpp"
#include "tests/support/tree.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <optional>

namespace consort {
namespace {

constexpr std::uint64_t kSimulated = 100, kProcesses = 12, kRealTime = 4;

/// What one may do about it: the file lies there, and two commands run it.
std::string replay(std::uint64_t seed, const swarm::Case& drawn) {
  const auto file = std::filesystem::temp_directory_path() / fmt::format("consort_swarm_{}.yaml", seed);
  std::ofstream(file) << drawn.yaml;
  return fmt::format("seed {}; again: CONSORT_SWARM_SEED={} {}/swarm_tests\n  or: {}/consort run {}\n{}", seed, seed, kBinDir, kBinDir,
                     file.string(), drawn.yaml);
}

/// Nothing is told of who is not there. (Of what it does not know yet, an observer that is there tells nothing either.)
bool tells_nothing(std::span<const double> numbers) { return std::all_of(numbers.begin(), numbers.end(), is_absent); }

Vector mean_of(const Trace& trace, std::size_t report, Eigen::Index size) {
  Vector sum = Vector::Zero(size);
  for (std::size_t i = 0; i < trace.agents; ++i) sum += Eigen::Map<const Vector>(trace.at(report, agent_at(i)).data(), size);
  return sum / static_cast<double>(trace.agents);
}

std::optional<std::size_t> place_of(const Layout& layout, const std::string& name) {
  std::size_t at = 0;
  for (const Field& field : layout.fields) {
    if (field.name == name) return at;
    at += field.rows * field.cols;
  }
  return std::nullopt;
}

/// Every estimate is somewhere, and every covariance is one.
void expect_sound_numbers(const Trace& trace) {
  constexpr double kFar = 1e3;
  const auto covariance = place_of(trace.estimate_layout, "P");
  for (std::size_t report = 0; report < trace.rounds.size(); ++report)
    for (std::size_t i = 0; i < trace.agents; ++i) {
      const auto numbers = trace.at(report, agent_at(i));
      if (tells_nothing(numbers)) continue;
      for (const double number : numbers)
        ASSERT_TRUE(is_absent(number) || std::abs(number) < kFar) << "agent " << i + 1 << ", round " << trace.rounds[report];
      if (!covariance) continue;
      const auto n = static_cast<Eigen::Index>(*covariance);
      const Matrix p = Eigen::Map<const Matrix>(numbers.data() + *covariance, n, n);
      ASSERT_GT(symmetric_eigenvalues(p)(0), 0.0) << "agent " << i + 1 << ", round " << trace.rounds[report];
      ASSERT_LT((p - p.transpose()).norm(), 1e-9 * p.norm());
    }
}

/// Every reported round is there, whole, and whoever should be there is.
void expect_complete(const Experiment& experiment, const Trace& trace) {
  EXPECT_EQ(trace.last_round, experiment.rounds) << "it ends with its last round";
  std::size_t report = 0;
  const Round interval = experiment.report_interval();
  for (Round k = 0; k <= experiment.rounds; ++k) {
    if (k % interval != 0 && k != experiment.rounds) continue;
    ASSERT_LT(report, trace.rounds.size());
    ASSERT_EQ(trace.rounds[report], k);
    for (std::size_t i = 0; i < trace.agents; ++i)
      ASSERT_EQ(tells_nothing(trace.at(report, agent_at(i))), !experiment.presence_of(agent_at(i)).holds(k))
          << "agent " << i + 1 << ", round " << k;
    ++report;
  }
  EXPECT_EQ(report, trace.rounds.size());
  EXPECT_EQ(trace.estimates.size(), trace.rounds.size());
  std::uint64_t delivered = 0, lost = 0;
  for (const LinkTotals& link : trace.links) {
    delivered += link.counters.delivered;
    lost += link.counters.lost;
  }
  EXPECT_EQ(delivered, trace.totals.delivered) << "the links add up";
  EXPECT_EQ(lost, trace.totals.lost);
}

/// Averages stay where they were; whatever is lossless and connected comes closer.
void expect_invariants(const swarm::Case& drawn, const Experiment& experiment, const Trace& trace) {
  expect_complete(experiment, trace);
  expect_sound_numbers(trace);
  const auto size = static_cast<Eigen::Index>(trace.dimension);
  if (drawn.conserves) {
    EXPECT_LT((mean_of(trace, trace.rounds.size() - 1, size) - mean_of(trace, 0, size)).norm(), 1e-9) << "the sum is kept";
  }
  if (drawn.agrees) {
    EXPECT_LE(deviation(trace, trace.report(trace.rounds.size() - 1)), deviation(trace, trace.report(0)) * (1.0 + 1e-9));
  }
}

void simulate_and_check(std::uint64_t seed) {
  const swarm::Case drawn = swarm::Draw(seed)();
  SCOPED_TRACE(replay(seed, drawn));
  try {
    const Experiment experiment = parse_experiment(drawn.yaml, "swarm.yaml", ".");
    const auto outcome = run_in_simulation(experiment);
    ASSERT_EQ(outcome.size(), 1u);
    expect_invariants(drawn, experiment, outcome[0].trace);
  } catch (const std::exception& failure) {
    ADD_FAILURE() << failure.what();
  }
}

/// Every third run loses packets of all kinds on the way, without any difference.
std::string packet_loss(std::uint64_t seed) {
  return seed % 3 == 0 ? fmt::format("transport: {{loss: {:.2f}}}\n", 0.01 + 0.01 * static_cast<double>(seed % 20)) : "";
}

void run_and_check(std::uint64_t seed) {
  swarm::Case drawn = swarm::Draw(seed)();
  drawn.yaml += packet_loss(seed);
  SCOPED_TRACE(replay(seed, drawn));
  try {
    const Experiment experiment = parse_experiment(drawn.yaml, "swarm.yaml", ".");
    const auto outcome = run_over_dds(experiment);
    ASSERT_EQ(outcome.size(), 1u);
    expect_invariants(drawn, experiment, outcome[0].trace);
    expect_same_traces(outcome, run_in_simulation(experiment));
  } catch (const std::exception& failure) {
    ADD_FAILURE() << failure.what();
  }
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1) << "no process is left";
}

/// On the clock nobody can say what the numbers will be, only what they may not be, and that everything sent is accounted for.
void run_in_real_time_and_check(std::uint64_t seed) {
  const swarm::Case drawn = swarm::Draw(seed)(true);
  SCOPED_TRACE(replay(seed, drawn));
  try {
    const Experiment experiment = parse_experiment(drawn.yaml, "swarm.yaml", ".");
    const auto outcome = run_over_dds(experiment);
    ASSERT_EQ(outcome.size(), 1u);
    const Trace& trace = outcome[0].trace;
    EXPECT_EQ(trace.last_round, experiment.rounds) << "it ends with its last round";
    expect_sound_numbers(trace);
    for (const auto& [edge, link] : trace.network)
      EXPECT_EQ(link.sent, link.received + link.lost + link.late) << edge.from.value << " -> " << edge.to.value;
  } catch (const std::exception& failure) {
    ADD_FAILURE() << failure.what();
  }
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1) << "no process is left";
}

/// The one seed that is asked for, if one is.
std::optional<std::uint64_t> asked_for() {
  const char* text = std::getenv("CONSORT_SWARM_SEED");
  return text ? std::optional<std::uint64_t>(std::strtoull(text, nullptr, 10)) : std::nullopt;
}

TEST(Swarm, ARandomExperimentKeepsItsInvariants) {
  if (const auto seed = asked_for()) return simulate_and_check(*seed);
  for (std::uint64_t seed = 1; seed <= kSimulated && !HasFailure(); ++seed) simulate_and_check(seed);
}

TEST(Swarm, ItsProcessesKeepThemToo) {
  if (const auto seed = asked_for()) return run_and_check(*seed);
  for (std::uint64_t seed = 1; seed <= kProcesses && !HasFailure(); ++seed) run_and_check(seed);
}

TEST(Swarm, SoDoesRealTime) {
  if (const auto seed = asked_for()) return run_in_real_time_and_check(*seed);
  for (std::uint64_t seed = 1; seed <= kRealTime && !HasFailure(); ++seed) run_in_real_time_and_check(seed);
}

}  // namespace
}  // namespace consort
