#include "orchestrator/script/memory.hpp"

#include "core/errors.hpp"
#include "orchestrator/script/script.hpp"

#include <gtest/gtest.h>

#include <functional>

namespace consort {
namespace {

std::string refusal_of(const std::function<void()>& act) {
  try {
    act();
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

std::string refusal_of(const std::string& text) {
  return refusal_of([&text] { parse_experiment(text, "e.yaml", "."); });
}

TEST(Memory, WhatIsNeededAndWhatThereIsAreSaid) {
  EXPECT_EQ(refusal_of([] { require_memory(1000.0, "it", "less", 1000.0); }), "");
  EXPECT_EQ(refusal_of([] { require_memory(1.5e12, "it", "less", 2e10); }),
            "it would take 1.5 TB of memory, and 20 GB can be had; allowed: less");
  EXPECT_EQ(bytes_text(999.0), "999 bytes");
  EXPECT_EQ(bytes_text(1e21), "1e+03 EB");
  EXPECT_GT(memory_to_be_had(), 0.0);
}

TEST(Memory, CountsThatNoMachineHoldsAreRefusedAtTheirPlace) {
  const std::string head = "experiment: e\nmode: simulate\nagents: {count: 100000, protocol: local_voting, initial: {x: 1}}\n";
  EXPECT_EQ(refusal_of(head + "topology: ring\nrounds: 1000000000\ntelemetry: {every: 1}\nstop: {deadline: 100000000 s}\n")
                .find("e.yaml:3:35: agents: agent 1 with local_voting: 1e+09 reports of 100000 numbers would take 1.6 PB of memory, and "),
            0u);
  EXPECT_EQ(
      refusal_of("experiment: e\nagents: {count: 3, protocol: local_voting, initial: {x: {linspace: [0, 1], dimension: 99999999999}}}\n"
                 "topology: ring\n")
          .find("e.yaml:2:"),
      0u);
  EXPECT_EQ(refusal_of("experiment: e\nruns: 1000000\nagents: {count: 3, protocol: local_voting, initial: {x: 1}}\ntopology: ring\n"
                       "sweep: {links.loss: [0, 0.5]}\n"),
            "e.yaml:2:7: runs: found 1000000 of each of 2 protocols and swept values; allowed: 1000000 runs in all");
}

TEST(Memory, WhatAllAgentsTakeIsSaidBeforeTheyAreMade) {
  const std::string text = "experiment: e\nmode: simulate\nagents: {count: 100000, protocol: local_voting, initial: {x: 1}}\n";
  EXPECT_EQ(refusal_of(text + "topology: ring\n"), "") << "memory grows as the edges do";
  const std::string refusal = refusal_of(text + "topology: random_pairs\n");
  EXPECT_EQ(refusal.find("e.yaml:3:35: agents: agent 1 with local_voting: 100000 agents with local_voting, of 1 number each and 1 in a "
                         "message, and 1e+10 links between them would take "),
            0u)
      << refusal;
  EXPECT_NE(refusal.find("allowed: fewer agents, edges or components"), std::string::npos) << refusal;
}

TEST(Memory, WhereItRunsOutTheLargestNeedIsSaid) {
  require_memory(1e18, "what nobody has", "less", 1e19);
  EXPECT_NE(out_of_memory().find(" can be had, and 1 EB are needed for what nobody has; allowed: fewer agents"), std::string::npos)
      << out_of_memory();
}

TEST(Memory, NamesAreBounded) {
  const auto named = [](std::size_t length) {
    return "experiment: " + std::string(length, 'a') + "\nagents: {count: 3, protocol: local_voting, initial: {x: 1}}\ntopology: ring\n";
  };
  EXPECT_EQ(refusal_of(named(64)), "");
  EXPECT_NE(refusal_of(named(65)).find("e.yaml:1:13: experiment: found text 'aaa"), std::string::npos);
}

}  // namespace
}  // namespace consort
