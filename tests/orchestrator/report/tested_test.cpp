#include "orchestrator/report/tested.hpp"

#include <gtest/gtest.h>

#include <pugixml.hpp>

namespace consort {
namespace {

using Outcome = TestCase::Outcome;

TestedExperiment tested(int exit, const std::string& err, const nlohmann::ordered_json& summary) {
  TestedExperiment test{"ring.yaml", "2026-01-31T19:45:00Z", exit, "the table\n", err, {}};
  add_cases(test, 1.5, summary);
  return test;
}

nlohmann::ordered_json criteria(const char* json) { return {{"criteria", nlohmann::ordered_json::parse(json)}}; }

TEST(Tested, EachCriterionIsACaseBesideTheRun) {
  const auto test = tested(1, "", criteria(R"([{"text": "bias < 1", "met": true, "value": 0.5, "metrics": {"bias": 0.5}},
      {"text": "a + b < 1", "met": false, "value": 2.5, "metrics": {"a": 1.5, "b": 1}},
      {"text": "c < 1", "met": false, "value": null, "metrics": {"c": null}, "undefined": "not a number"}])"));
  ASSERT_EQ(test.cases.size(), 4U);
  EXPECT_EQ(test.cases[0].outcome, Outcome::passed) << "it ran to its end";
  EXPECT_EQ(test.cases[1].outcome, Outcome::passed);
  EXPECT_EQ(test.cases[2].outcome, Outcome::failed);
  EXPECT_EQ(test.cases[2].message, "value 2.5, a 1.5, b 1");
  EXPECT_EQ(test.cases[3].message, "something in it is not a number");
  EXPECT_EQ(test.seconds(), 1.5);
}

TEST(Tested, ARunThatFailsIsAnErrorAndItsCriteriaAreSkipped) {
  const auto incomplete = tested(4, "round 7\nconsort: timed out\n", criteria(R"([{"text": "bias < 1", "met": null, "value": 0.5}])"));
  EXPECT_EQ(incomplete.cases[0].outcome, Outcome::error);
  EXPECT_EQ(incomplete.cases[0].message, "exit code 4: timed out");
  EXPECT_EQ(incomplete.cases[1].outcome, Outcome::skipped);
  const auto refused = tested(2, "consort: ring.yaml:1:1: no\n", {});
  ASSERT_EQ(refused.cases.size(), 1U);
  EXPECT_EQ(refused.cases[0].message, "exit code 2: ring.yaml:1:1: no");
  EXPECT_EQ(tested(139, "", {}).cases[0].outcome, Outcome::error);
}

TEST(Tested, ABaselineThatIsLeftSaysByWhat) {
  Comparison comparison;
  comparison.tolerant = true;
  EXPECT_EQ(baseline_case(comparison).outcome, Outcome::passed);
  comparison.metrics = {{"bias", 1.0, 2.0, 0.1, false}, {"rmse", 1.0, 1.0, 0.1, true}};
  comparison.flipped = {{"bias < 2", "met", "not met"}};
  const TestCase test = baseline_case(comparison);
  EXPECT_EQ(test.outcome, Outcome::failed);
  EXPECT_TRUE(test.message.starts_with("bias 2 instead of 1, bias < 2 is judged otherwise; ")) << test.message;
}

TEST(Junit, HoldsCasesCountsTimesAndTheTable) {
  pugi::xml_document document;
  const std::vector<TestedExperiment> all{
      tested(1, "", criteria(R"([{"text": "a < 1", "met": true}, {"text": "b < 1", "met": false, "value": 3}])")),
      tested(3, "consort: no", {})};
  ASSERT_TRUE(document.load_string(junit(all).c_str()));
  const auto suites = document.child("testsuites");
  EXPECT_STREQ(suites.attribute("tests").value(), "4");
  EXPECT_STREQ(suites.attribute("failures").value(), "1");
  EXPECT_STREQ(suites.attribute("errors").value(), "1");
  EXPECT_STREQ(suites.attribute("time").value(), "3.000");
  const auto suite = suites.child("testsuite");
  EXPECT_STREQ(suite.attribute("timestamp").value(), "2026-01-31T19:45:00Z");
  const auto failed = suite.find_child_by_attribute("testcase", "name", "b < 1");
  EXPECT_STREQ(failed.child("failure").attribute("message").value(), "value 3");
  EXPECT_STREQ(failed.child("system-out").text().get(), "the table\n");
  EXPECT_STREQ(suite.next_sibling("testsuite").child("testcase").child("error").text().get(), "consort: no");
}

TEST(Junit, IsWellFormedWhateverNamesAndOutputsHold) {
  const std::string hostile = "]]>\"'<&>\x01\x1b[31m\xff\xc0\xaf\xed\xa0\x80\xf4\x90\x80\x80\xe2\x82 \xef\xbf\xbf ü\t\n</testcase><script>";
  TestedExperiment test{hostile, "now", 1, hostile, hostile, {{hostile, Outcome::error, hostile}}};
  const std::string xml = junit({&test, 1});
  pugi::xml_document document;
  const auto parsed = document.load_buffer(xml.data(), xml.size(), pugi::parse_default, pugi::encoding_utf8);
  ASSERT_TRUE(parsed) << parsed.description();
  const auto suite = document.child("testsuites").child("testsuite");
  EXPECT_EQ(std::distance(suite.children().begin(), suite.children().end()), 2) << "a case and its errors, nothing smuggled in";
  EXPECT_EQ(suite.child("system-err").text().get(), xml_text(hostile));
  EXPECT_EQ(xml.find("&#1;"), std::string::npos) << "XML 1.0 has no such character, also escaped";
}

TEST(Junit, TextKeepsWhatXmlAllows) {
  EXPECT_EQ(xml_text("a\tü€𝄞\n"), "a\tü€𝄞\n");
  EXPECT_EQ(xml_text(std::string("a\0b", 3)), "a\uFFFDb");
  EXPECT_EQ(xml_text("\xc3"), "\uFFFD");
  EXPECT_EQ(xml_text("\xe2\x28\xa1"), "\uFFFD(\uFFFD");
}

}  // namespace
}  // namespace consort
