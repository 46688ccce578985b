#include "core/errors.hpp"
#include "orchestrator/report/results.hpp"
#include "orchestrator/run/run.hpp"
#include "orchestrator/script/script.hpp"
#include "protocols/theory.hpp"
#include "rounds/simulate.hpp"
#include "tests/support/tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>

namespace consort {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> shipped() {
  std::vector<fs::path> out;
  for (const auto& entry : fs::directory_iterator(fs::path(kSourceDir) / "experiments"))
    if (entry.path().extension() == ".yaml") out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  return out;
}

// Hands every outcome to the results.
class Collecting : public RunObserver {
 public:
  explicit Collecting(Results& results) : results_(results) {}
  void launching(std::size_t, std::size_t, std::size_t) override {}
  void run_begins(const Job&, const Trace&) override {}
  void report(const Job&, const RoundReport&) override {}
  void event(const Job&, Round, const std::string&, const std::string&) override {}
  void run_ends(const JobOutcome& outcome) override { results_.add(outcome); }

 private:
  Results& results_;
};

class ShippedExperiment : public testing::TestWithParam<fs::path> {};

TEST_P(ShippedExperiment, SaysWhatItAsksWhereItIsFromAndWhatToExpect) {
  const Experiment e = load_experiment(GetParam());
  EXPECT_EQ(e.name, GetParam().stem().string());
  EXPECT_NE(e.description.substr(0, e.description.find("\n\n")).find('?'), std::string::npos) << "the header opens with the question";
  for (const char* part : {"Source: ", "Status: ", "Expected: "}) EXPECT_NE(e.description.find(part), std::string::npos) << part;
  const std::string status = e.description.substr(e.description.find("Status: ") + 8);
  constexpr std::array<std::string_view, 3> kWords{"REPRODUCED", "NOT", "FIXTURE"};
  EXPECT_TRUE(std::any_of(kWords.begin(), kWords.end(), [&](std::string_view word) { return status.starts_with(word); })) << status;
  EXPECT_FALSE(e.criteria.empty());
}

TEST_P(ShippedExperiment, MeetsItsCriteriaInSimulation) {
  const Experiment e = load_experiment(GetParam(), {.mode = Mode::simulate});
  Results results(e, {});
  Collecting observer(results);
  const SessionTimes times = run_simulated(e, {}, observer);
  const Summary summary = results.summary(times, Exit::ok, "");
  ASSERT_EQ(summary.criteria.size(), e.criteria.size());
  for (const auto& criterion : summary.criteria) EXPECT_TRUE(criterion.met) << criterion.text << ": " << criterion.value;
  for (const ProtocolResult& protocol : summary.protocols)
    for (const RunMetrics& run : protocol.per_run)
      EXPECT_FALSE(run.diverged) << protocol.name << ", from " << run.diverged->from << " to " << run.diverged->to;
}

TEST_P(ShippedExperiment, IsTheSameAfterBeingResolved) {
  const Experiment e = load_experiment(GetParam());
  EXPECT_EQ(parse_experiment(e.resolved_text, "resolved", ".").resolved_text, e.resolved_text);
}

TEST_P(ShippedExperiment, RecordsWhatItsProtocolsSay) {
  const Experiment e = load_experiment(GetParam());
  const auto names = [](std::span<const ValueDoc> docs) {
    std::vector<std::string> out;
    for (const ValueDoc& doc : docs) out.emplace_back(doc.name);
    return out;
  };
  const auto fields = [](const Layout& layout) {
    std::vector<std::string> out;
    for (const Field& field : layout.fields) out.push_back(field.name);
    return out;
  };
  for (const ProtocolChoice& choice : e.protocols) {
    const ProtocolEntry& entry = find_protocol(choice.name);
    const AgentMaker maker(e, choice, e.seed);
    const auto protocol = maker.make(AgentId{1});
    EXPECT_EQ(fields(protocol->estimate_layout()), names(entry.estimate)) << choice.name;
    std::vector<std::string> promised = names(entry.recorded);
    if (maker.largest_control() == 0) std::erase(promised, "u");  // of a plant that is not there
    EXPECT_EQ(fields(protocol->recorded_layout()), promised) << choice.name;
  }
}

// Where theory promises agreement on the centralised estimate or refuses it, the criteria above say the same numbers; here it must speak.
TEST_P(ShippedExperiment, IsExaminedByTheoryForEachOfItsProtocols) {
  const Experiment e = load_experiment(GetParam());
  const auto findings = examine(e);
  for (const auto& choice : e.protocols)
    EXPECT_TRUE(std::any_of(findings.begin(), findings.end(), [&](const Finding& f) { return f.condition.starts_with(choice.name + ":"); }))
        << choice.name;
}

INSTANTIATE_TEST_SUITE_P(Files, ShippedExperiment, testing::ValuesIn(shipped()),
                         [](const auto& file) { return file.param.stem().string(); });

TEST(ShippedExperiments, AreTheOnesPromised) {
  const std::set<std::string> promised{"meet_for_dinner",
                                       "meet_for_dinner_leader",
                                       "kalman_bias",
                                       "kalman_unbiased",
                                       "table1_case1",
                                       "table1_case2",
                                       "table1_case3",
                                       "table1_case4",
                                       "table1_case5",
                                       "table1_case6",
                                       "switching_unbiased",
                                       "local_voting_ring",
                                       "complete_100",
                                       "continuous_kalman",
                                       "local_voting",
                                       "leader_following",
                                       "static_consensus",
                                       "minimum_energy",
                                       "minimum_energy_coherence",
                                       "minimum_energy_perfect"};
  std::set<std::string> found;
  for (const auto& file : shipped()) found.insert(file.stem().string());
  for (const auto& name : promised) EXPECT_TRUE(found.contains(name)) << name;
  for (const char* name : {"adaptive_ring50_halving", "adaptive_ring50_eigenvalue", "adaptive_ring10_noise", "adaptive_ring5_join",
                           "adaptive_two_circles", "adaptive_leader", "adaptive_li_edges", "adaptive_li_directed", "adaptive_su",
                           "adaptive_yu", "neural_das", "beam", "beam_degraded_sensor", "beam_link_failure", "beam_steady_state"})
    EXPECT_TRUE(found.contains(name)) << name;
}

}  // namespace
}  // namespace consort
