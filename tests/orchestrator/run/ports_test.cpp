#include "orchestrator/run/ports.hpp"

#include "core/errors.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <optional>
#include <string>

namespace consort {
namespace {

TEST(PortBlock, TwoBlocksNeverOverlap) {
  const PortBlock first(300), second(10);
  EXPECT_TRUE(second.first() >= first.first() + 300 || second.first() + 10 <= first.first());
}

TEST(DomainShare, KnowsOfOthersInTheSameDomainAsLongAsTheyAreThere) {
  DomainShare one, elsewhere;
  one.enter(1001);  // no domain has this number, so nobody else does
  elsewhere.enter(1002);
  EXPECT_FALSE(one.with_others());
  {
    DomainShare two;
    two.enter(1001);
    EXPECT_TRUE(one.with_others());
    EXPECT_TRUE(two.with_others());
  }
  EXPECT_FALSE(one.with_others());
}

TEST(SoleRun, ASecondOneOfTheSameNameKeyAndDomainIsRefusedByThePidOfTheFirst) {
  const std::string name = "sole-" + std::to_string(getpid());
  {
    const SoleRun first(name, "a key", 7);
    try {
      const SoleRun second(name, "a key", 7);
      FAIL();
    } catch (const ConfigError& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find("--name: found " + name), std::string::npos) << text;
      EXPECT_NE(text.find("pid " + std::to_string(getpid()) + "; allowed: another --name"), std::string::npos) << text;
    }
    EXPECT_NO_THROW(SoleRun(name, "another key", 7));
    EXPECT_NO_THROW(SoleRun(name, "a key", 8));
    EXPECT_NO_THROW(SoleRun(name + "r", "a key", 7));
  }
  EXPECT_NO_THROW(SoleRun(name, "a key", 7)) << "the first has ended";
}

TEST(PortBlock, AnImpossibleNumberIsRefusedWithTheRemedy) {
  try {
    const PortBlock block(40'000);
    FAIL();
  } catch (const RunError& failure) {
    EXPECT_NE(std::string(failure.what()).find("discovery: multicast"), std::string::npos);
  }
}

TEST(PortBlock, PortsThatARunStatesAreThoseOrRefused) {
  const std::uint16_t free = PortBlock(8).first();
  EXPECT_EQ(PortBlock(8, free).first(), free);
  const auto refusal = [](std::uint16_t first) -> std::string {
    try {
      const PortBlock block(8, first);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal(65530), "--ports: found 65530, from which on 8 UDP ports are needed; there are 65535; allowed: another");
}

}  // namespace
}  // namespace consort
