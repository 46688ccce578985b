#include "core/trace.hpp"

#include "core/errors.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

RoundReport report_of(Round k, const std::vector<double>& estimates, const std::vector<std::uint64_t>& hashes,
                      const std::vector<AgentCounters>& counters) {
  return {k, estimates, hashes, counters};
}

TEST(Trace, AppendsEstimatesAndSumsTheCounters) {
  Trace trace;
  trace.agents = 2;
  trace.dimension = 2;
  const std::vector<double> start{1, 2, 3, 4}, end{5, 6, 7, 8};
  const std::vector<std::uint64_t> hashes{10, 20};
  const std::vector<AgentCounters> none(2), some{{1, 2, 3}, {10, 20, 30}};
  trace.add(report_of(0, start, hashes, none));
  trace.add(report_of(5, end, hashes, some));
  EXPECT_EQ(trace.rounds, (std::vector<Round>{0, 5}));
  EXPECT_EQ(trace.last_round, 5U);
  EXPECT_EQ(trace.at(0, AgentId{2})[0], 3.0);
  EXPECT_EQ(trace.final_estimate(AgentId{2})[1], 8.0);
  EXPECT_EQ(trace.totals.sent, 11U);
  EXPECT_EQ(trace.totals.delivered, 22U);
  EXPECT_EQ(trace.totals.lost, 33U);
}

TEST(Trace, HashDependsOnEveryAgentAndTheirOrder) {
  const auto hash_of = [](const std::vector<std::uint64_t>& hashes) {
    Trace trace;
    trace.agents = hashes.size();
    const std::vector<AgentCounters> counters(hashes.size());
    trace.add(report_of(0, {}, hashes, counters));
    return trace.hash;
  };
  EXPECT_EQ(hash_of({1, 2}), hash_of({1, 2}));
  EXPECT_NE(hash_of({1, 2}), hash_of({2, 1}));
  EXPECT_NE(hash_of({1, 2}), hash_of({1, 3}));
  EXPECT_NE(hash_of({1, 2}), hash_of({1, 2, 0}));
}

TEST(Trace, RefusesReportsOfTheWrongShapeOrOrder) {
  Trace trace;
  trace.agents = 1;
  trace.dimension = 1;
  const std::vector<double> one{1}, two{1, 2};
  const std::vector<std::uint64_t> hash{1}, hashes{1, 2};
  const std::vector<AgentCounters> counter(1), counters(2);
  EXPECT_THROW(trace.add(report_of(0, two, hash, counter)), ContractViolation);
  EXPECT_THROW(trace.add(report_of(0, one, hashes, counter)), ContractViolation);
  EXPECT_THROW(trace.add(report_of(0, one, hash, counters)), ContractViolation);
  trace.add(report_of(3, one, hash, counter));
  EXPECT_THROW(trace.add(report_of(3, one, hash, counter)), ContractViolation);
  EXPECT_EQ(trace.rounds.size(), 1U);
}

TEST(HistoryHash, TellsRoundsSignsAndOrderApart) {
  const auto hash_of = [](std::initializer_list<double> values) {
    HistoryHash hash;
    hash.extend(std::vector<double>(values));
    return hash.value();
  };
  EXPECT_EQ(hash_of({1.0, 2.0}), hash_of({1.0, 2.0}));
  EXPECT_NE(hash_of({1.0, 2.0}), hash_of({2.0, 1.0}));
  EXPECT_NE(hash_of({0.0}), hash_of({-0.0}));
  EXPECT_NE(hash_of({0.0}), hash_of({0.0, 0.0}));
  EXPECT_NE(hash_of({}), hash_of({0.0}));
}

}  // namespace
}  // namespace consort
