// Experiments whose whole outcome is on file. CONSORT_REWRITE_GOLDEN=1 writes the files anew; read the difference before keeping it.

#include "protocols/metrics.hpp"
#include "rounds/simulate.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/seeds_data.hpp"
#include "tests/support/tree.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <sstream>

namespace consort {
namespace {

using namespace seeds;

struct Golden {
  const char* name;
  Experiment (*experiment)();
};

Experiment dinner_rough() {
  Experiment e = dinner::experiment(true, false);
  e.topology = RandomPairs{1, 8};
  e.links.standard = {0.1, 0, Matrix::Constant(1, 1, 0.1)};
  e.links.overrides[{AgentId{3}, AgentId{7}}].delay_rounds = 2;
  e.link_events = {{150, {{AgentId{1}, AgentId{2}}, {AgentId{2}, AgentId{1}}}, false}};
  return e;
}

Experiment voting_8_states() {
  Experiment e = scalar_experiment("local_voting", linspace(0, 1, 12), linspace(1, 1, 12),
                                   RandomLinks{std::make_shared<const Graph>(ring(12)), 0.6}, 200);
  e.initial = {{"x", {PerAgent::Uniform{-1.0, 1.0, 8}}}};
  e.dt = 0.25;
  return e;
}

Experiment unbiased_vectors() {
  Experiment e = scalar_experiment("unbiased_kalman_consensus", linspace(0, 1, 10), linspace(1, 1, 10), table1::time_varying(), 120);
  e.initial = {{"x", {PerAgent::Uniform{5.0, 7.0, 3}}}, {"P", {PerAgent::Uniform{0.8, 1.2, 3}}}};
  e.protocols[0].parameters.set("Q", 0.01);
  return e;
}

Experiment information_case_4() {
  return scalar_experiment("unbiased_information_consensus", table1::x(), table1::P(true), always(table1::unbalanced()), 300);
}

constexpr Golden kGolden[] = {{"dinner_rough", dinner_rough},
                              {"voting_8_states", voting_8_states},
                              {"unbiased_vectors", unbiased_vectors},
                              {"information_case_4", information_case_4}};

/// One line per number, ten significant digits: the last bits belong to one compiler.
std::string summary(const Experiment& e) {
  const Trace trace = simulate(e, e.protocols[0], e.seed);
  std::ostringstream text;
  text << std::setprecision(10);
  text << "protocol " << e.protocols[0].name << "\nagents " << e.agents << "\nseed " << e.seed.value << '\n';
  for (const auto& [name, value] : compute_metrics(e, e.seed, e.protocols[0], trace)) {
    // What is zero up to rounding differs from compiler to compiler.
    text << name << ' ' << (std::abs(value) < 1e-10 ? 0.0 : value) << '\n';
  }
  for (std::size_t report = 0; report < trace.rounds.size(); report += (trace.rounds.size() - 1) / 4) {
    text << "round " << trace.rounds[report];
    for (const double value : scalars_at(trace, report)) text << ' ' << value;
    text << '\n';
  }
  return text.str();
}

class GoldenTrace : public testing::TestWithParam<Golden> {};

TEST_P(GoldenTrace, IsTheOneOnFile) {
  const std::string path = std::string(kSourceDir) + "/tests/golden/" + GetParam().name + ".txt";
  const std::string now = summary(GetParam().experiment());
  if (std::getenv("CONSORT_REWRITE_GOLDEN") != nullptr) std::ofstream(path) << now;
  std::stringstream kept;
  kept << std::ifstream(path).rdbuf();
  EXPECT_EQ(now, kept.str()) << "if the change is meant: CONSORT_REWRITE_GOLDEN=1, then read the difference";
}

INSTANTIATE_TEST_SUITE_P(Golden, GoldenTrace, testing::ValuesIn(kGolden), [](const auto& golden) { return golden.param.name; });

}  // namespace
}  // namespace consort
