#include "orchestrator/report/results_folders.hpp"
#include "core/errors.hpp"
#include "orchestrator/report/record_schema.hpp"
#include "orchestrator/report/sqlite.hpp"
#include "tests/orchestrator/folder.hpp"

#include <gtest/gtest.h>

#include <fstream>

namespace consort {
namespace {

/// A results folder of `experiment`; `exit`: an SQL value.
void write_results(const std::filesystem::path& folder, const std::string& experiment, const std::string& began, const std::string& exit) {
  std::filesystem::create_directories(folder / "logs");
  Database database(folder / "record.sqlite", Database::Open::create);
  database.run(record_schema(1.0));
  database.run("INSERT INTO experiment (format, program, name, description, text, mode, seed, runs, agents, rounds, dt, report_every, " +
               std::string("began, exit) VALUES (2, '', '") + experiment + "', '', '', 'simulate', 7, 1, 3, 10, 1, 1, '" + began + "', " +
               exit + ")");
}

std::vector<std::string> names(const std::vector<ResultsFolder>& folders) {
  std::vector<std::string> names;
  for (const ResultsFolder& folder : folders) names.push_back(folder.path.filename().string());
  return names;
}

TEST(ResultsFolders, AreFoundWhereverTheyLieOldestFirst) {
  const ScratchFolder scratch;
  write_results(scratch.path() / "b", "ring", "2026-02-01T00:00:00Z", "0");
  write_results(scratch.path() / "studies/a", "ring", "2026-01-01T00:00:00Z", "1");
  write_results(scratch.path() / "killed", "other", "2026-03-01T00:00:00Z", "NULL");
  std::filesystem::create_directories(scratch.path() / "mine");
  std::ofstream(scratch.path() / "mine/record.sqlite") << "something else";
  std::filesystem::create_directory_symlink(scratch.path() / "b", scratch.path() / "link");
  const auto found = results_below(scratch.path());
  EXPECT_EQ(names(found), (std::vector<std::string>{"a", "b", "killed"}));
  EXPECT_EQ(found[0].verdict, "not met");
  EXPECT_EQ(found[1].verdict, "done") << "it has no criteria";
  EXPECT_EQ(found[2].verdict, "killed");
  EXPECT_EQ(found[1].seed, "7");
  EXPECT_GT(found[1].bytes, 4096U);
  EXPECT_EQ(names(results_below(scratch.path() / "b")), std::vector<std::string>{"b"});
  EXPECT_THROW(results_below(scratch.path() / "nowhere"), ConfigError);
}

TEST(ResultsFolders, ThoseToPruneAreOldAndNotAmongTheNewest) {
  std::vector<ResultsFolder> all;
  for (const char* day : {"01", "02", "03", "04"}) {
    for (const char* experiment : {"ring", "star"}) {
      ResultsFolder& folder = all.emplace_back();
      folder.experiment = experiment;
      folder.path = std::string(experiment) + day;
      folder.began = std::string("2026-01-") + day + "T00:00:00Z";
      folder.verdict = "done";
    }
  }
  const std::time_t now = 1767571200;  // 2026-01-05
  constexpr double kDay = 86400.0;
  EXPECT_EQ(names(to_prune(all, now, 2.5 * kDay, {})), (std::vector<std::string>{"ring01", "star01", "ring02", "star02"}));
  EXPECT_EQ(names(to_prune(all, now, 1.5 * kDay, 3)), (std::vector<std::string>{"ring01", "star01"}));
  EXPECT_EQ(to_prune(all, now, {}, 0).size(), 8U);
  all[0].verdict = "running";
  EXPECT_EQ(names(to_prune(all, now, 2.5 * kDay, {})), (std::vector<std::string>{"star01", "ring02", "star02"}));
}

TEST(ResultsFolders, NothingButResultsIsDeleted) {
  const ScratchFolder scratch;
  write_results(scratch.path() / "done", "ring", "2026-02-01T00:00:00Z", "0");
  write_results(scratch.path() / "noted", "ring", "2026-02-01T00:00:00Z", "0");
  std::ofstream(scratch.path() / "noted/notes.txt") << "mine";
  std::filesystem::create_directories(scratch.path() / "mine");
  std::filesystem::create_directory_symlink(scratch.path() / "done", scratch.path() / "link");
  EXPECT_THROW(remove_results(scratch.path() / "noted"), ConfigError);
  EXPECT_THROW(remove_results(scratch.path() / "mine"), ConfigError);
  EXPECT_THROW(remove_results(scratch.path() / "link"), ConfigError);
  EXPECT_TRUE(std::filesystem::exists(scratch.path() / "noted/record.sqlite"));
  remove_results(scratch.path() / "done");
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "done"));
}

TEST(ResultsFolders, AgesAndSizesAreReadAndWrittenAsPeopleDo) {
  EXPECT_EQ(parse_age("--older-than", "90 min"), 5400.0);
  EXPECT_EQ(parse_age("--older-than", "1.5d"), 129600.0);
  for (const char* text : {"", "d", "3", "-1d", "1 y", "1e9"}) EXPECT_THROW(parse_age("--older-than", text), ConfigError) << text;
  EXPECT_EQ(bytes_text(0), "0 B");
  EXPECT_EQ(bytes_text(999), "999 B");
  EXPECT_EQ(bytes_text(1200), "1.2 kB");
  EXPECT_EQ(bytes_text(123456789), "123 MB");
  EXPECT_EQ(bytes_text(999999999), "1 GB");
}

}  // namespace
}  // namespace consort
