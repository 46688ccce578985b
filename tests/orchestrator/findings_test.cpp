#include "orchestrator/findings.hpp"

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

TEST(Findings, AreToldInOneLineAndKeptWhole) {
  EXPECT_EQ(told(kMixed), "theory: 1 condition holds; does not hold: observable (agent 3 does not see mode 2); does not hold: balanced");
  const auto json = to_json(kMixed);
  ASSERT_EQ(json.size(), 3u);
  EXPECT_EQ(json[1].at("verdict"), "refused");
  EXPECT_EQ(json[1].at("consequence"), "its error does not shrink");
}

}  // namespace
}  // namespace consort
