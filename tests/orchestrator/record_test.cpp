#include "orchestrator/record.hpp"

#include "core/errors.hpp"
#include "orchestrator/sqlite.hpp"
#include "tests/orchestrator/folder.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

namespace consort {
namespace {

Experiment experiment_of(std::size_t agents, std::vector<std::string> protocols) {
  Experiment experiment;
  experiment.name = "small";
  experiment.agents = agents;
  for (auto& name : protocols) experiment.protocols.push_back({std::move(name), {}});
  return experiment;
}

/// Reports whose numbers say where they come from: value = round + agent / 100 + component / 10 000.
struct Numbers {
  std::size_t agents, dimension;
  std::vector<double> estimates;
  std::vector<std::uint64_t> hashes;
  std::vector<AgentCounters> counters;
  RoundReport at(Round k) {
    estimates.clear();
    hashes.clear();
    counters.clear();
    for (std::size_t agent = 1; agent <= agents; ++agent) {
      for (std::size_t i = 0; i < dimension; ++i) estimates.push_back(k + 0.01 * double(agent) + 0.0001 * double(i));
      hashes.push_back(1000 * k + agent);
      counters.push_back({2 * k, k, k + agent});
    }
    return {k, estimates, hashes, counters};
  }
};

const Layout kScalar{{{"x", 1, 1}}, 0, 0};
const Layout kVectorWithCovariance{{{"x", 2, 1}, {"P", 2, 2}}, 0, 0};

std::int64_t number(Database& database, const std::string& sql) {
  Statement statement = database.prepare(sql);
  EXPECT_TRUE(statement.step()) << sql;
  return statement.integer(0);
}
double real(Database& database, const std::string& sql) {
  Statement statement = database.prepare(sql);
  EXPECT_TRUE(statement.step()) << sql;
  return statement.real(0);
}
std::string text(Database& database, const std::string& sql) {
  Statement statement = database.prepare(sql);
  EXPECT_TRUE(statement.step()) << sql;
  return statement.text(0);
}

TEST(Record, GivesBackWhatWasReported) {
  const ScratchFolder folder;
  const Experiment experiment = experiment_of(3, {"local_voting"});
  const Job job{0, 0, Seed{11}};
  Numbers numbers{3, 1, {}, {}, {}};
  {
    Record record(folder.path() / "record.sqlite");
    record.begin_run(job, experiment, {{}, kScalar});
    for (Round k : {0u, 5u, 7u}) record.add(job, numbers.at(k));
    record.event(job, 5, "cut", "1 -> 2");
    JobOutcome outcome{job, {}, 0.25};
    outcome.trace.links = {{{AgentId{1}, AgentId{2}}, 6, 1}};
    outcome.trace.last_round = 7;
    outcome.trace.hash = 0xabcdef;
    outcome.trace.totals = {42, 21, 27};
    outcome.trace.converged = true;
    record.end_run(outcome);
  }
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "record.sqlite-wal")) << "a record that was closed is a single file";
  Database database(folder.path() / "record.sqlite", Database::Open::read);
  EXPECT_EQ(number(database, "SELECT count(*) FROM estimates"), 9);
  EXPECT_EQ(real(database, "SELECT x FROM estimates WHERE run = 0 AND round = 5 AND agent = 2"), 5 + 0.02);
  EXPECT_EQ(number(database, "SELECT messages_lost FROM agents WHERE agent = 3"), 10);
  EXPECT_EQ(text(database, "SELECT history_hash FROM agents WHERE agent = 3"), "0000000000001b5b");
  EXPECT_EQ(text(database, "SELECT kind || ' ' || text FROM events WHERE round = 5"), "cut 1 -> 2");
  EXPECT_EQ(number(database, "SELECT delivered FROM links WHERE sender = 1 AND receiver = 2"), 6);
  EXPECT_EQ(text(database, "SELECT protocol FROM runs"), "local_voting");
  EXPECT_EQ(text(database, "SELECT trace_hash FROM runs WHERE ended IS NOT NULL AND converged = 1"), "0000000000abcdef");
  EXPECT_EQ(number(database, "SELECT seed FROM runs"), 11);
  EXPECT_EQ(number(database, "SELECT rounds FROM runs"), 7);
}

TEST(Record, KeepsProtocolsWithDifferentLayoutsInOneTable) {
  const ScratchFolder folder;
  const Experiment experiment = experiment_of(2, {"scalar_one", "vector_one"});
  const Job first{0, 0, Seed{1}}, second{1, 1, Seed{18446744073709551615u}};
  {
    Record record(folder.path() / "record.sqlite");
    Numbers scalar{2, 1, {}, {}, {}}, vector{2, 6, {}, {}, {}};
    record.begin_run(first, experiment, {{}, kScalar});
    record.add(first, scalar.at(0));
    record.end_run({first, {}, 0.0});
    record.begin_run(second, experiment, {{}, kVectorWithCovariance});
    record.add(second, vector.at(3));
    record.end_run({second, {}, 0.0});
  }
  Database database(folder.path() / "record.sqlite", Database::Open::read);
  EXPECT_EQ(real(database, "SELECT x FROM estimates WHERE run = 0 AND agent = 2"), 0.02);
  EXPECT_EQ(real(database, "SELECT x_1 FROM estimates WHERE run = 1 AND agent = 2"), 3 + 0.02 + 0.0001);
  EXPECT_EQ(real(database, "SELECT P_1_0 FROM estimates WHERE run = 1 AND agent = 2"), 3 + 0.02 + 0.0001 * 3) << "column-major";
  EXPECT_EQ(number(database, "SELECT count(*) FROM estimates WHERE run = 1 AND x IS NULL"), 2);
  EXPECT_EQ(text(database, "SELECT seed FROM runs WHERE run = 1"), "18446744073709551615");
}

TEST(Record, RunThatNeverEndedKeepsItsCounts) {
  const ScratchFolder folder;
  const Experiment experiment = experiment_of(2, {"local_voting"});
  const Job job{0, 0, Seed{1}};
  {
    Record record(folder.path() / "record.sqlite");
    Numbers numbers{2, 1, {}, {}, {}};
    record.begin_run(job, experiment, {{}, kScalar});
    record.add(job, numbers.at(4));
  }
  Database database(folder.path() / "record.sqlite", Database::Open::read);
  EXPECT_EQ(number(database, "SELECT ended IS NULL FROM runs"), 1);
  EXPECT_EQ(number(database, "SELECT messages_sent FROM agents WHERE agent = 2"), 8);
}

TEST(Record, IsNeverOverwritten) {
  const ScratchFolder folder;
  { Record record(folder.path() / "record.sqlite"); }
  EXPECT_THROW(Record(folder.path() / "record.sqlite"), RunError);
  EXPECT_THROW(Record(folder.path() / "absent" / "record.sqlite"), RunError);
}

TEST(Record, FailureOfTheWriterReachesTheCaller) {
  const ScratchFolder folder;
  const Experiment experiment = experiment_of(2, {"local_voting"});
  const Job job{0, 0, Seed{1}};
  Record record(folder.path() / "record.sqlite");
  Numbers numbers{2, 1, {}, {}, {}};
  record.begin_run(job, experiment, {{}, kScalar});
  record.add(job, numbers.at(1));
  record.flush();
  record.add(job, numbers.at(1));  // the same round twice breaks the primary key
  try {
    record.flush();
    FAIL() << "the writer's failure was swallowed";
  } catch (const RunError& error) {
    EXPECT_NE(std::string(error.what()).find("record.sqlite"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("UNIQUE"), std::string::npos) << error.what();
  }
  EXPECT_THROW(record.add(job, numbers.at(2)), RunError) << "nothing is accepted that nobody will write";
}

TEST(Record, KilledProcessLosesNothingThatWasFlushed) {
  const ScratchFolder folder;
  const auto file = folder.path() / "record.sqlite";
  int pipe_ends[2];
  ASSERT_EQ(::pipe(pipe_ends), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const Experiment experiment = experiment_of(10, {"local_voting"});
    const Job job{0, 0, Seed{1}};
    Record record(file);
    Numbers numbers{10, 1, {}, {}, {}};
    record.begin_run(job, experiment, {{}, kScalar});
    for (Round k = 0;; ++k) {
      record.add(job, numbers.at(k));
      if (k == 999) {
        record.flush();
        if (::write(pipe_ends[1], "x", 1) != 1) ::_exit(1);
      }
    }
  }
  ::close(pipe_ends[1]);
  char byte = 0;
  ASSERT_EQ(::read(pipe_ends[0], &byte, 1), 1);  // 1000 rounds are committed, more are on their way
  ::close(pipe_ends[0]);
  ASSERT_EQ(::kill(child, SIGKILL), 0);
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  Database database(file, Database::Open::read);
  EXPECT_EQ(text(database, "PRAGMA integrity_check"), "ok");
  EXPECT_GE(number(database, "SELECT count(*) FROM estimates"), 10 * 1000);
  EXPECT_EQ(number(database, "SELECT count(*) % 10 FROM estimates"), 0) << "a round is in the record whole or not at all";
  EXPECT_EQ(real(database, "SELECT x FROM estimates WHERE round = 999 AND agent = 10"), 999 + 0.01 * 10);
  EXPECT_EQ(number(database, "SELECT ended IS NULL FROM runs"), 1);
}

}  // namespace
}  // namespace consort
