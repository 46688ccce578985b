#include "orchestrator/report/study_record.hpp"

#include "core/build.hpp"
#include "orchestrator/report/record_schema.hpp"
#include "orchestrator/report/record_writer.hpp"

#include <limits>

namespace consort {
namespace {

void bind_seed(Statement& statement, int parameter, Seed seed) {
  if (seed.value <= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
    statement.bind(parameter, static_cast<std::int64_t>(seed.value));
  else
    statement.bind(parameter, std::to_string(seed.value));
}

std::string listed_keys(const StudyPlan& plan) {
  std::string text;
  for (const std::string& key : plan.keys) text += (text.empty() ? "" : ", ") + key;
  return text;
}

void write_experiment(Database& database, const StudyPlan& plan, const Summary& summary, const std::string& text) {
  Statement row = database.prepare(
      "INSERT INTO experiment (format, program, name, description, text, mode, seed, runs, agents, rounds, dt, report_every, sweep_key, "
      "began, ended, exit, complete, rounds_per_second, trace_hash, error) "
      "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, 1, ?, ?, ?, ?, ?, ?, ?, ?)");
  row.bind(0, std::int64_t{kRecordFormat});
  int column = 1;
  for (const std::string_view one :
       {kBuild.version, std::string_view(plan.experiment), std::string_view(plan.description), std::string_view(text), name_of(plan.mode)})
    row.bind(column++, one);
  bind_seed(row, column++, summary.seed);
  for (const std::size_t count : {summary.runs, summary.agents, std::size_t{summary.rounds}})
    row.bind(column++, static_cast<std::int64_t>(count));
  row.bind(column++, plan.dt);
  row.bind(column++, listed_keys(plan));
  row.bind(column++, recording::utc_now());
  row.bind(column++, recording::utc_now());
  row.bind(column++, static_cast<std::int64_t>(summary.exit));
  row.bind(column++, std::int64_t{summary.complete});
  row.bind(column++, summary.rounds_per_second);
  if (summary.trace_hash) row.bind(column, hex(*summary.trace_hash));
  if (!summary.error.empty()) row.bind(column + 1, summary.error);
  row.execute();
}

class RunRows {
 public:
  explicit RunRows(Database& database)
      : run_(database.prepare(
            "INSERT INTO runs (run, protocol, sweep_value, seed, agents, began, ended, complete, rounds, converged, seconds, "
            "messages_sent, messages_delivered, messages_lost, run_hash) VALUES (?, ?, ?, ?, ?, ?, ?, 1, ?, ?, ?, ?, ?, ?, ?)")),
        metric_(database.prepare("INSERT INTO metrics VALUES (?, ?, ?)")) {}

  void write(const CellRun& run, std::optional<double> value, const std::string& now) {
    run_.bind(0, number_);
    run_.bind(1, run.protocol);
    run_.bind(2, value.value_or(std::numeric_limits<double>::quiet_NaN()));
    bind_seed(run_, 3, run.seed);
    run_.bind(4, static_cast<std::int64_t>(run.agents));
    run_.bind(5, now);
    run_.bind(6, now);
    run_.bind(7, static_cast<std::int64_t>(run.rounds));
    run_.bind(8, std::int64_t{run.converged});
    run_.bind(9, run.seconds);
    run_.bind(10, static_cast<std::int64_t>(run.totals.sent));
    run_.bind(11, static_cast<std::int64_t>(run.totals.delivered));
    run_.bind(12, static_cast<std::int64_t>(run.totals.lost));
    run_.bind(13, hex(run.trace_hash));
    run_.execute();
    for (const auto& [name, number] : run.metrics) {
      metric_.bind(0, number_);
      metric_.bind(1, name);
      metric_.bind(2, number);
      metric_.execute();
    }
    ++number_;
  }

 private:
  Statement run_, metric_;
  std::int64_t number_ = 0;
};

}  // namespace

void write_study_record(CellStore& store, const StudyPlan& plan, std::span<const std::optional<CellResult>> results, const Summary& summary,
                        const std::string& text) {
  Database& database = store.database();
  database.run("BEGIN; DELETE FROM experiment; DELETE FROM runs; DELETE FROM metrics; DELETE FROM results; DELETE FROM criteria");
  write_experiment(database, plan, summary, text);
  RunRows rows(database);
  const std::string now = recording::utc_now();
  for (std::size_t i = 0; i < results.size(); ++i)
    if (results[i] && results[i]->done())
      for (const CellRun& run : results[i]->runs) rows.write(run, plan.cells[i].cell.number(), now);
  recording::write_results(database, summary);
  database.run("COMMIT");
}

}  // namespace consort
