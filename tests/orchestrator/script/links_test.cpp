#include "core/errors.hpp"
#include "orchestrator/run/link_words.hpp"
#include "orchestrator/script/script.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

Edge edge(std::uint32_t from, std::uint32_t to) { return {AgentId{from}, AgentId{to}}; }

std::string text(const std::string& more, const std::string& protocol = "protocol: local_voting") {
  return "experiment: links\nrounds: 200\ndt: 0.01\nagents: {count: 5, " + protocol +
         ", initial: {x: [1, 2, 3, 4, 5]}}\ntopology: complete\n" + more + "\n";
}

/// Read, written out, and read again: nothing may change on the way.
Experiment read(const std::string& more) {
  Experiment e = parse_experiment(text(more), "e.yaml", ".");
  const Experiment again = parse_experiment(e.resolved_text, "resolved", ".");
  EXPECT_EQ(again.resolved_text, e.resolved_text);
  EXPECT_EQ(again.links.standard, e.links.standard);
  EXPECT_EQ(again.links.overrides, e.links.overrides);
  for (const Edge some : {edge(1, 2), edge(2, 1), edge(4, 5)})
    for (Round k = 0; k < 200; k += 10) EXPECT_EQ(again.links.of(some, k), e.links.of(some, k)) << k;
  return e;
}

std::string mistakes_in(const std::string& more) {
  try {
    parse_experiment(text(more), "e.yaml", ".");
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

void expect_told(const std::string& more, const std::string& wanted) {
  EXPECT_PRED_FORMAT2(testing::IsSubstring, wanted, mistakes_in(more)) << more;
}

TEST(ScriptLinks, ReadsEverythingALinkCanDo) {
  const LinkSpec link = read(R"(links:
  loss: {bernoulli: 0.1, gilbert_elliott: {p_good_to_bad: 0.02, p_bad_to_good: 0.2, loss_in_good: 0.01, loss_in_bad: 0.8}}
  delay_rounds: {uniform: [1, 4]}
  duplication: 0.05
  reordering: {probability: 0.1, later_rounds: 2}
  noise_covariance: 0.3
  quantisation: {bits: 8, range: [-10, 10]})")
                            .links.standard;
  EXPECT_EQ(link.loss_probability, 0.1);
  EXPECT_EQ(link.bursts, (BurstLoss{0.02, 0.2, 0.01, 0.8}));
  EXPECT_EQ(link.delay_rounds, 1U);
  EXPECT_EQ(link.jitter, (Jitter{Jitter::Kind::uniform, 0.0, 3.0}));
  EXPECT_EQ(link.duplication, 0.05);
  EXPECT_EQ(link.reordering, (Reordering{0.1, 2}));
  EXPECT_EQ(link.noise_covariance, Matrix(Matrix::Constant(1, 1, 0.3)));
  EXPECT_EQ(link.quantiser, (Quantiser{8, -10.0, 10.0}));
}

TEST(ScriptLinks, RoundsTimesUpToWholeRounds) {
  const auto delay = [](const std::string& value) { return read("links: {delay: " + value + "}").links.standard; };
  EXPECT_EQ(delay("5 ms").delay_rounds, 1U);
  EXPECT_EQ(delay("30 ms").delay_rounds, 3U);  // exactly three, whatever 0.03 / 0.01 is in binary
  EXPECT_EQ(delay("0.031").delay_rounds, 4U);
  EXPECT_EQ(delay("0").delay_rounds, 0U);
  EXPECT_EQ(delay("{uniform: [0, 25 ms]}").jitter, (Jitter{Jitter::Kind::uniform, 0.0, 3.0}));
  const LinkSpec exponential = delay("{exponential: {shortest: 15 ms, mean: 25 ms}}");
  EXPECT_EQ(exponential.delay_rounds, 2U);
  EXPECT_DOUBLE_EQ(exponential.jitter.mean, 2.5);
  const LinkSpec normal = delay("{normal: {mean: 20 ms, deviation: 5 ms}}");
  EXPECT_EQ(normal.jitter.kind, Jitter::Kind::normal);
  EXPECT_DOUBLE_EQ(normal.jitter.spread, 0.5);
}

TEST(ScriptLinks, ChangesOnTheWayBuildOnEachOther) {
  const LinkModel links = read(R"(links: {loss: 0.1, overrides: [{edge: 1 -> 2, delay_rounds: 3}]}
events:
  - {round: 100, set_link: {loss: 0.5}}
  - {round: 50, set_link: {edge: 2 -> 1, duplication: 0.25}}
  - {time: 1.5 s, set_link: {edges: [1 -> 2], loss: 0, delay_rounds: 0}})")
                              .links;
  EXPECT_EQ(links.of(edge(4, 5), 99).loss_probability, 0.1);
  EXPECT_EQ(links.of(edge(4, 5), 100).loss_probability, 0.5);
  EXPECT_EQ(links.of(edge(2, 1), 50).duplication, 0.25);
  EXPECT_EQ(links.of(edge(2, 1), 50).loss_probability, 0.1);
  EXPECT_EQ(links.of(edge(2, 1), 120).duplication, 0.25);  // what is set for all leaves the rest of each link alone
  EXPECT_EQ(links.of(edge(2, 1), 120).loss_probability, 0.5);
  EXPECT_EQ(links.of(edge(1, 2), 120).delay_rounds, 3U);
  EXPECT_TRUE(links.of(edge(1, 2), 150).ideal());
}

TEST(ScriptLinks, CutsAndHealsGroups) {
  const Experiment e = read(R"(events:
  - {round: 10, cut: {groups: [[1, 2], [3, 4]]}}
  - {round: 20, heal: [1 -> 3]}
  - {round: 30, heal: {groups: [[1], [3, 4]]}}
  - {round: 40, heal: all})");
  const auto graph = [&](Round k) { return e.schedule(e.seed).at(k); };
  EXPECT_EQ(graph(9)->edge_count(), 20U);
  EXPECT_EQ(graph(10)->edge_count(), 12U);
  EXPECT_TRUE(graph(10)->has(edge(5, 1)) && graph(10)->has(edge(3, 5)));  // who is in no group keeps its links
  EXPECT_TRUE(graph(10)->has(edge(1, 2)));
  EXPECT_FALSE(graph(10)->has(edge(1, 3)) || graph(10)->has(edge(4, 2)));
  EXPECT_EQ(graph(20)->edge_count(), 13U);
  EXPECT_EQ(graph(30)->edge_count(), 16U);
  EXPECT_EQ(graph(40)->edge_count(), 20U);
  EXPECT_EQ(words_of(e.link_events[0]), "groups {1, 2} | {3, 4}");
}

TEST(ScriptLinks, NamesWhatIsWrong) {
  expect_told("links: {loss: {gilbert_elliott: {p_good_to_bad: 0.1}}}", "p_bad_to_good");
  expect_told("links: {loss: {gilbert_elliott: {p_good_to_bad: 0, p_bad_to_good: 0}}}", "never changes between good and bad");
  expect_told("links: {delay: 5 ms, delay_rounds: 1}", "found both 'delay' and 'delay_rounds'");
  expect_told("links: {delay_rounds: {uniform: [4, 1]}}", "found 4 to 1 rounds; allowed: ascending");
  expect_told("links: {delay_rounds: {gamma: 1}}", "gamma");
  expect_told("links: {delay: 2 h}", "links.delay: found");
  expect_told("links: {duplication: 1.5}", "links.duplication: found");
  expect_told("links: {reordering: {later_rounds: 2}}", "probability");
  expect_told("links: {quantisation: {bits: 0, range: [0, 1]}}", "bits");
  expect_told("links: {quantisation: {bits: 8, range: [1, 0]}}", "two numbers, ascending");
  expect_told("links: {loss: {distance: {safe: 1, lost: 2}}}", "found loss by distance without a plant");
  expect_told("events: [{round: 1, cut: {groups: [[1, 2]]}}]", "two groups or more");
  expect_told("events: [{round: 1, cut: {groups: [[1, 2], [2, 3]]}}]", "a second time");
  expect_told("events: [{round: 1, cut: all}]", "events[0].cut: found");
  expect_told("events: [{round: 1, set_link: {edge: 1 -> 2}}]", "found nothing that changes");
  expect_told("events: [{round: 1, set_link: {edge: 1 -> 9, loss: 1}}]", "there is no agent 9");
  expect_told("events: [{round: 1, degrade: {agent: 1, constant: 1}}]", "found no plant");
  expect_told("events: [{round: 1}]", "allowed: exactly one of cut, heal, set_link, degrade, join, leave");
}

TEST(ScriptLinks, SweepsEveryProtocolOverTheValuesOfOneKey) {
  const Experiment e = parse_experiment(
      text("links: {delay_rounds: 1}\nsweep: {links.loss: [0, 0.25]}\nevents: [{round: 20, set_link: {edge: 1 -> 2, delay_rounds: 7}}]\n"
           "criteria: ['unbiased_kalman_consensus.loss_0.25.bias < 9', 'local_voting.loss_0.disagreement < 9']\nmetrics: [spread]",
           "protocols: [local_voting, unbiased_kalman_consensus]"),
      "e.yaml", ".");
  ASSERT_EQ(e.protocols.size(), 4U);
  EXPECT_EQ(e.protocols[1].title(), "local_voting.loss_0.25");
  EXPECT_EQ(e.sweep_key, "links.loss");
  EXPECT_EQ(e.protocols[3].variant->value, 0.25);
  EXPECT_EQ(e.protocols[2].title(), "unbiased_kalman_consensus.loss_0");
  const LinkModel& links = e.links_of(e.protocols[3]);
  EXPECT_EQ(links.standard.loss_probability, 0.25);
  EXPECT_EQ(links.of(edge(1, 2), 20).delay_rounds, 7U);
  EXPECT_EQ(links.of(edge(1, 2), 20).loss_probability, 0.25);
  EXPECT_EQ(e.metrics, (std::vector<std::string>{"spread", "bias", "disagreement"}));
  const Experiment again = parse_experiment(e.resolved_text, "resolved", ".");
  EXPECT_EQ(again.resolved_text, e.resolved_text);
  EXPECT_EQ(again.protocols.size(), 4U);
  const Experiment named = parse_experiment(
      text("sweep: {links.loss: {none: 0, bursts: {gilbert_elliott: {p_good_to_bad: 0.1, p_bad_to_good: 0.5}}}}"), "e.yaml", ".");
  EXPECT_EQ(named.protocols[1].title(), "local_voting.bursts");
  EXPECT_TRUE(named.links_of(named.protocols[1]).standard.bursts.has_value());
  EXPECT_EQ(named.protocols[0].variant->value, 0.0);
  EXPECT_FALSE(named.protocols[1].variant->value) << "several numbers";
  const Experiment delays = parse_experiment(text("sweep: {links.delay: {short: 20 ms, long: {uniform: [20 ms, 1 s]}}}"), "e.yaml", ".");
  EXPECT_EQ(delays.protocols[0].variant->value, 0.02);
}

TEST(ScriptLinks, NamesWhatIsWrongWithASweep) {
  expect_told("sweep: [1, 2]", "sweep: found a list of 2; allowed: keys of this file and their values");
  expect_told("sweep: {links.loss: [0.1]}", "two values or more");
  expect_told("sweep: {links.loss: [0.1, 1.5]}", "allowed: a number from 0 to 1");
  expect_told("sweep: {links.loss: [0.1, 0.1]}", "a second time");
  expect_told("sweep: {links.los: [0.1, 0.2]}", "los");
}

TEST(ScriptLinks, DegradesASensorFromARoundOn) {
  const std::string plain = R"(experiment: degraded
rounds: 50
agents: {count: 3, protocol: local_voting}
topology: ring
plant: {model: integrator, initial: {position: [1, 2, 3]}, disturbances: [{on: measurement, uniform: {bound: 0.1}}]}
events: [{round: 20, degrade: {agent: 2, gaussian: {deviation: 0.5}}}]
)";
  const Experiment e = parse_experiment(plain, "e.yaml", ".");
  ASSERT_EQ(e.plant->disturbances.size(), 2U);
  const Disturbance& degraded = e.plant->disturbances[1];
  EXPECT_EQ(degraded.first, 20U);
  EXPECT_EQ(degraded.on, Disturbance::On::measurement);
  EXPECT_EQ(degraded.agents, std::vector{AgentId{2}});
  EXPECT_EQ(std::get<Disturbance::Gaussian>(degraded.signal).covariance(0, 0), 0.25);
  EXPECT_EQ(parse_experiment(e.resolved_text, "resolved", ".").resolved_text, e.resolved_text);
}

}  // namespace
}  // namespace consort
