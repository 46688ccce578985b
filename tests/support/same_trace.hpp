#pragma once
/// Two drivers, one trace: equal bit for bit.

#include "orchestrator/run/run.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <string>
#include <vector>

namespace consort {

/// Bits, so that what is absent equals what is absent.
inline std::vector<std::uint64_t> bits_of(const Rows<double>& rows) {
  std::vector<std::uint64_t> bits;
  for (std::size_t row = 0; row < rows.size(); ++row)
    for (const double value : rows[row]) bits.push_back(std::bit_cast<std::uint64_t>(value));
  return bits;
}

inline void expect_same_traces(const std::vector<JobOutcome>& processes, const std::vector<JobOutcome>& simulated) {
  ASSERT_EQ(processes.size(), simulated.size());
  for (std::size_t j = 0; j < processes.size(); ++j) {
    SCOPED_TRACE("job " + std::to_string(j));
    const Trace &a = processes[j].trace, &b = simulated[j].trace;
    EXPECT_EQ(a.hash, b.hash);
    EXPECT_EQ(a.last_round, b.last_round);
    EXPECT_EQ(a.converged, b.converged);
    EXPECT_EQ(a.rounds, b.rounds);
    EXPECT_TRUE(bits_of(a.estimates) == bits_of(b.estimates));
    EXPECT_EQ(a.recorded_layout, b.recorded_layout);
    EXPECT_TRUE(bits_of(a.recorded) == bits_of(b.recorded));
    EXPECT_TRUE(bits_of(a.states) == bits_of(b.states));
    EXPECT_EQ(a.totals.sent, b.totals.sent);
    EXPECT_EQ(a.totals.delivered, b.totals.delivered);
    EXPECT_EQ(a.totals.lost, b.totals.lost);
    if (!a.converged) {
      EXPECT_EQ(a.links, b.links) << "agents run a little past a convergence stop, their links with them";
    }
  }
}

}  // namespace consort
