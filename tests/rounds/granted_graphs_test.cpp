/// Which graph holds when, as grants come one after the other.

#include "rounds/granted_graphs.hpp"

#include "core/errors.hpp"

#include <gtest/gtest.h>

#include <array>

namespace consort {
namespace {

/// Agents 2 and 3 of three are members 0 and 1 here.
GrantedGraphs graphs() { return GrantedGraphs({GrantedGraphs::kNobody, 0, 1}, 2); }

TEST(GrantedGraphs, AGraphIsStatedOnceAndThenKnownByItsNumber) {
  GrantedGraphs granted = graphs();
  EXPECT_TRUE(granted.empty());
  EXPECT_FALSE(granted.at(0).topology);
  granted.extend(std::array{GrantedSegment{0, 0, ring(3).edges()}, GrantedSegment{4, 1, path(3).edges()}}, 0, 0);
  granted.extend(std::array{GrantedSegment{9, 0, {}}}, 0, 0);
  EXPECT_EQ(granted.at(3).topology, granted.at(0).topology);
  EXPECT_EQ(granted.at(3).end, 4U);
  EXPECT_NE(granted.at(4).topology, granted.at(0).topology);
  EXPECT_EQ(granted.at(1000).topology, granted.at(0).topology);
  EXPECT_EQ(granted.at(1000).end, kNever);
}

TEST(GrantedGraphs, SayWhoHearsAMemberHereAndElsewhere) {
  GrantedGraphs granted = graphs();
  const std::vector<WeightedEdge> edges{{{AgentId{1}, AgentId{2}}, 1.0}, {{AgentId{2}, AgentId{3}}, 1.0}, {{AgentId{3}, AgentId{1}}, 1.0}};
  granted.extend(std::array{GrantedSegment{0, 0, edges}}, 0, 0);
  const auto topology = granted.at(0).topology;
  EXPECT_EQ(topology->local_listeners[0], std::vector<std::uint32_t>{1});
  EXPECT_TRUE(topology->local_listeners[1].empty());
  EXPECT_TRUE(topology->remote_listeners[0].empty());
  EXPECT_FALSE(topology->remote_listeners[1].empty());
}

TEST(GrantedGraphs, WhatDoesNotFollowOrWasNeverStatedIsRefused) {
  GrantedGraphs granted = graphs();
  granted.extend(std::array{GrantedSegment{5, 0, ring(3).edges()}}, 0, 0);
  EXPECT_THROW(granted.extend(std::array{GrantedSegment{5, 0, {}}}, 0, 0), RunError);
  EXPECT_THROW(granted.extend(std::array{GrantedSegment{6, 3, {}}}, 0, 0), RunError);
  const std::vector<WeightedEdge> strange{{{AgentId{1}, AgentId{4}}, 1.0}};
  EXPECT_THROW(granted.extend(std::array{GrantedSegment{7, 1, strange}}, 0, 0), RunError);
  granted.extend(std::array{GrantedSegment{8, 3, {}}}, 0, 9);  // over before any member here takes part
  EXPECT_EQ(granted.at(8).first, 5U);
}

TEST(GrantedGraphs, WhatReplacesIsAllThatHolds) {
  GrantedGraphs granted = graphs();
  granted.extend(std::array{GrantedSegment{0, 0, ring(3).edges()}}, 0, 0);
  granted.replace(std::array{GrantedSegment{3, 0, path(3).edges()}});
  EXPECT_FALSE(granted.at(2).topology);
  EXPECT_EQ(granted.at(3).topology->graph.in_neighbours(AgentId{1}).size(), 1U);
}

}  // namespace
}  // namespace consort
