#include "orchestrator/report/comparison.hpp"
#include "core/errors.hpp"
#include "orchestrator/report/first_difference.hpp"
#include "orchestrator/report/kept_results.hpp"
#include "orchestrator/report/tolerance.hpp"
#include "tests/orchestrator/folder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace consort {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
using Bits = RunCompared::Bits;

KeptResults with_metrics(std::map<std::string, double> metrics) {
  KeptResults kept;
  kept.metrics = std::move(metrics);
  return kept;
}

bool same_metrics(std::map<std::string, double> a, std::map<std::string, double> b, const std::vector<Tolerance>& tolerances = {}) {
  return compare_values(with_metrics(std::move(a)), with_metrics(std::move(b)), tolerances).same_metrics();
}

TEST(Tolerance, IsANumberOrAShareOfAllMetricsOrOfThoseNamed) {
  const std::vector<Tolerance> all{parse_tolerance("--tolerance", "0.5"), parse_tolerance("--tolerance", "bias=10%"),
                                   parse_tolerance("--tolerance", "jitter*=2")};
  EXPECT_EQ(allowed(all, "rmse", 100.0), 0.5);
  EXPECT_EQ(allowed(all, "bias", -30.0), 3.0);
  EXPECT_EQ(allowed(all, "local_voting.bias", 30.0), 3.0);
  EXPECT_EQ(allowed(all, "bias.std", 30.0), 0.5);
  EXPECT_EQ(allowed(all, "jitter_p99", 1.0), 2.0);
  EXPECT_EQ(allowed({}, "bias", 30.0), 0.0);
  EXPECT_EQ(allowed(all, "bias", kNaN), 0.0);
}

TEST(Tolerance, ThatIsNoneIsRefused) {
  for (const char* text : {"", "-1", "nan", "bias=", "=1", "1 %", "bias=-2%"})
    EXPECT_THROW(parse_tolerance("--tolerance", text), ConfigError) << text;
}

TEST(Comparison, OfMetricsTakesWhatIsNoNumberAsItIs) {
  EXPECT_TRUE(same_metrics({{"a", 1.0}, {"b", kNaN}, {"c", INFINITY}}, {{"a", 1.0}, {"b", kNaN}, {"c", INFINITY}}));
  EXPECT_FALSE(same_metrics({{"a", kNaN}}, {{"a", 1.0}}));
  EXPECT_FALSE(same_metrics({{"a", INFINITY}}, {{"a", -INFINITY}}, {{"", 1.0, false}}));
  EXPECT_FALSE(same_metrics({{"a", 1.0}}, {}, {{"", 1.0, false}})) << "what is not there is within no tolerance";
  EXPECT_TRUE(same_metrics({{"a", 1.0}}, {{"a", 1.01}}, {{"", 0.02, true}}));
  EXPECT_FALSE(same_metrics({{"a", 1.0}}, {{"a", 1.03}}, {{"", 0.02, true}}));
}

TEST(Comparison, NamesCriteriaThatAreJudgedOtherwise) {
  KeptResults a, b;
  a.criteria = {{"bias < 1", true, 0.5}, {"rmse < 1", true, 0.5}, {"gone > 0", true, 1.0}};
  b.criteria = {{"rmse < 1", true, 0.6}, {"bias < 1", false, 2.0}, {"new > 0", {}, kNaN}};
  const Comparison comparison = compare_values(a, b, {});
  ASSERT_EQ(comparison.flipped.size(), 3U);
  EXPECT_EQ(comparison.flipped[0].text, "bias < 1");
  EXPECT_EQ(comparison.flipped[1].text, "gone > 0");
  EXPECT_EQ(comparison.flipped[1].b, "not there");
  EXPECT_EQ(comparison.flipped[2].text, "new > 0");
  EXPECT_EQ(comparison.flipped[2].b, "open");
}

TEST(Comparison, NamesKeysOfFileHostAndVersionsThatDiffer) {
  KeptResults a, b;
  a.text = "seed: 3\nagents: {count: 3, initial: {x: [1, 2, 3]}}\n";
  b.text = "seed: 3\nagents: {count: 3, initial: {x: [1, 9, 3]}}\nplant: linear\n";
  a.host = {{"began", "1"}, {"command_line", {"a"}}, {"host", "one"}, {"versions", {{"consort", "1"}, {"eigen", "3"}}}};
  b.host = {{"began", "2"}, {"command_line", {"b"}}, {"host", "two"}, {"versions", {{"consort", "2"}, {"eigen", "3"}}}};
  const Comparison comparison = compare_values(a, b, {});
  ASSERT_EQ(comparison.file.size(), 2U);
  EXPECT_EQ(comparison.file[0].key, "agents.initial.x[1]");
  EXPECT_EQ(comparison.file[0].b, "9");
  EXPECT_EQ(comparison.file[1].key, "plant");
  EXPECT_FALSE(comparison.file[1].a);
  ASSERT_EQ(comparison.host.size(), 1U);
  EXPECT_EQ(comparison.host[0].key, "host");
  ASSERT_EQ(comparison.versions.size(), 1U);
  EXPECT_EQ(comparison.versions[0].key, "consort");
  EXPECT_EQ(compare_values(a, KeptResults{}, {}).versions.size(), 2U) << "no host.json";
  EXPECT_EQ(keys_that_differ("a: 1", "a: [1").size(), 1U) << "what is no YAML differs as a whole";
}

TEST(Comparison, PairsRunsBySeedThenByWhatIsLeftOfTheProtocol) {
  const std::vector<KeptRun> a{{0, "p", "1", "", {}}, {1, "p", "2", "", {}}, {2, "p", "3", "", {}}, {3, "q", "1", "", {}}};
  const std::vector<KeptRun> b{{0, "p", "8", "", {}}, {1, "p", "1", "", {}}, {2, "r", "1", "", {}}};
  EXPECT_EQ(pair_runs(a, b), (std::vector<std::optional<std::size_t>>{1, 0, {}, {}}));
}

TEST(Comparison, JudgesBitsByReportsHashesAndLengths) {
  const KeptRun run{0, "p", "1", "aa", 10}, other{0, "p", "1", "bb", 10}, shorter{0, "p", "1", "cc", 5}, killed{0, "p", "1", "", {}};
  ReportsCompared differs;
  differs.first = FirstDifference{};
  EXPECT_EQ(judge_bits(run, run, {}), Bits::equal);
  EXPECT_EQ(judge_bits(run, run, differs), Bits::differ) << "what is recorded beside the estimates is not in the hash";
  EXPECT_EQ(judge_bits(run, other, {}), Bits::unreported);
  EXPECT_EQ(judge_bits(run, shorter, {}), Bits::length);
  EXPECT_EQ(judge_bits(run, killed, {}), Bits::unended);
  EXPECT_FALSE(Comparison{}.equal()) << "two that began nothing are not equal";
}

/// A record of one run of protocol p, whose rows of estimates are `rows`.
void write_record(const std::filesystem::path& file, const std::string& columns, const std::string& rows) {
  Database database(file, Database::Open::create);
  database.run("CREATE TABLE estimates (run, round, agent" + columns + "); CREATE TABLE columns (protocol, name); INSERT INTO columns " +
               "VALUES ('p', 'x'), ('p', 'P'), ('q', 'y'); INSERT INTO estimates VALUES " + rows);
}

TEST(FirstDifference, IsTheFirstRoundAgentAndNumberThatBothHaveReported) {
  const ScratchFolder folder;
  write_record(folder.path() / "a", ", x REAL, P REAL", "(0,0,1,1,5),(0,0,2,2,5),(0,1,1,1,5),(0,1,2,2,5),(0,2,1,1,5),(0,2,2,NULL,NULL)");
  write_record(folder.path() / "b", ", P REAL, x REAL", "(0,0,1,5,1),(0,0,2,5,2),(0,2,1,5,1),(0,2,2,NULL,NULL)");
  write_record(folder.path() / "c", ", x REAL, y REAL", "(7,0,1,1,0),(7,0,2,2,0),(7,2,1,1,0),(7,2,2,9,0)");
  Database a(folder.path() / "a", Database::Open::read), b(folder.path() / "b", Database::Open::read),
      c(folder.path() / "c", Database::Open::read);
  const ReportsCompared same = compare_reports(a, 0, b, 0, "p");
  EXPECT_FALSE(same.first) << "the order of columns is no difference";
  EXPECT_EQ(same.compared, 2);
  EXPECT_EQ(same.only_one, 1);
  EXPECT_EQ(same.last, 2);
  const ReportsCompared other = compare_reports(a, 0, c, 7, "p");
  ASSERT_TRUE(other.first);
  EXPECT_EQ(other.first->round, 2);
  EXPECT_EQ(other.first->agent, 2);
  EXPECT_EQ(other.first->field, "x");
  EXPECT_FALSE(other.first->a) << "it was not there";
  EXPECT_EQ(other.first->b, 9.0);
}

TEST(Comparison, SaysInWordsAndJsonWhatDiffers) {
  Comparison comparison = compare_values(with_metrics({{"bias", 1.0}, {"rmse", 2.0}}), with_metrics({{"bias", 1.5}, {"rmse", 2.0}}), {});
  comparison.runs.push_back({"p", "3", Bits::differ, {FirstDifference{12, 4, "x_0", 1.0, {}}, 12, 0, 12}, 20, 20});
  const std::string text = render(comparison, TextStyle{});
  EXPECT_NE(text.find("p, seed 3: first in round 12, agent 4, x_0: 1 in A, nothing in B"), std::string::npos) << text;
  EXPECT_NE(text.find("bias: 1 in A, 1.5 in B, difference 0.5"), std::string::npos) << text;
  EXPECT_EQ(text.find("rmse:"), std::string::npos) << text;
  const auto json = to_json(comparison);
  EXPECT_EQ(json["equal"], false);
  EXPECT_EQ(json["runs"][0]["first"]["agent"], 4);
  EXPECT_TRUE(json["runs"][0]["first"]["b"].is_null());
  EXPECT_EQ(json["metrics"][0]["difference"], 0.5);
}

}  // namespace
}  // namespace consort
