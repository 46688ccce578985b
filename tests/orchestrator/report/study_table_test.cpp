#include "orchestrator/report/study_table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <csignal>

namespace consort {
namespace {

// Two cells of one protocol with three seeds each; of the second, one seed never converges.
class StudyTables : public testing::Test {
 protected:
  StudyTables() {
    plan_.experiment = "small";
    plan_.keys = {"links.loss"};
    plan_.criteria = {{"voting.loss_0.2.bias > voting.loss_0.bias", 0, 0}, {"voting.loss_0.2.rounds_to_convergence.share > 0.9", 0, 0}};
    for (const char* loss : {"0", "0.2"})
      plan_.cells.push_back({{{{"links.loss", loss, std::string("loss_") + loss, std::atof(loss), 1, 1}}},
                             {std::string("voting.loss_") + loss},
                             Seed{1},
                             3,
                             5,
                             1});
    for (std::size_t i = 0; i < 2; ++i) {
      CellResult& cell = results_.emplace_back(CellResult{}).value();
      for (std::uint64_t seed = 1; seed <= 3; ++seed)
        cell.runs.push_back({plan_.cells[i].protocols[0],
                             Seed{seed},
                             5,
                             Round(10 * seed),
                             i + seed < 4,
                             {10, 9, 1},
                             seed,
                             0.1,
                             {{"bias", static_cast<double>(i) + 0.1 * static_cast<double>(seed)},
                              {"rounds_to_convergence", i + seed < 4 ? 7.0 : std::nan("")}}});
    }
  }
  StudyPlan plan_;
  std::vector<std::optional<CellResult>> results_;
};

TEST_F(StudyTables, ItsMetricsAreThoseOfTheCellsUnderTheirNames) {
  const StudyTable table = table_of(plan_, results_);
  ASSERT_EQ(table.rows.size(), 2U);
  EXPECT_EQ(table.rows[1].protocol, "voting");
  EXPECT_EQ(table.metrics, (std::vector<std::string>{"bias", "rounds_to_convergence"}));
  const Summary summary = summary_of(plan_, table, "folder", 0);
  EXPECT_NEAR(summary.metrics.at("voting.loss_0.bias"), 0.2, 1e-15);
  EXPECT_NEAR(summary.metrics.at("voting.loss_0.2.bias.std"), 0.1, 1e-15);
  EXPECT_NEAR(summary.metrics.at("voting.loss_0.2.rounds_to_convergence.share"), 2.0 / 3.0, 1e-15);
  EXPECT_EQ(summary.metrics.at("voting.loss_0.2.bias"), table.rows[1].spreads.at("bias").mean) << "one number everywhere";
  ASSERT_EQ(summary.criteria.size(), 2U);
  EXPECT_TRUE(summary.criteria[0].met);
  EXPECT_FALSE(summary.criteria[1].met);
  EXPECT_EQ(summary.exit, Exit::criterion_not_met);
}

TEST_F(StudyTables, OneSeedIsANumberWithoutAnInterval) {
  for (PlannedCell& cell : plan_.cells) cell.runs = 1;
  for (auto& result : results_) result->runs.resize(1);
  const std::string markdown = table_markdown(plan_, table_of(plan_, results_));
  EXPECT_NE(markdown.find(" 1.1 "), std::string::npos) << markdown;
  EXPECT_EQ(markdown.find("\u00b1"), std::string::npos) << markdown;
  EXPECT_EQ(markdown.find("inf"), std::string::npos) << markdown;
}

TEST_F(StudyTables, JudgeACriterionThatNamesNoCellInEachOfThem) {
  plan_.criteria = {{"bias < 2 and bias.std > 0", 0, 0}, {"bias < 1", 0, 0}};
  const Summary summary = summary_of(plan_, table_of(plan_, results_), "folder", 0);
  EXPECT_TRUE(summary.criteria.at(0).met);
  EXPECT_FALSE(summary.criteria.at(1).met);
  EXPECT_NEAR(summary.criteria[1].value, 1.2, 1e-15) << "of the cell that does not meet it";
  EXPECT_TRUE(summary.criteria[1].metrics.contains("loss_0.2: bias"));
}

TEST_F(StudyTables, AreTextOfThreeKinds) {
  const StudyTable table = table_of(plan_, results_);
  const std::string markdown = table_markdown(plan_, table), tex = table_tex(plan_, table), csv = table_csv(plan_, table);
  EXPECT_NE(markdown.find("| 0.2  | voting   | 1.20 ± 0.25 | 7 ± 0 (2 of 3)"), std::string::npos) << markdown;
  EXPECT_NE(markdown.find("95 % confidence interval (Student's t)"), std::string::npos);
  EXPECT_NE(
      tex.find(
          "loss & protocol & bias & rounds\\_to\\_convergence & converged \\\\\n\\midrule\n0 & voting & 0.20 $\\pm$ 0.25 & 7 $\\pm$ 0 & "
          "3 of 3 \\\\"),
      std::string::npos)
      << tex;
  EXPECT_TRUE(
      csv.starts_with("cell,links.loss,protocol,metric,runs,have_it,share,converged,mean,std,ci95_low,ci95_high,q05,q25,median,q75,q95\n"));
  EXPECT_NE(csv.find("\n2,0.2,voting,rounds_to_convergence,3,2,0.6666666666666666,0.6666666666666666,7,0,7,7,7,7,7,7,7\n"),
            std::string::npos)
      << csv;
}

TEST_F(StudyTables, SayWhatIsMissingOrFailed) {
  results_[0] = std::nullopt;
  results_[1]->error = "agent 3 died";
  results_[1]->exit = Exit::timed_out;
  const StudyTable table = table_of(plan_, results_);
  EXPECT_TRUE(table.rows.empty());
  const Summary summary = summary_of(plan_, table, "folder", 0);
  EXPECT_FALSE(summary.complete);
  EXPECT_EQ(summary.incomplete, "2 of 2 cells did not come to their end; cell 2 (links.loss = 0.2): agent 3 died");
  EXPECT_EQ(summary.exit, Exit::timed_out);
  EXPECT_TRUE(summary.criteria.empty()) << "nothing is known of what they name";
  EXPECT_EQ(summary_of(plan_, table, "folder", SIGINT).exit, Exit::interrupted);
}

}  // namespace
}  // namespace consort
