#include "orchestrator/run/launch.hpp"

#include "core/errors.hpp"
#include "tests/support/program.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

std::optional<Death> death_of(Children& children) {
  std::optional<Death> death;
  eventually([&] { return (death = children.next_death()).has_value(); });
  return death;
}

TEST(Children, TellHowTheyEndedWithTheLastLinesOfTheirLog) {
  const Folder logs;
  Children children(logs.path());
  children.start("talker", "/bin/sh", {"-c", "for i in $(seq 20); do echo line $i; done; echo last words >&2; exit 7"});
  const auto death = death_of(children);
  ASSERT_TRUE(death);
  EXPECT_EQ(death->name, "talker");
  EXPECT_EQ(death->exit_code, 7);
  EXPECT_EQ(death->signal, 0);
  EXPECT_NE(death->log_tail.find("last words"), std::string::npos);
  EXPECT_EQ(death->log_tail.find("line 1\n"), std::string::npos) << "only the last lines";
  EXPECT_NE(death->text().find("exited with code 7"), std::string::npos);
  EXPECT_EQ(children.alive(), 0u);
}

TEST(Children, KilledOnesNameTheirSignal) {
  const Folder logs;
  Children children(logs.path());
  children.start("victim", "/bin/sh", {"-c", "kill -KILL $$"});
  const auto death = death_of(children);
  ASSERT_TRUE(death);
  EXPECT_EQ(death->signal, SIGKILL);
  EXPECT_NE(death->text().find("SIGKILL"), std::string::npos);
  EXPECT_NE(death->text().find("its log is empty"), std::string::npos);
}

TEST(Children, AreEndedEvenIfTheyIgnoreSigterm) {
  const Folder logs;
  pid_t pid = 0;
  {
    Children children(logs.path());
    children.start("stubborn", "/bin/sh", {"-c", "trap '' TERM; echo $$; while :; do read -t 1 x < /dev/zero; done"});
    ASSERT_TRUE(eventually([&] { return !text_of(logs.path() / "stubborn.log").empty(); }));
    pid = std::stoi(text_of(logs.path() / "stubborn.log"));
    EXPECT_TRUE(runs(pid));
  }
  EXPECT_FALSE(runs(pid));
}

TEST(Children, AProgramThatCannotBeStartedIsNamed) {
  const Folder logs;
  Children children(logs.path());
  try {
    children.start("nobody", "/no/such/program", {});
    FAIL();
  } catch (const RunError& failure) {
    EXPECT_NE(std::string(failure.what()).find("/no/such/program"), std::string::npos);
  }
  EXPECT_EQ(children.alive(), 0u);
}

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

}  // namespace
}  // namespace consort
