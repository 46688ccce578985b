#include "core/counted.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

TEST(Counted, OneIsOneAndAllElseIsMany) {
  EXPECT_EQ(counted(0, "line"), "0 lines");
  EXPECT_EQ(counted(1, "line"), "1 line");
  EXPECT_EQ(counted(2, "line"), "2 lines");
  EXPECT_EQ(noun(1.0, "round"), "round");
  EXPECT_EQ(noun(1.5, "round"), "rounds");
}

TEST(Counted, NounsEndAsTheyAreSpelt) {
  EXPECT_EQ(counted(2, "process"), "2 processes");
  EXPECT_EQ(counted(2, "entry"), "2 entries");
  EXPECT_EQ(counted(2, "key"), "2 keys");
  EXPECT_EQ(counted(2, "graph"), "2 graphs");
  EXPECT_EQ(counted(2, "switch"), "2 switches");
}

}  // namespace
}  // namespace consort
