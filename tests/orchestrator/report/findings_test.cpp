#include "orchestrator/report/findings.hpp"

#include "core/errors.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

using Verdict = Rating;

const std::vector<Finding> kMixed{{Verdict::holds, "strongly connected", "all rounds", "good"},
                                  {Verdict::refused, "observable", "agent 3 does not see mode 2", "its error does not shrink"},
                                  {Verdict::fails, "balanced", "", "biased"}};

TEST(Findings, ThatRefuseNameConditionEvidenceAndRemedy) {
  try {
    refuse_unsound(kMixed);
    FAIL() << "an unobservable experiment was taken";
  } catch (const ConfigError& error) {
    const std::string text = error.what();
    for (const char* part : {"--force", "observable (agent 3 does not see mode 2)", "its error does not shrink"})
      EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_EQ(text.find("balanced"), std::string::npos) << "a warning refuses nothing: " << text;
  }
  EXPECT_NO_THROW(refuse_unsound({kMixed[0], kMixed[2]}));
}

TEST(Findings, ThatFailAreToldInALineEachAndAllAreKept) {
  const std::string refused = "✗ observable (agent 3 does not see mode 2): its error does not shrink", failed = "✗ balanced: biased";
  EXPECT_EQ(told(kMixed, true, {}), (std::vector<std::string>{"theory: 1 condition holds", refused, failed}));
  EXPECT_EQ(told(kMixed, false, {}), (std::vector<std::string>{refused, failed})) << "what holds is not counted unless asked";
  EXPECT_TRUE(told({kMixed[0]}, false, {}).empty()) << "nothing to warn of";
  const auto json = to_json(kMixed);
  ASSERT_EQ(json.size(), 3u);
  EXPECT_EQ(json[1].at("verdict"), "refused");
  EXPECT_EQ(json[1].at("consequence"), "its error does not shrink");
}

TEST(Findings, ThatWereLeftOutAreNamedWithWhereToFindThem) {
  const std::vector<Finding> findings{{Verdict::left_out, "eigenvalues", "of order 5000", "too long"},
                                      {Verdict::left_out, "gains", "", ""}};
  const auto lines = told(findings, false, {});
  ASSERT_EQ(lines.size(), 1U);
  for (const char* part : {"not examined", "eigenvalues (of order 5000); gains", "consort validate"})
    EXPECT_NE(lines[0].find(part), std::string::npos) << lines[0];
  EXPECT_EQ(to_json(findings)[0].at("verdict"), "left_out");
}

}  // namespace
}  // namespace consort
