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

}  // namespace
}  // namespace consort
