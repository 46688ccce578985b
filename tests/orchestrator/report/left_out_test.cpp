#include "orchestrator/report/left_out.hpp"

#include "orchestrator/script/script.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

std::vector<std::string> of(const std::string& initial, const std::string& more = "") {
  return left_out_of_record(parse_experiment(
      "experiment: e\nagents: {count: 2, protocol: kalman_consensus, initial: " + initial + "}\ntopology: complete\n" + more, "e", "."));
}

TEST(LeftOut, WhatIsTooLargeForTheRecordIsNamedWithTheSwitch) {
  const auto lines = of("{x: {all: [1, 2, 3, 4, 5]}, P: 1}");
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0],
            "not in the record: P of kalman_consensus, 25 numbers of each agent; `record: {state: true}` in the experiment records them");
}

TEST(LeftOut, WhatFitsOrIsDecidedIsNotSpokenOf) {
  EXPECT_TRUE(of("{x: {all: [1, 2, 3, 4]}, P: 1}").empty()) << "16 numbers";
  EXPECT_TRUE(of("{x: {all: [1, 2, 3, 4, 5]}, P: 1}", "record: {state: true}\n").empty());
  EXPECT_TRUE(of("{x: {all: [1, 2, 3, 4, 5]}, P: 1}", "record: {state: false}\n").empty());
}

}  // namespace
}  // namespace consort
