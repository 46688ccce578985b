#include "protocols/theory.hpp"

#include "core/errors.hpp"
#include "orchestrator/script/script.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

using Verdict = Rating;

#define EXPECT_SAYS(text, where) EXPECT_PRED_FORMAT2(testing::IsSubstring, text, where)

std::vector<Finding> findings(const std::string& text) {
  return examine(parse_experiment("experiment: t\nrounds: 100\n" + text + "\n", "t.yaml", "."));
}
/// The only finding whose condition begins so.
Finding only(const std::string& text, const std::string& condition) {
  std::vector<Finding> out;
  for (const auto& finding : findings(text))
    if (finding.condition.starts_with(condition)) out.push_back(finding);
  EXPECT_EQ(out.size(), 1U) << condition;
  return out.empty() ? Finding{} : out.front();
}
bool any_refused(const std::string& text) {
  for (const auto& finding : findings(text))
    if (finding.verdict == Verdict::refused) return true;
  return false;
}

struct Case {
  std::string protocol;  ///< with its parameters, as in the file
  std::string topology = "ring";
  std::string dt = "0.01";
  int sensors = 4;  ///< agents 1 to this one have theirs
};
/// The oscillator of the filters' experiments.
std::string oscillator(const Case& c) {
  const std::string R[]{"0.5", "1", "0.8", "0.2"}, C[]{"[1, 0]", "[0, 1]", "[0.7071067811865476, 0.7071067811865476]", "[1, 0]"};
  std::string text = "agents:\n  count: 4\n  protocol: {" + c.protocol + "}\n  overrides:\n";
  for (int i = 0; i < 4; ++i) text += "    " + std::to_string(i + 1) + ": {parameters: {R: " + R[i] + "}}\n";
  text += "plant:\n  model: {name: shared_linear, A: [[0, 1], [-1, 0]]}\n";
  if (c.sensors > 0) text += "  overrides:\n";
  for (int i = 0; i < c.sensors; ++i) text += "    " + std::to_string(i + 1) + ": {parameters: {C: [" + C[i] + "]}}\n";
  return text + "dt: " + c.dt + "\ntopology: " + c.topology;
}
const std::string kOlfatiSaber = "name: dkf_olfati_saber, Q: 0.1, gamma: 5", kKim = "name: dkf_kim, Q: 0.1, gamma: 5, k: 2",
                  kBucy = "name: kalman_bucy, Q: 0.1", kIterative = "name: dkf_iterative, Q: 0.01";

/// The two oscillators of the observers' experiments; `seen` gives C of agents 1, 2, ...
std::string two(const std::string& protocol, const std::string& topology, const std::vector<std::string>& seen,
                const std::string& dt = "0.01") {
  std::string text = "agents: {count: 4, protocol: {" + protocol +
                     "}}\nplant:\n  model: {name: shared_linear, A: [[0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 2], [0, 0, -2, 0]]}\n";
  if (!seen.empty()) text += "  overrides:\n";
  for (std::size_t i = 0; i < seen.size(); ++i) text += "    " + std::to_string(i + 1) + ": {parameters: {C: [" + seen[i] + "]}}\n";
  return text + "dt: " + dt + "\ntopology: " + topology;
}
const std::vector<std::string> kSeen{"[1, 0, 0, 0]", "[0, 0, 1, 0]", "[1, 0, 1, 0]"};

TEST(TheoryFilters, GivesTheLargestRealPartOfTheErrorMatrix) {
  const std::string condition = ": all eigenvalues of the whole error matrix have a negative real part";
  EXPECT_SAYS("-0.349193", only(oscillator({kOlfatiSaber}), "dkf_olfati_saber" + condition).evidence);
  EXPECT_SAYS("-0.580611", only(oscillator({kOlfatiSaber + ", aggregated: 1"}), "dkf_olfati_saber" + condition).evidence);
  EXPECT_SAYS("-0.230673", only(oscillator({kKim, "ring", "0.01", 3}), "dkf_kim" + condition).evidence);
  EXPECT_SAYS("-0.233679", only(two("name: dlo_kim, gamma: 8", "ring", kSeen), "dlo_kim" + condition).evidence);
  EXPECT_SAYS("-0.608967", only(two("name: dlo_zhang, c: 5", "directed_ring", kSeen), "dlo_zhang" + condition).evidence);
  EXPECT_SAYS("largest modulus 0.84157", only(oscillator({kIterative, "ring", "0.1"}), "dkf_iterative: all eigenvalues").evidence);
}

TEST(TheoryFilters, TheShippedSetUpsAreAccepted) {
  EXPECT_FALSE(any_refused(oscillator({kBucy, "complete"})));
  EXPECT_FALSE(any_refused(oscillator({kOlfatiSaber})));
  EXPECT_FALSE(any_refused(oscillator({kKim, "ring", "0.01", 3})));
  EXPECT_FALSE(any_refused(oscillator({kIterative, "ring", "0.1"})));
  EXPECT_FALSE(any_refused(two("name: dlo_kim, gamma: 8", "ring", kSeen)));
  EXPECT_FALSE(any_refused(two("name: dlo_zhang, c: 5", "directed_ring", kSeen)));
}

TEST(TheoryFilters, RefusesAModeThatNobodySeesAndNamesIt) {
  for (const std::string& protocol : {kBucy, kOlfatiSaber, kKim, kIterative}) {
    SCOPED_TRACE(protocol);
    const std::string name = protocol.substr(6, protocol.find(',') - 6);
    const Finding blind = only(oscillator({protocol, "ring", "0.1", 0}), name + ": (A, C) is detectable, C of all agents together");
    EXPECT_EQ(blind.verdict, Verdict::refused);
    EXPECT_SAYS("nobody sees the mode with eigenvalue", blind.evidence);
    EXPECT_EQ(only(oscillator({protocol, "ring", "0.1", 1}), name + ": (A, C) is detectable, C of all").verdict, Verdict::holds);
  }
  const Finding half = only(two("name: dlo_kim, gamma: 8", "ring", {kSeen[0]}), "dlo_kim: (A, C) is detectable");
  EXPECT_EQ(half.verdict, Verdict::refused);
  EXPECT_SAYS("2i", half.evidence);
}

TEST(TheoryFilters, RefusesANetworkThatIsNotConnectedAndNamesAnAgent) {
  for (const std::string& protocol : {kOlfatiSaber, kKim, kIterative}) {
    SCOPED_TRACE(protocol);
    const std::string condition = protocol.substr(6, protocol.find(',') - 6) + ": connected";
    const Finding torn = only(oscillator({protocol, "{edges: [1 <-> 2, 3 <-> 4]}", "0.1"}), condition);
    EXPECT_EQ(torn.verdict, Verdict::refused);
    EXPECT_SAYS("no path leads from agent 1 to agent 3", torn.evidence);
    EXPECT_SAYS("no path leads from agent 2 to agent 1",
                only(oscillator({protocol, "{edges: [1 -> 2 -> 3 -> 4]}", "0.1"}), condition).evidence);
    EXPECT_EQ(only(oscillator({protocol, "ring", "0.1"}), condition).verdict, Verdict::holds);
  }
  const Finding directed = only(oscillator({kKim, "directed_ring"}), "dkf_kim: undirected");
  EXPECT_EQ(directed.verdict, Verdict::fails) << "the theorem says nothing, the run may";
  EXPECT_SAYS("has no way back", directed.evidence);
}

TEST(TheoryFilters, ZhangAsksForAPathFromThoseWhoSeeAGroup) {
  const std::string condition = "dlo_zhang: a path leads";
  EXPECT_EQ(only(two("name: dlo_zhang, c: 5", "{edges: [1 -> 3, 2 -> 3, 1 -> 4, 2 -> 4, 1 <-> 2]}", kSeen), condition).verdict,
            Verdict::holds);
  const Finding missed = only(two("name: dlo_zhang, c: 5", "{edges: [1 -> 2 -> 4, 3 -> 2]}", kSeen), condition);
  EXPECT_EQ(missed.verdict, Verdict::refused);
  EXPECT_SAYS("no path leads to agent 1 from anybody who sees the state group {x3, x4}", missed.evidence);
}

TEST(TheoryFilters, NamesTheAgentWhoseOwnCovarianceGrows) {
  const Finding alone = only(oscillator({kOlfatiSaber, "ring", "0.01", 3}), "dkf_olfati_saber: (A, C) is detectable for every agent");
  EXPECT_EQ(alone.verdict, Verdict::fails);
  EXPECT_SAYS("agent 4", alone.evidence);
  EXPECT_EQ(
      only(oscillator({kOlfatiSaber + ", aggregated: 1", "ring", "0.01", 3}), "dkf_olfati_saber: (A, C) is detectable for every").verdict,
      Verdict::holds);
  EXPECT_SAYS("there are no stationary gains",
              only(oscillator({kOlfatiSaber, "ring", "0.01", 3}), "dkf_olfati_saber: all eigenvalues").evidence);
}

TEST(TheoryFilters, SaysWhoIsTheCentralisedFilter) {
  const std::string condition = "kalman_bucy: agents that hear everybody";
  EXPECT_EQ(only(oscillator({kBucy, "complete"}), condition).evidence, "1, 2, 3, 4");
  EXPECT_EQ(only(oscillator({kBucy, "star"}), condition).evidence, "1");
  EXPECT_EQ(only(oscillator({kBucy, "ring"}), condition).evidence, "none");
}

TEST(TheoryFilters, GivesTheLongestRound) {
  const std::string condition = "dlo_kim: dt is short enough";
  const Finding good = only(two("name: dlo_kim, gamma: 8", "ring", kSeen), condition);
  EXPECT_EQ(good.verdict, Verdict::holds);
  EXPECT_SAYS("allowed below 0.284642", good.evidence);
  EXPECT_EQ(only(two("name: dlo_kim, gamma: 8", "ring", kSeen, "0.3"), condition).verdict, Verdict::fails);
  EXPECT_SAYS("any is", only(oscillator({kBucy, "complete"}), "kalman_bucy: dt is short enough").evidence);
}

TEST(TheoryFilters, SaysWhereAGainIsTooSmallOrTooLarge) {
  const std::string stable = ": all eigenvalues of the whole error matrix";
  EXPECT_EQ(only(two("name: dlo_kim, gamma: 8", "ring", {kSeen[0], kSeen[1]}), "dlo_kim" + stable).verdict, Verdict::holds);
  const Finding large = only(oscillator({"name: dkf_iterative, Q: 0.01, epsilon: 20", "ring", "0.1"}), "dkf_iterative: epsilon d_i |M_i|");
  EXPECT_EQ(large.verdict, Verdict::fails);
  EXPECT_SAYS("3.81", large.evidence);
  EXPECT_EQ(only(oscillator({"name: dkf_iterative, Q: 0.01, epsilon: 20", "ring", "0.1"}), "dkf_iterative" + stable).verdict,
            Verdict::fails);
  EXPECT_EQ(only(oscillator({"name: dkf_iterative, Q: 0.01, epsilon: 20, bounded: 1", "ring", "0.1"}), "dkf_iterative: epsilon").verdict,
            Verdict::holds);
}

TEST(TheoryFilters, RefusesAgentsThatDoNotObserveOnePlant) {
  const std::string apart =
      "agents: {count: 4, protocol: {name: kalman_bucy, Q: 1, R: 1}}\n"
      "plant: {model: {name: linear, A: [[0]], B: [[1]], C: [[1]]}}\ndt: 0.1\ntopology: ring";
  EXPECT_EQ(only(apart, "kalman_bucy: all agents observe one plant").verdict, Verdict::refused);
  EXPECT_EQ(only(oscillator({kBucy}), "kalman_bucy: all agents observe one plant").verdict, Verdict::holds);
}

}  // namespace
}  // namespace consort
