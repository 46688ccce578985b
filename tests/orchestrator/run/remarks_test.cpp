#include "orchestrator/run/remarks.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

Refusal refusal(Refusal::Reason reason, const std::string& topic, const std::string& writer, std::uint64_t samples = 1) {
  return {topic, reason, reason == Refusal::Reason::bound ? "rounds" : "", writer, "consort-agent (pid 5 on there)", samples};
}

TEST(Remarks, AStrangerIsNamedOnceAndAllItsSamplesAreCounted) {
  Remarks remarks;
  remarks.refused(
      {refusal(Refusal::Reason::stranger, "consort_grant", "aa", 2), refusal(Refusal::Reason::stranger, "consort_command", "aa")});
  remarks.refused({refusal(Refusal::Reason::stranger, "consort_grant", "aa", 3)});
  const auto told = remarks.take();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_NE(told[0].find("participant aa, consort-agent (pid 5 on there)"), std::string::npos) << told[0];
  EXPECT_TRUE(remarks.take().empty());
  ASSERT_EQ(remarks.refusals().size(), 2u);
  EXPECT_EQ(remarks.refusals()[0].samples, 5u);
  remarks.refused({refusal(Refusal::Reason::bound, "consort_grant", "aa")});
  EXPECT_NE(remarks.take().at(0).find("break a bound of the wire (rounds)"), std::string::npos);
}

TEST(Remarks, EachReasonHasItsRemedy) {
  Remarks remarks;
  remarks.refused({refusal(Refusal::Reason::key, "consort_presence", "bb"), refusal(Refusal::Reason::build, "consort_presence", "cc")});
  const auto told = remarks.take();
  ASSERT_EQ(told.size(), 2u);
  EXPECT_NE(told[0].find("CONSORT_KEY"), std::string::npos);
  EXPECT_NE(told[1].find("install the same build on both"), std::string::npos);
}

TEST(Remarks, OtherSourcesAreToldOncePerHost) {
  Remarks remarks;
  wire::Build other = wire::Build::own();
  remarks.let_in(other, "consort-agent of agent 1", "here");
  EXPECT_TRUE(remarks.take().empty()) << "its own";
  other.commit = "f00d";
  for (const char* host : {"here", "here", "there"}) remarks.let_in(other, "consort-agent of agent 1", host);
  const auto told = remarks.take();
  EXPECT_EQ(told.size(), wire::Build::own().commit.empty() ? 0u : 2u);
  for (const std::string& text : told) EXPECT_TRUE(text.starts_with("consort-agent of agent 1 is built of commit f00d, this run of "));
}

}  // namespace
}  // namespace consort
