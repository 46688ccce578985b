#include "orchestrator/report/record_writer.hpp"

#include "core/build.hpp"
#include "orchestrator/report/record_schema.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <limits>
#include <string_view>

namespace consort::recording {
namespace {

constexpr std::size_t kCommitDoubles = 1u << 15;  // so that a full disk costs no more than these

std::string hex(std::uint64_t word) { return fmt::format("{:016x}", word); }

void bind_seed(Statement& statement, int parameter, Seed seed) {
  if (seed.value <= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
    statement.bind(parameter, static_cast<std::int64_t>(seed.value));
  else
    statement.bind(parameter, std::to_string(seed.value));
}

void bind_counters(Statement& statement, int first, const AgentCounters& counters) {
  statement.bind(first, static_cast<std::int64_t>(counters.sent));
  statement.bind(first + 1, static_cast<std::int64_t>(counters.delivered));
  statement.bind(first + 2, static_cast<std::int64_t>(counters.lost));
}

}  // namespace

std::string utc_now() { return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr))); }

Writer::Writer(const std::filesystem::path& file, const Experiment& experiment)
    : experiment_(experiment), database_(file, Database::Open::create), graphs_(database_, experiment) {
  database_.run(record_schema(experiment_.dt));
  Statement row = database_.prepare(
      "INSERT INTO experiment (format, program, name, description, text, mode, seed, runs, agents, rounds, dt, report_every, plant, "
      "sweep_key, began) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  row.bind(0, std::int64_t{kRecordFormat});
  int column = 1;
  for (const std::string_view text : {kBuild.version, std::string_view(experiment_.name), std::string_view(experiment_.description),
                                      std::string_view(experiment_.resolved_text), name_of(experiment_.mode)})
    row.bind(column++, text);
  bind_seed(row, column++, experiment_.seed);
  for (const std::size_t count : {experiment_.runs, experiment_.agents, std::size_t{experiment_.rounds}})
    row.bind(column++, static_cast<std::int64_t>(count));
  row.bind(column++, experiment_.dt);
  row.bind(column++, static_cast<std::int64_t>(experiment_.report_interval()));
  if (experiment_.plant) row.bind(column, experiment_.plant->model);
  if (!experiment_.sweep_key.empty()) row.bind(column + 1, experiment_.sweep_key);
  row.bind(column + 2, utc_now());
  row.execute();
}

void Writer::write(const Batch& batch, const std::function<void(const Rows&)>& committed) {
  const Rows* newest = nullptr;
  std::size_t since = 0;  // offset of what is not committed yet
  const auto commit = [&] {
    database_.run("COMMIT");
    if (newest) committed(*newest);
  };
  database_.run("BEGIN");
  for (const auto& entry : batch.entries) {
    std::visit([&](const auto& e) { write(e, batch); }, entry);
    const Rows* rows = std::get_if<Rows>(&entry);
    if (!rows) continue;
    newest = rows;
    if (rows->offset - since < kCommitDoubles) continue;
    commit();
    since = rows->offset;
    database_.run("BEGIN");
  }
  commit();
}

void Writer::write(const Begin& begin, const Batch&) {
  add_columns(begin.columns);
  const ProtocolChoice& choice = experiment_.protocols[begin.job.protocol];
  Statement run = database_.prepare("INSERT INTO runs (run, protocol, sweep_value, seed, agents, began) VALUES (?, ?, ?, ?, ?, ?)");
  run.bind(0, static_cast<std::int64_t>(begin.job.number));
  run.bind(1, begin.protocol);
  if (choice.variant && choice.variant->value) run.bind(2, *choice.variant->value);
  bind_seed(run, 3, begin.job.seed);
  run.bind(4, static_cast<std::int64_t>(experiment_.agents));
  run.bind(5, begin.at);
  run.execute();
  Statement agent = database_.prepare("INSERT INTO agents (run, agent) VALUES (?, ?)");
  agent.bind(0, static_cast<std::int64_t>(begin.job.number));
  for (std::size_t i = 0; i < experiment_.agents; ++i) {
    agent.bind(1, static_cast<std::int64_t>(i + 1));
    agent.execute();
  }
  describe_columns(begin);
  std::string sql = "INSERT INTO estimates (run, round, agent";
  for (const RecordColumn& column : begin.columns) sql += ", " + sql_identifier(column.name);
  sql += ") VALUES (?, ?, ?";
  for (std::size_t i = 0; i < begin.columns.size(); ++i) sql += ", ?";
  insert_estimate_ = database_.prepare(sql + ")");
  graphs_.begin_run(begin.job);
  write_graphs(begin.job.number, 1);
}

void Writer::describe_columns(const Begin& begin) {
  Statement row = database_.prepare("INSERT OR IGNORE INTO columns VALUES (?, ?, ?, ?, ?, ?, ?)");
  row.bind(0, begin.protocol);
  for (const RecordColumn& column : begin.columns) {
    row.bind(1, column.name);
    row.bind(2, column.kind);
    row.bind(3, column.field.name);
    row.bind(4, static_cast<std::int64_t>(column.row));
    row.bind(5, static_cast<std::int64_t>(column.column));
    row.bind(6, column.meaning);
    row.execute();
  }
}

void Writer::write_graphs(std::size_t run, Round end) {
  if (const auto missing_from = graphs_.write(run, end))
    write(Happened{run, *missing_from, "record",
                   fmt::format("the graphs from round {} on are not recorded; `record: {{graphs: true}}` records all", *missing_from)},
          {});
}

void Writer::write(const Rows& rows, const Batch& batch) {
  insert_estimate_->bind(0, static_cast<std::int64_t>(rows.run));
  insert_estimate_->bind(1, static_cast<std::int64_t>(rows.round));
  const double* value = batch.values.data() + rows.offset;
  for (std::size_t agent = 1; agent <= rows.agents; ++agent) {
    insert_estimate_->bind(2, static_cast<std::int64_t>(agent));
    for (std::size_t i = 0; i < rows.dimension; ++i) insert_estimate_->bind(static_cast<int>(3 + i), *value++);
    insert_estimate_->execute();
  }
  write_graphs(rows.run, rows.round);
}

void Writer::write(const Happened& event, const Batch&) {
  Statement insert = database_.prepare("INSERT INTO events (run, round, kind, text) VALUES (?, ?, ?, ?)");
  insert.bind(0, static_cast<std::int64_t>(event.run));
  insert.bind(1, static_cast<std::int64_t>(event.round));
  insert.bind(2, event.kind);
  insert.bind(3, event.text);
  insert.execute();
}

void Writer::write(const AgentRows& rows, const Batch&) {
  Statement update = database_.prepare(
      "UPDATE agents SET messages_sent = ?, messages_delivered = ?, messages_lost = ?, history_hash = ? WHERE run = ? AND agent = ?");
  for (std::size_t i = 0; i < rows.counters.size(); ++i) {
    bind_counters(update, 0, rows.counters[i]);
    update.bind(3, hex(rows.hashes[i]));
    update.bind(4, static_cast<std::int64_t>(rows.run));
    update.bind(5, static_cast<std::int64_t>(i + 1));
    update.execute();
  }
}

// Run, sender, receiver, then what was counted, in the order in which the counters name it.
template <class Counters>
void Writer::write_links(std::size_t run, const std::vector<OfLink<Counters>>& links, const char* insert) {
  Statement row = database_.prepare(insert);
  for (const auto& link : links) {
    int column = 0;
    const auto put = [&](const auto&... values) { (row.bind(column++, static_cast<std::int64_t>(values)), ...); };
    put(run, link.edge.from.value, link.edge.to.value);
    std::apply(put, Counters::fields(link.counters));
    row.execute();
  }
}

void Writer::write(const End& end, const Batch&) {
  Statement update = database_.prepare(
      "UPDATE runs SET messages_sent = ?, messages_delivered = ?, messages_lost = ?, ended = ?, rounds = ?, converged = ?, seconds = ?, "
      "run_hash = ?, complete = ? WHERE run = ?");
  bind_counters(update, 0, end.totals);
  if (!end.at.empty()) update.bind(3, end.at);
  update.bind(4, static_cast<std::int64_t>(end.rounds));
  update.bind(5, static_cast<std::int64_t>(end.converged));
  update.bind(6, end.seconds);
  update.bind(7, hex(end.hash));
  update.bind(8, std::int64_t{!end.at.empty()});
  update.bind(9, static_cast<std::int64_t>(end.run));
  update.execute();
  write_links(end.run, end.links, "INSERT INTO links VALUES (?, ?, ?, ?, ?, ?, ?, ?)");
  write_links(end.run, end.network, "INSERT INTO network VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)");
  write_processes(end);
  Statement metric = database_.prepare("INSERT INTO metrics VALUES (?, ?, ?)");
  metric.bind(0, static_cast<std::int64_t>(end.run));
  for (const auto& [name, value] : end.metrics) {
    metric.bind(1, name);
    metric.bind(2, value);
    metric.execute();
  }
}

void write_results(Database& database, const Summary& summary) {
  Statement result = database.prepare("INSERT INTO results VALUES (?, ?)");
  for (const auto& [name, value] : summary.metrics) {
    result.bind(0, name);
    result.bind(1, value);
    result.execute();
  }
  Statement criterion = database.prepare("INSERT INTO criteria VALUES (?, ?, ?, ?)");
  for (std::size_t i = 0; i < summary.criteria.size(); ++i) {
    criterion.bind(0, static_cast<std::int64_t>(i));
    criterion.bind(1, summary.criteria[i].text);
    if (summary.complete) criterion.bind(2, std::int64_t{summary.criteria[i].met});
    criterion.bind(3, summary.criteria[i].value);
    criterion.execute();
  }
}

void Writer::write(const Summary& summary, const Batch&) {
  Statement end = database_.prepare(
      "UPDATE experiment SET ended = ?, exit = ?, error = ?, trace_hash = ?, startup_seconds = ?, rounds_per_second = ?, complete = ?");
  end.bind(0, utc_now());
  end.bind(1, static_cast<std::int64_t>(summary.exit));
  if (!summary.error.empty()) end.bind(2, summary.error);
  if (summary.trace_hash) end.bind(3, hex(*summary.trace_hash));
  if (summary.startup_seconds) end.bind(4, *summary.startup_seconds);
  end.bind(5, summary.rounds_per_second);
  end.bind(6, std::int64_t{summary.complete});
  end.execute();
  write_results(database_, summary);
}

void Writer::write_processes(const End& end) {
  Statement row = database_.prepare("INSERT INTO processes VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  for (const Performance& p : end.processes) {
    int column = 0;
    for (const std::uint64_t value : {std::uint64_t{end.run}, std::uint64_t{p.process}, p.periods, p.missed_deadlines, p.missed_inputs})
      row.bind(column++, static_cast<std::int64_t>(value));
    for (const double value : {p.jitter_p50, p.jitter_p99, p.jitter_max, p.cpu}) row.bind(column++, value);
    for (const std::uint64_t value : {p.resident_bytes, p.sent_again_bytes, p.dds_deadlines_missed, p.liveliness_lost})
      row.bind(column++, static_cast<std::int64_t>(value));
    row.execute();
  }
}

// Several protocols share the table: each brings the columns that are not there yet; the others' stay NULL in its rows.
void Writer::add_columns(const std::vector<RecordColumn>& columns) {
  for (const RecordColumn& column : columns)
    if (columns_.insert(column.name).second) database_.run("ALTER TABLE estimates ADD COLUMN " + sql_identifier(column.name) + " REAL");
}

}  // namespace consort::recording
