#include "orchestrator/report/record.hpp"

#include "core/errors.hpp"
#include "orchestrator/report/export.hpp"
#include "orchestrator/report/record_schema.hpp"
#include "orchestrator/report/sqlite.hpp"
#include "tests/orchestrator/folder.hpp"
#include "tests/support/text_of.hpp"
#include "tests/support/tree.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>

namespace consort {
namespace {

Experiment experiment_of(std::size_t agents, std::vector<std::string> protocols) {
  Experiment experiment;
  experiment.name = "small";
  experiment.agents = agents;
  experiment.topology = FixedSchedule{{{std::make_shared<const Graph>(ring(agents)), 1}}, false};
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

const Trace kScalar = [] {
  Trace outline;
  outline.agents = 2;
  outline.dimension = 1;
  outline.estimate_layout = {{{"x", 1, 1}}};
  return outline;
}();
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
    Record record(folder.path() / "record.sqlite", experiment);
    record.begin_run(job, kScalar);
    for (Round k : {0u, 5u, 7u}) record.add(job, numbers.at(k));
    record.event(job, 5, "cut", "1 -> 2");
    JobOutcome outcome{job, {}, 0.25};
    outcome.trace.links = {{{AgentId{1}, AgentId{2}}, {6, 1}}};
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
  EXPECT_EQ(text(database, "SELECT run_hash FROM runs WHERE ended IS NOT NULL AND converged = 1"), "0000000000abcdef");
  EXPECT_EQ(number(database, "SELECT seed FROM runs"), 11);
  EXPECT_EQ(number(database, "SELECT rounds FROM runs"), 7);
}

TEST(Record, KeepsProtocolsWithDifferentLayoutsInOneTable) {
  const ScratchFolder folder;
  const Experiment experiment = experiment_of(2, {"scalar_one", "vector_one"});
  const Job first{0, 0, Seed{1}}, second{1, 1, Seed{18446744073709551615u}};
  {
    Record record(folder.path() / "record.sqlite", experiment);
    Numbers scalar{2, 1, {}, {}, {}}, vector{2, 6, {}, {}, {}};
    record.begin_run(first, kScalar);
    record.add(first, scalar.at(0));
    record.end_run({first, {}, 0.0});
    Trace wider;
    wider.agents = 2;
    wider.dimension = 6;
    wider.estimate_layout = kVectorWithCovariance;
    record.begin_run(second, wider);
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
    Record record(folder.path() / "record.sqlite", experiment);
    Numbers numbers{2, 1, {}, {}, {}};
    record.begin_run(job, kScalar);
    record.add(job, numbers.at(4));
  }
  Database database(folder.path() / "record.sqlite", Database::Open::read);
  EXPECT_EQ(number(database, "SELECT ended IS NULL FROM runs"), 1);
  EXPECT_EQ(number(database, "SELECT messages_sent FROM agents WHERE agent = 2"), 8);
}

TEST(Record, IsNeverOverwritten) {
  const ScratchFolder folder;
  const Experiment experiment = experiment_of(1, {"local_voting"});
  { Record record(folder.path() / "record.sqlite", experiment); }
  EXPECT_THROW(Record(folder.path() / "record.sqlite", experiment), RunError);
  EXPECT_THROW(Record(folder.path() / "absent" / "record.sqlite", experiment), RunError);
}

TEST(Record, FailureOfTheWriterReachesTheCaller) {
  const ScratchFolder folder;
  const Experiment experiment = experiment_of(2, {"local_voting"});
  const Job job{0, 0, Seed{1}};
  Record record(folder.path() / "record.sqlite", experiment);
  Numbers numbers{2, 1, {}, {}, {}};
  record.begin_run(job, kScalar);
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
    Record record(file, experiment);
    Numbers numbers{10, 1, {}, {}, {}};
    record.begin_run(job, kScalar);
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
  EXPECT_EQ(text(database, "SELECT name FROM experiment WHERE ended IS NULL"), "small") << "what it was of is known";
  EXPECT_EQ(number(database, "SELECT count(*) FROM edges"), 20);
  const Exported exported = export_record(folder.path());
  ASSERT_EQ(exported.remarks.size(), 1u);
  EXPECT_NE(exported.remarks[0].find("run 0 (local_voting, seed 1) did not reach its end; it is recorded up to round "), std::string::npos)
      << exported.remarks[0];
}

TEST(Record, SaysWhatItIsOf) {
  const ScratchFolder folder;
  Experiment experiment = experiment_of(2, {"kalman_consensus", "kalman_consensus"});
  experiment.description = "A question?";
  experiment.resolved_text = "experiment: small\n";
  experiment.mode = Mode::realtime;
  experiment.seed = Seed{5};
  experiment.dt = 0.1;
  experiment.sweep_key = "links.loss";
  experiment.criteria = {"bias < 1"};
  for (std::size_t i = 0; i < 2; ++i)
    experiment.protocols[i].variant =
        ProtocolChoice::Variant{i, "loss_" + std::to_string(i), {}, i == 1 ? std::optional(0.25) : std::nullopt};
  {
    Record record(folder.path() / "record.sqlite", experiment);
    for (std::size_t i = 0; i < 2; ++i) {
      const Job job{i, i, Seed{5}};
      Numbers numbers{2, 1, {}, {}, {}};
      record.begin_run(job, kScalar);
      record.add(job, numbers.at(3));
      record.end_run({job, {}, 0.0}, {{"bias", 0.5}, {"never", std::numeric_limits<double>::quiet_NaN()}});
    }
    Summary summary;
    summary.trace_hash = 0xabc;
    summary.metrics = {{"kalman_consensus.loss_0.bias", 0.5}};
    summary.criteria = {{"bias < 1", true, 0.5}};
    record.conclude(summary);
  }
  Database database(folder.path() / "record.sqlite", Database::Open::read);
  EXPECT_EQ(number(database, "PRAGMA user_version"), kRecordFormat);
  EXPECT_EQ(text(database, "SELECT name || '|' || description || '|' || text || mode || seed || '|' || format FROM experiment"),
            "small|A question?|experiment: small\nrealtime5|2");
  EXPECT_EQ(text(database, "SELECT sweep_key || trace_hash || exit || (ended >= began) FROM experiment"), "links.loss0000000000000abc01");
  EXPECT_EQ(number(database, "SELECT complete FROM experiment"), 1);
  EXPECT_EQ(number(database, "SELECT min(complete) FROM runs"), 1);
  EXPECT_EQ(real(database, "SELECT time FROM estimates WHERE run = 0 AND round = 3 AND agent = 1"), 3 * 0.1);
  EXPECT_EQ(number(database, "SELECT sweep_value IS NULL FROM runs WHERE run = 0"), 1);
  EXPECT_EQ(real(database, "SELECT sweep_value FROM runs WHERE run = 1"), 0.25);
  EXPECT_EQ(text(database, "SELECT protocol FROM runs WHERE run = 1"), "kalman_consensus.loss_1");
  EXPECT_EQ(real(database, "SELECT value FROM metrics WHERE run = 1 AND name = 'bias'"), 0.5);
  EXPECT_EQ(number(database, "SELECT count(*) FROM metrics WHERE value IS NULL"), 2) << "what is not a number is NULL";
  EXPECT_EQ(real(database, "SELECT value FROM results WHERE name = 'kalman_consensus.loss_0.bias'"), 0.5);
  EXPECT_EQ(text(database, "SELECT number || text || met || value FROM criteria"), "0bias < 110.5");
}

TEST(Record, SaysWhatDidNotComeToItsEndOrNeverBegan) {
  const ScratchFolder folder;
  const Experiment experiment = experiment_of(2, {"local_voting", "kalman_consensus"});
  {
    Record record(folder.path() / "record.sqlite", experiment);
    record.begin_run({0, 0, Seed{5}}, kScalar);
    record.end_run({{0, 0, Seed{5}}, {}, 0.0, {Ending::signal}}, {{"bias", 0.5}});
    record.begin_run({1, 1, Seed{5}}, kScalar);
    Summary summary;
    summary.complete = false;
    record.conclude(summary);
  }
  Database database(folder.path() / "record.sqlite", Database::Open::read);
  EXPECT_EQ(number(database, "SELECT complete FROM experiment"), 0);
  EXPECT_EQ(number(database, "SELECT count(*) FROM experiment WHERE trace_hash IS NULL AND startup_seconds IS NULL"), 1);
  EXPECT_EQ(number(database, "SELECT count(*) FROM runs WHERE run = 0 AND complete = 0 AND ended IS NULL AND rounds IS NOT NULL"), 1);
  EXPECT_EQ(real(database, "SELECT value FROM metrics WHERE run = 0"), 0.5) << "as far as it came";
  EXPECT_EQ(number(database, "SELECT count(*) FROM runs WHERE run = 1 AND complete IS NULL AND ended IS NULL"), 1);
}

TEST(Record, SaysWhatItsColumnsAre) {
  const ScratchFolder folder;
  Experiment experiment = experiment_of(2, {"kalman_consensus"});
  experiment.plant.emplace().model = "integrator";
  {
    Record record(folder.path() / "record.sqlite", experiment);
    Trace outline = kScalar;
    outline.recorded_layout = {{{"P", 2, 2}}};
    outline.state_layout = {{{"position", 2, 1}}};
    record.begin_run({0, 0, Seed{1}}, outline);
    const std::vector<double> estimates{1, 2}, recorded{10, 11, 12, 13, 20, 21, 22, 23}, states{5, 6, 7, 8};
    const std::vector<std::uint64_t> hashes(2);
    const std::vector<AgentCounters> counters(2);
    record.add({0, 0, Seed{1}}, {0, estimates, hashes, counters, states, hashes, recorded});
  }
  Database database(folder.path() / "record.sqlite", Database::Open::read);
  EXPECT_EQ(text(database, "SELECT x || ' ' || P_1_0 || ' ' || plant_position_1 FROM estimates WHERE agent = 2"), "2.0 21.0 8.0");
  EXPECT_EQ(text(database, "SELECT kind || ' ' || field || ' ' || field_row || ' ' || field_column FROM columns WHERE name = 'P_1_0'"),
            "state P 1 0");
  EXPECT_NE(text(database, "SELECT meaning FROM columns WHERE name = 'P_0_0'").find("covariance"), std::string::npos);
  EXPECT_EQ(text(database, "SELECT kind || ' ' || meaning FROM columns WHERE name = 'x'"), "estimate estimate x_i");
  EXPECT_EQ(text(database, "SELECT meaning FROM columns WHERE name = 'plant_position_0'"),
            "position, true state of the agent's part of the plant integrator");
  EXPECT_EQ(number(database, "SELECT count(*) FROM columns"), 1 + 4 + 2);
}

/// Runs of `rounds` rounds, reported at their ends.
void record_runs(const std::filesystem::path& file, const Experiment& experiment, std::size_t runs) {
  Record record(file, experiment);
  for (std::size_t run = 0; run < runs; ++run) {
    const Job job{run, 0, Seed{run}};
    Numbers numbers{experiment.agents, 1, {}, {}, {}};
    record.begin_run(job, kScalar);
    record.add(job, numbers.at(experiment.rounds));
    record.end_run({job, {}, 0.0});
  }
}

TEST(Record, HoldsTheGraphOfEverySegmentAndEqualGraphsOnce) {
  const ScratchFolder folder;
  Experiment experiment = experiment_of(3, {"local_voting"});
  experiment.rounds = 10;
  const Graph weighted(3, std::vector<WeightedEdge>{{{AgentId{1}, AgentId{2}}, 0.5}});
  experiment.topology = FixedSchedule{{{std::make_shared<const Graph>(ring(3)), 4},
                                       {std::make_shared<const Graph>(weighted), 2},
                                       {std::make_shared<const Graph>(ring(3)), 1}},
                                      false};
  record_runs(folder.path() / "record.sqlite", experiment, 2);
  Database database(folder.path() / "record.sqlite", Database::Open::read);
  EXPECT_EQ(text(database, "SELECT group_concat(first_round || '-' || last_round || ':' || graph, ' ') FROM segments WHERE run = 1"),
            "0-3:0 4-5:1 6-9:0");
  EXPECT_EQ(number(database, "SELECT count(*) FROM segments"), 6);
  EXPECT_EQ(text(database, "SELECT group_concat(sender || '>' || receiver || '*' || weight, ' ') FROM edges WHERE graph = 1"), "1>2*0.5");
  EXPECT_EQ(number(database, "SELECT count(*) FROM edges"), 7);
}

TEST(Record, GraphsThatAreTooManyAreLeftOutAndItSaysSo) {
  const ScratchFolder folder;
  Experiment experiment = experiment_of(600, {"local_voting"});
  experiment.rounds = 3;
  experiment.topology =
      FixedSchedule{{{std::make_shared<const Graph>(ring(600)), 1}, {std::make_shared<const Graph>(complete(600)), 1}}, false};
  record_runs(folder.path() / "some.sqlite", experiment, 1);
  Database some(folder.path() / "some.sqlite", Database::Open::read);
  EXPECT_EQ(number(some, "SELECT count(*) FROM segments"), 1);
  EXPECT_NE(text(some, "SELECT text FROM events WHERE kind = 'record'").find("from round 1 on"), std::string::npos);
  experiment.recording.graphs = true;
  record_runs(folder.path() / "all.sqlite", experiment, 1);
  Database all(folder.path() / "all.sqlite", Database::Open::read);
  EXPECT_EQ(number(all, "SELECT count(*) FROM edges"), 2 * 600 + 600 * 599);
  experiment.recording.graphs = false;
  record_runs(folder.path() / "none.sqlite", experiment, 1);
  Database none(folder.path() / "none.sqlite", Database::Open::read);
  EXPECT_EQ(number(none, "SELECT count(*) FROM segments"), 0);
  EXPECT_EQ(number(none, "SELECT count(*) FROM events"), 0);
}

TEST(Record, OfAnOlderFormatIsExportedAndWhatItsWordsMeantIsSaid) {
  const ScratchFolder folder;
  {
    Database older(folder.path() / "record.sqlite", Database::Open::create);
    older.run(text_of(std::filesystem::path(kSourceDir) / "tests/golden/record_format_1.sql"));
  }
  const Exported exported = export_record(folder.path());
  EXPECT_EQ(exported.format, 1);
  EXPECT_EQ(exported.tables.size(), 7u);
  ASSERT_EQ(exported.remarks.size(), 2u);
  EXPECT_NE(exported.remarks[0].find("trace_hash in runs is of that run alone"), std::string::npos) << exported.remarks[0];
  EXPECT_NE(text_of(folder.path() / "csv" / "runs.csv").find("c37df015d45c30fb"), std::string::npos);
  EXPECT_NE(text_of(folder.path() / "csv" / "estimates.csv").find("\n0,1,3,-3\n"), std::string::npos);
}

TEST(Record, OfANewerFormatOrOfSomebodyElseIsRefused) {
  const ScratchFolder folder;
  for (const auto& [version, words] :
       std::map<int, std::string>{{kRecordFormat + 1, "newer"}, {0, "no record of consort"}, {1, "no record of consort"}}) {
    std::filesystem::remove(folder.path() / "record.sqlite");
    {
      Database other(folder.path() / "record.sqlite", Database::Open::create);
      other.run("CREATE TABLE a (b); PRAGMA user_version = " + std::to_string(version));
    }
    try {
      export_record(folder.path());
      FAIL() << version;
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  }
}

TEST(Record, WhatIsNoDatabaseIsNoRecord) {
  const ScratchFolder folder;
  std::ofstream(folder.path() / "record.sqlite") << std::string(5000, 'x');
  try {
    export_record(folder.path());
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("record.sqlite: is no record of consort"), std::string::npos) << error.what();
  }
}

/// What the page says: by table ("## `runs`"), the columns (rows that begin "| `column` |").
std::map<std::string, std::set<std::string>> described_tables() {
  std::map<std::string, std::set<std::string>> tables;
  std::istringstream page(text_of(std::filesystem::path(kSourceDir) / "docs/guide/record.md"));
  std::string table;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("#")) table = line.starts_with("## `") ? line.substr(4, line.size() - 5) : "";
    if (table.empty() || !line.starts_with("| ")) continue;
    const std::string cell = line.substr(2, line.find(" |") - 2);  // several columns may share a row
    for (std::size_t at = cell.find('`'); at != std::string::npos; at = cell.find('`', at)) {
      const std::size_t end = cell.find('`', at + 1);
      tables[table].insert(cell.substr(at + 1, end - at - 1));
      at = end + 1;
    }
  }
  return tables;
}

TEST(Record, EveryTableAndColumnIsDescribedOnItsPage) {
  const ScratchFolder folder;
  const Experiment experiment = experiment_of(1, {"local_voting"});
  { Record record(folder.path() / "record.sqlite", experiment); }
  Database database(folder.path() / "record.sqlite", Database::Open::read);
  std::map<std::string, std::set<std::string>> tables;
  Statement column =
      database.prepare("SELECT m.name, c.name FROM sqlite_master m JOIN pragma_table_xinfo(m.name) c WHERE m.type = 'table' ORDER BY 1, 2");
  while (column.step()) tables[column.text(0)].insert(column.text(1));
  EXPECT_EQ(tables.size(), 14u);
  EXPECT_EQ(described_tables(), tables);
}

}  // namespace
}  // namespace consort
