#include "orchestrator/report/cell_store.hpp"

#include "core/errors.hpp"
#include "tests/orchestrator/folder.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <limits>

namespace consort {
namespace {

CellResult some_result(std::uint64_t hash) {
  CellResult result;
  result.hash = hash;
  result.runs.push_back({"a.x_1",
                         Seed{0xffffffffffffffff},
                         3,
                         40,
                         true,
                         {5, 4, 1},
                         0xdeadbeef00000001,
                         0.5,
                         {{"bias", 0.1 + 0.2}, {"never", std::nan("")}, {"far", -std::numeric_limits<double>::infinity()}},
                         Divergence{true, 1, 2, 3.5, 1e300}});
  result.curves.push_back({"a.x_1", true, {0, 5}, {0.1, 0.2}, {0.3, 1e-300}, {std::nan(""), 9.0}});
  return result;
}

StudyPlan plan_of_two() {
  StudyPlan plan;
  plan.experiment = "e";
  plan.keys = {"dt"};
  plan.asked = {"/somewhere", {"dt=1,2"}, true, true, true, {Mode::lockstep, 7, 8, 9, 2, {}, {{"seed", "3", "", 3.0, -1, -1}}, {}}};
  plan.criteria = {{"a.x_1.bias < 1", 3, 4}};
  for (const char* value : {"1", "2"})
    plan.cells.push_back(
        {{{{"dt", value, "dt_" + std::string(value), 1.0, 5, 6}}}, {"a.dt_1"}, Seed{3}, 2, 4, 0x8000000000000000 + plan.cells.size()});
  return plan;
}

void keep_plan(const std::filesystem::path& folder, const StudyPlan& plan) { std::ofstream(folder / "plan.json") << to_json(plan); }

TEST(CellResult, ComesBackBitForBit) {
  const CellResult before = some_result(0xf000000000000001);
  const auto text = to_json(before).dump();
  const CellResult after = cell_result_of(nlohmann::ordered_json::parse(text)).value();
  EXPECT_EQ(to_json(after).dump(), text);
  EXPECT_EQ(after.hash, before.hash);
  ASSERT_EQ(after.runs.size(), 1U);
  EXPECT_EQ(after.runs[0].seed, before.runs[0].seed);
  EXPECT_EQ(after.runs[0].trace_hash, before.runs[0].trace_hash);
  EXPECT_EQ(after.runs[0].metrics.at("bias"), 0.1 + 0.2);
  EXPECT_TRUE(std::isnan(after.runs[0].metrics.at("never")));
  EXPECT_EQ(after.runs[0].metrics.at("far"), -std::numeric_limits<double>::infinity());
  EXPECT_FALSE(cell_result_of({{"hash", 1}})) << "no such thing";
  EXPECT_FALSE(cell_result_of({}));
}

Trace halving(double start, Round rounds) {
  Trace trace;
  trace.agents = 2;
  trace.dimension = 1;
  for (Round k = 0; k <= rounds; ++k, start /= 2) {
    const std::array values{0.0, start};
    trace.rounds.push_back(k);
    trace.estimates.add(values, nullptr);
  }
  return trace;
}

TEST(CurveOverSeeds, HasQuantilesOfHowFarTheRunsWereAndTheLastValueOfThoseThatHaveEnded) {
  CurveOverSeeds over;
  over.add(halving(4.0, 2));
  over.add(halving(8.0, 4));
  over.add(halving(8.0, 4));
  const CellCurve curve = over.curve("a.x_1");
  EXPECT_EQ(curve.rounds, (std::vector<Round>{0, 1, 2, 3, 4}));
  EXPECT_EQ(curve.median, (std::vector<double>{8, 4, 2, 1, 0.5}));
  EXPECT_EQ(curve.low[0], 4.4);
  EXPECT_EQ(curve.high[4], 0.95) << "the first has stayed at 1";
}

TEST(StudyPlan, ComesBackAsItWas) {
  const ScratchFolder folder;
  const StudyPlan plan = plan_of_two();
  keep_plan(folder.path(), plan);
  EXPECT_EQ(to_json(plan_in(folder.path())), to_json(plan));
  std::ofstream(folder.path() / "plan.json") << "{}";
  EXPECT_THROW(plan_in(folder.path()), ConfigError);
  EXPECT_THROW(plan_in(folder.path() / "none"), ConfigError);
}

TEST(CellStore, HasOfEachCellWhatIsOfThePlanThatIsAsked) {
  const ScratchFolder folder;
  StudyPlan plan = plan_of_two();
  keep_plan(folder.path(), plan);
  {
    CellStore store(folder.path());
    store.keep(0, some_result(plan.cells[0].hash));
    EXPECT_FALSE(store.results(plan)[1]);
  }
  CellStore store(folder.path());
  ASSERT_TRUE(store.results(plan)[0]);
  const auto own = cell_folder(folder.path(), 1);
  EXPECT_EQ(own.filename(), "0002");
  std::filesystem::create_directories(own);
  std::ofstream(own / "summary.json") << nlohmann::ordered_json{{"cell", to_json(some_result(plan.cells[1].hash))}};
  EXPECT_TRUE(store.results(plan)[1]) << "in a folder of its own";
  plan.cells[0].hash = plan.cells[1].hash = 1;
  EXPECT_FALSE(store.results(plan)[0]) << "of another program or experiment";
  EXPECT_FALSE(store.results(plan)[1]);
}

}  // namespace
}  // namespace consort
