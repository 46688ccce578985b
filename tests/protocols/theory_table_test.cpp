#include "orchestrator/script/script.hpp"
#include "protocols/registry.hpp"
#include "protocols/theory.hpp"
#include "tests/support/tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>

namespace consort {
namespace {

std::vector<Finding> findings_of(const std::string& text, Effort effort = Effort::of_validate()) {
  return examine(parse_experiment("experiment: t\nrounds: 100\n" + text + "\n", "t.yaml", "."), effort);
}

bool warns(const Finding& finding) { return finding.verdict == Rating::fails || finding.verdict == Rating::refused; }

// --- whom findings speak of -----------------------------------------------------------------------------------------------

/// Its words, so that "Kalman consensus" is kalman_consensus.
std::string in_words(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) { return c == '_' ? ' ' : static_cast<char>(std::tolower(c)); });
  return text;
}

std::string without(std::string text, const std::string& word) {
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word)) text.erase(at, word.size());
  return text;
}

void expect_that_only_its_own_protocols_are_spoken_of(const Experiment& experiment) {
  const std::vector<Finding> findings = examine(experiment);
  for (const Finding& finding : findings) {
    std::string text = in_words(finding.condition + "\n" + finding.evidence + "\n" + finding.consequence);
    bool of_its_own = false;
    for (const ProtocolChoice& choice : experiment.protocols) {
      of_its_own = of_its_own || finding.condition.starts_with(choice.name + ": ");
      text = without(text, in_words(choice.name));
    }
    text = without(text, "acyclic sensing graph");  // what two protocols draw, not the one of that name
    for (const ProtocolEntry& entry : protocol_table())
      EXPECT_EQ(text.find(in_words(std::string(entry.name))), std::string::npos) << entry.name << " in: " << text;
    EXPECT_TRUE(of_its_own || !(warns(finding) || finding.verdict == Rating::holds))
        << "a verdict on no protocol of the file: " << finding.condition;
  }
  for (const ProtocolChoice& choice : experiment.protocols) {
    const auto about = [&](const Finding& finding) {
      return finding.condition.starts_with(choice.name + ": ") && finding.verdict != Rating::note;
    };
    EXPECT_TRUE(std::any_of(findings.begin(), findings.end(), about)) << "nothing is said about " << choice.name;
  }
}

TEST(TheoryTable, SpeaksInEveryShippedExperimentOfItsProtocolsOnly) {
  for (const auto& file : std::filesystem::directory_iterator(std::filesystem::path(kSourceDir) / "experiments")) {
    if (file.path().extension() != ".yaml") continue;
    SCOPED_TRACE(file.path().stem().string());
    expect_that_only_its_own_protocols_are_spoken_of(load_experiment(file.path()));
  }
}

TEST(TheoryTable, WarnsInTheShippedExperimentsOfTheConditionsThatAreTheirSubjectAndOfNoOther) {
  const std::string listeners = "kalman_consensus: in every round all agents have the same number of listeners";
  const std::string loss = "unbiased_kalman_consensus: no loss";
  const std::set<std::pair<std::string, std::string>> expected{
      {"beam_link_failure",
       "sensor_network_observer: the graph has a spanning tree, and all sensing agents are its leaders (Assumption 10)"},
      {"burst_loss", loss},
      {"mdkc_loss", loss},
      {"crash_and_rejoin", listeners},
      {"kalman_bias", listeners},
      {"table1_case3", listeners},
      {"table1_case4", listeners},
      {"table1_case5", listeners},
      {"table1_case6", listeners},
      {"switching_unbiased", listeners}};
  std::set<std::pair<std::string, std::string>> found;
  for (const auto& file : std::filesystem::directory_iterator(std::filesystem::path(kSourceDir) / "experiments")) {
    if (file.path().extension() != ".yaml") continue;
    for (const Finding& finding : examine(load_experiment(file.path()), Effort::of_run())) {
      if (warns(finding)) found.insert({file.path().stem().string(), finding.condition});
      EXPECT_NE(finding.verdict, Rating::left_out) << file.path().stem() << ": " << finding.condition;
    }
  }
  EXPECT_EQ(found, expected);
}

// --- one sound experiment per protocol, and what breaks each of its conditions --------------------------------------------

struct Violation {
  std::string condition;  ///< begins so, after the protocol's name
  std::string was, is;    ///< what of the sound experiment is written otherwise
};
struct Sound {
  std::string protocol, text;
  std::vector<Violation> violations;
};

const std::string kLossless = "links: {}", kLossy = "links: {loss: 0.2}", kCertain = "links: {loss: 1}",
                  kNoisy = "links: {noise_covariance: 0.1}";
const std::string kRing = "topology: ring", kChain = "topology: {edges: [1 -> 2 -> 3]}", kApart = "topology: {edges: [1 <-> 2]}";
const std::string kTail = "\ntopology: ring\nlinks: {}";
const std::string kDouble =
    "plant: {model: {name: integrator, order: 2}, initial: {position: {linspace: [-1, 1]}, velocity: 0}}\ndt: 0.001";
const std::string kSingle = "plant: {model: integrator, sensing: neighbours}\ndt: 0.01";
/// An oscillator of which agents 1 and 3 see one component, and agent 2 the other.
const std::string kOscillator =
    "plant: {model: {name: shared_linear, A: [[0, 1], [-1, 0]], C: [[1, 0]]}, overrides: {2: {parameters: {C: [[0, 1]]}}}}\ndt: 0.01";
const std::string kHalfBlind =
    "plant: {model: {name: shared_linear, A: [[0, 1], [-1, 0]], C: [[0, 0]]}, overrides: {2: {parameters: {C: [[0, 1]]}}}}\ndt: 0.01";
const std::string kBlind =
    "plant: {model: {name: shared_linear, A: [[0, 1], [-1, 0]], C: [[0, 0]]}, overrides: {2: {parameters: {C: [[0, 0]]}}}}\ndt: 0.01";
const std::string kOwn = "plant: {model: {name: linear, A: [[0, 1], [-1, 0]], C: [[1, 0]]}}\ndt: 0.01";
const std::string kCoupled = "plant: {model: {name: linear, A: [[0.3]]}}\ndt: 0.01";

std::string agents(const std::string& protocol, const std::string& more = "") {
  return "agents: {count: 3, protocol: {name: " + protocol + "}" + more + "}\n";
}

std::vector<Sound> sound_experiments() {
  const std::string x = ", initial: {x: [1, 2, 6], P: 1}";
  const std::vector<Violation> strong{{"strongly connected in every round", kRing, kChain}, {"no loss", kLossless, kLossy}};
  const Violation led{"a leader", "{edges: [1 -> 2, 1 -> 3]}", "ring"};
  std::vector<Sound> all{
      {"local_voting",
       agents("local_voting", ", initial: {x: [1, 2, 6]}") + "dt: 0.1" + kTail,
       {{"the union of the graphs", kRing, kApart},
        {"all eigenvalues of I - dt L", "dt: 0.1", "dt: 0.7"},
        {"dt times the largest in-degree", "dt: 0.1\ntopology: ring",
         "dt: 0.6\ntopology: {intervals: [{rounds: 3, topology: ring}, {rounds: 3, topology: path}]}"}}},
      {"kalman_consensus",
       agents("kalman_consensus", x) + "dt: 1" + kTail,
       {{"the union of the graphs", kRing, kApart},
        {"in every round all agents have the same number of listeners", kRing, "topology: path"}}},
      {"continuous_kalman_consensus",
       agents("continuous_kalman_consensus", x) + "dt: 0.1" + kTail,
       {{"the union of the graphs", kRing, kApart}, {"the integration steps are short", "dt: 0.1", "dt: 10"}}},
      {"unbiased_kalman_consensus", agents("unbiased_kalman_consensus, Omega: 0", x) + "dt: 1" + kTail, strong},
      {"unbiased_information_consensus", agents("unbiased_information_consensus", x) + "dt: 1" + kTail, strong},
      {"robust_information_consensus",
       agents("robust_information_consensus", x) + "dt: 1" + kTail,
       {{"strongly connected, without switching where links lose", kRing, kChain}, {"every loss is below 1", kLossless, kCertain}}},
      {"static_consensus",
       agents("static_consensus, c: 1") + kDouble + kTail,
       {{"a spanning tree in every round", kRing, kApart},
        {"all agents have the same A and B",
         "plant: {model: {name: integrator, order: 2}, initial: {position: {linspace: [-1, 1]}, velocity: 0}}",
         "plant: {model: {name: linear, A: [[0]], B: [[1]]}, overrides: {2: {parameters: {A: [[-1]]}}}}"},
        {"c >= 1 / (2 min Re lambda)", "c: 1", "c: 0.1"},
        {"dt is short enough for the control it holds", "dt: 0.001", "dt: 2"}}},
      {"minimum_energy_consensus",
       agents("minimum_energy_consensus", ", initial: {x: 0}") + kSingle + kTail,
       {{"all agents are single integrators", "model: integrator", "model: {name: linear, A: [[-1]], B: [[1]]}"},
        {"agents measure their in-neighbours", "sensing: neighbours", "sensing: own"},
        {"strongly connected in every round", kRing, kChain},
        {"dt is short enough for Euler's rule", "dt: 0.01", "dt: 10"}}},
      {"measured_consensus",
       agents("measured_consensus", ", initial: {x: 0}") + kSingle + kTail,
       {{"all agents are single integrators", "model: integrator", "model: {name: linear, A: [[-1]], B: [[1]]}"},
        {"agents measure their in-neighbours", "sensing: neighbours", "sensing: own"},
        {"a spanning tree in every round", kRing, kApart},
        {"dt is short enough for the control it holds", "dt: 0.01", "dt: 1"}}},
      {"adaptive_consensus",
       agents("adaptive_consensus, reference: halving") + kDouble + kTail,
       {{"strongly connected, or a leader", kRing, kApart},
        {"dt < 2 / (c lambda_max(K B) lambda_max(L))", "reference: halving}}", "reference: halving}, initial: {c: 1000}}"},
        {"undirected, for the estimation of eigenvalues", "halving}}\n" + kDouble + "\ntopology: ring",
         "eigenvalue, xi: 10}, initial: {r: {linspace: [-1, 1]}, q: {linspace: [1, -1]}}}\n" + kDouble + "\ntopology: directed_ring"}}},
      {"li_edge_consensus",
       agents("li_edge_consensus") + kDouble + kTail,
       {{"undirected and connected", kRing, "topology: directed_ring"}, {"no noise", kLossless, kNoisy}}},
      {"li_agent_consensus",
       agents("li_agent_consensus") + kDouble + "\ntopology: {edges: [1 -> 2, 1 -> 3]}\nlinks: {}",
       {led, {"dt < 2 / (c lambda_max(K B) lambda_max(L))", "dt: 0.001", "dt: 2"}}},
      {"su_consensus",
       agents("su_consensus") + kDouble + "\ntopology: {edges: [1 -> 2, 1 -> 3]}\nlinks: {}",
       {{"undirected among the followers, and a leader", led.was, led.is}, {"no noise", kLossless, kNoisy}}},
      {"yu_consensus",
       agents("yu_consensus") + kDouble + "\ntopology: {edges: [1 -> 2, 1 -> 3]}\nlinks: {}",
       {{"undirected among the followers, and connected or led", led.was, "{edges: [1 -> 2 -> 3 -> 1]}"}, {"no noise", kLossless, kNoisy}}},
      {"das_neural_consensus",
       agents("das_neural_consensus") + "plant: {model: sine_drift}\ndt: 0.001" + kTail,
       {{"strongly connected, or a leader", kRing, kApart}, {"dt < 2 / (c lambda_max(L))", "dt: 0.001", "dt: 0.1"}}},
      {"kalman_bucy",
       agents("kalman_bucy, Q: 1, R: 1") + kOscillator + kTail,
       {{"all agents observe one plant", kOscillator, kOwn},
        {"(A, C) is detectable, C of all agents together", kOscillator, kBlind},
        {"(A, C) is detectable for every agent i with the measurements of i and its in-neighbours", kOscillator + "\n" + kRing,
         kHalfBlind + "\n" + kApart}}},
      {"distributed_observer",
       agents("distributed_observer, F: 2, mu: 3") + kCoupled + kTail,
       {{"strongly connected communication", kRing, kChain},
        {"dynamics and sensing couplings have a common topological order", "A: [[0.3]]}}",
         "A: [[0.3]]}, couplings: [{edge: 1 -> 2, A: [[1]]}, {edge: 2 -> 1, A: [[1]]}]}"},
        {"every (A_ii, C_ii) is observable", "A: [[0.3]]}", "A: [[0.3]], C: [[0]]}"},
        {"every A_ii - F_i C_ii is stable", "F: 2", "F: 0.1"},
        {"mu > max Re lambda", "mu: 3", "mu: 0.01"},
        {"the whole error E' = R E is stable", "F: 2", "F: 0.1"},
        {"dt is short enough", "dt: 0.01", "dt: 10"}}},
      {"sensor_network_observer",
       agents("sensor_network_observer") + kOscillator + kTail,
       {{"one linear plant that all agents share", kOscillator, kOwn},
        {"some agent sees every state group", kOscillator, kBlind},
        {"the graph has a spanning tree", kRing, kApart}}},
  };
  const auto filter = [&](const std::string& name, const std::string& parameters, std::vector<Violation> more) {
    std::vector<Violation> violations{{"all agents observe one plant", kOscillator, kOwn},
                                      {"(A, C) is detectable, C of all agents together", kOscillator, kBlind}};
    violations.insert(violations.end(), more.begin(), more.end());
    all.push_back({name, agents(name + ", " + parameters) + kOscillator + kTail, violations});
  };
  const Violation torn{"connected (Assumptions 1, 3)", kRing, kApart},
      one_way{"undirected (Assumptions 1, 3)", kRing, "topology: directed_ring"};
  const Violation step{"dt is short enough", "dt: 0.01", "dt: 3"}, noise{"no noise", kLossless, kNoisy};
  const Violation seen{"(A, C) is detectable for every agent i", "C: [[1, 0]]", "C: [[0, 0]]"};
  filter("dkf_olfati_saber", "Q: 1, R: 1, gamma: 1", {torn, one_way, seen, step});
  filter("dkf_iterative", "Q: 0.1, R: 1, epsilon: 0.1", {torn, one_way, {"epsilon d_i |M_i| <= 1", "epsilon: 0.1", "epsilon: 50"}});
  filter("dkf_kim", "Q: 1, R: 1, gamma: 1, k: 1", {torn, one_way, step});
  filter("dlo_kim", "gamma: 8", {torn, one_way, noise, step});
  filter("dlo_zhang", "c: 5", {noise, step, {"a path leads from those who see", kOscillator + "\n" + kRing, kHalfBlind + "\n" + kApart}});
  const std::string vehicles =
      "plant: {model: {name: integrator, dimension: 2}, sensing: {relative: {1: [2], 3: [2]}, absolute: [2]}}\ndt: 0.01";
  const Violation mute{"sensing edges are communication edges", kRing, kApart};
  const Violation weak{"strongly connected communication", kRing, "topology: {edges: [1 <-> 2, 2 -> 3]}"};
  all.push_back({"acyclic_sensing",
                 agents("acyclic_sensing") + vehicles + kTail,
                 {mute, weak, {"ids are unique", "name: acyclic_sensing}", "name: acyclic_sensing, id: 7}"}}});
  all.push_back(
      {"cooperative_localization",
       agents("cooperative_localization, F: -1") + vehicles + kTail,
       {mute, weak, {"ids are unique", "F: -1", "F: -1, id: 7"}, {"an absolute position is within reach", "1: [2], 3: [2]", "1: [2]"}}});
  return all;
}

TEST(TheoryTable, HasASoundExperimentOfEveryProtocol) {
  std::set<std::string_view> sound, all;
  const auto experiments = sound_experiments();
  for (const Sound& experiment : experiments) sound.insert(experiment.protocol);
  for (const ProtocolEntry& entry : protocol_table()) all.insert(entry.name);
  EXPECT_EQ(sound, all);
}

TEST(TheoryTable, FindsNothingWrongWithASoundExperimentAndSpeaksOfItsProtocolOnly) {
  for (const Sound& experiment : sound_experiments()) {
    SCOPED_TRACE(experiment.protocol);
    for (const Finding& finding : findings_of(experiment.text))
      EXPECT_FALSE(warns(finding)) << finding.condition << ": " << finding.evidence;
    expect_that_only_its_own_protocols_are_spoken_of(
        parse_experiment("experiment: t\nrounds: 100\n" + experiment.text + "\n", "t.yaml", "."));
  }
}

TEST(TheoryTable, WarnsOfEveryConditionThatIsViolated) {
  for (const Sound& experiment : sound_experiments())
    for (const auto& [condition, was, is] : experiment.violations) {
      SCOPED_TRACE(experiment.protocol + ": " + condition);
      std::string text = experiment.text;
      const std::size_t at = text.find(was);
      ASSERT_NE(at, std::string::npos) << was;
      text.replace(at, was.size(), is);
      std::vector<Finding> findings;
      EXPECT_NO_THROW(findings = findings_of(text)) << text;
      EXPECT_TRUE(std::any_of(findings.begin(), findings.end(),
                              [&, begins = experiment.protocol + ": " + condition](const Finding& finding) {
                                return warns(finding) && finding.condition.starts_with(begins);
                              }))
          << text;
    }
}

// --- what it may cost -----------------------------------------------------------------------------------------------------

TEST(TheoryTable, LeavesOutWhatCostsMoreThanIsAllowedAndSaysSo) {
  for (const Sound& experiment : sound_experiments()) {
    SCOPED_TRACE(experiment.protocol);
    for (const Finding& finding : findings_of(experiment.text, Effort(0.0, 1e9)))
      EXPECT_TRUE(finding.verdict != Rating::left_out || !finding.evidence.empty()) << finding.condition;
  }
  const std::string large = agents("local_voting", ", initial: {x: 1}");
  const auto none = findings_of(large + kRing, Effort(1e9, 1.0));
  ASSERT_EQ(none.size(), 1U);
  EXPECT_EQ(none[0].verdict, Rating::left_out);
}

std::string voting(int agents, const std::string& dt, const std::string& topology) {
  return "agents: {count: " + std::to_string(agents) + ", protocol: local_voting, initial: {x: 1}}\ndt: " + dt + "\ntopology: " + topology;
}

/// What is said of the eigenvalues of local voting where a run cannot afford them.
Finding voting_at_start(const std::string& text) {
  for (const Finding& finding : findings_of(text, Effort::of_run()))
    if (finding.condition.starts_with("local_voting: all eigenvalues")) return finding;
  return {};
}

TEST(TheoryTable, JudgesTheStepOfLargeNetworksByBoundsOfTheEigenvalues) {
  // Ring: the largest eigenvalue is 4, and Gershgorin's circles reach no farther.
  EXPECT_EQ(voting_at_start(voting(1000, "0.4", "ring")).verdict, Rating::holds);
  const Finding ring = voting_at_start(voting(1000, "0.6", "ring"));
  EXPECT_EQ(ring.verdict, Rating::fails);
  EXPECT_NE(ring.evidence.find("at least 3."), std::string::npos) << ring.evidence;
  // Complete: all eigenvalues but one are 700, as their mean says; the circles reach 1398.
  EXPECT_EQ(voting_at_start(voting(700, "0.003", "complete")).verdict, Rating::fails);
  EXPECT_EQ(voting_at_start(voting(700, "0.0014", "complete")).verdict, Rating::holds);
  EXPECT_EQ(voting_at_start(voting(700, "0.002", "complete")).verdict, Rating::left_out);
  // Directed ring: stable up to dt = 1 exactly, which no bound knows from above.
  EXPECT_EQ(voting_at_start(voting(1000, "1.5", "directed_ring")).verdict, Rating::left_out);
  EXPECT_EQ(voting_at_start(voting(1000, "2.5", "directed_ring")).verdict, Rating::fails);
}

}  // namespace
}  // namespace consort
