#include "orchestrator/report/record.hpp"

#include "core/build.hpp"
#include "core/errors.hpp"
#include "orchestrator/report/record_schema.hpp"
#include "orchestrator/report/sqlite.hpp"
#include "protocols/registry.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <ctime>
#include <functional>
#include <future>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <utility>
#include <variant>
#include <vector>

namespace consort {
namespace {

constexpr std::size_t kMaxValues = 1900;                        // SQLite allows 2000 columns
constexpr std::size_t kMaxPendingDoubles = 8u << 20;            // 64 MiB waiting for the disk; beyond that the run waits
constexpr std::size_t kEagerDoubles = kMaxPendingDoubles / 8;   // start writing before the period is over
constexpr std::size_t kCommitDoubles = 1u << 15;                // so that a full disk costs no more than these
constexpr auto kCommitPeriod = std::chrono::milliseconds(100);  // seldom enough to leave the cores to the agents
constexpr std::size_t kMostGraphRows = 100'000;                 // of segments and edges, unless the experiment wants all
constexpr std::size_t kDrawsPerRow = 10;                        // a draw costs as much of a row
constexpr std::size_t kMostGraphsHeld = 64;                     // known by their address, without a look at their edges
constexpr int kLeastPriority = 19;                              // nice value

std::string utc_now() { return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr))); }

std::string hex(std::uint64_t word) { return fmt::format("{:016x}", word); }

/// A column of the table estimates.
struct Column {
  std::string name, kind;
  Field field;
  std::size_t row, column;
  std::string meaning;
};

std::string meaning_in(std::span<const ValueDoc> docs, const std::string& field) {
  const auto doc = std::find_if(docs.begin(), docs.end(), [&](const ValueDoc& each) { return each.name == field; });
  return doc == docs.end() ? field : std::string(doc->meaning);
}

/// One column per number of the layout, usable in SQL without quotes: x; x_0, x_1, ...; P_0_0, P_1_0, ... (column-major).
template <class Meaning>
void add_columns_of(const Layout& layout, const std::string& kind, const std::string& prefix, Meaning&& meaning, std::vector<Column>& out) {
  for (const Field& field : layout.fields) {
    const std::string name = prefix + field.name, text = meaning(field.name);
    for (std::size_t column = 0; column < field.cols; ++column) {
      for (std::size_t row = 0; row < field.rows; ++row) {
        std::string numbered = name;
        if (field.size() > 1) numbered += fmt::format("_{}", row);
        if (field.cols > 1) numbered += fmt::format("_{}", column);
        out.push_back({std::move(numbered), kind, field, row, column, text});
      }
    }
  }
}

/// What each agent of a protocol reports, in the order of its rows.
std::vector<Column> columns_of(const ProtocolChoice& choice, const Experiment& experiment, const RunLayouts& layouts) {
  const auto table = protocol_table();
  const auto entry = std::find_if(table.begin(), table.end(), [&](const ProtocolEntry& each) { return each.name == choice.name; });
  const auto docs = [&](auto docs_of) { return entry == table.end() ? std::span<const ValueDoc>() : (*entry).*docs_of; };
  std::vector<Column> columns;
  add_columns_of(
      layouts.estimate, "estimate", "", [&](const auto& field) { return meaning_in(docs(&ProtocolEntry::estimate), field); }, columns);
  add_columns_of(
      layouts.recorded, "state", "", [&](const auto& field) { return meaning_in(docs(&ProtocolEntry::recorded), field); }, columns);
  const std::string plant = experiment.plant ? experiment.plant->model : "";
  add_columns_of(
      layouts.state, "plant", "plant_",
      [&](const auto& field) { return fmt::format("{}, true state of the agent's part of the plant {}", field, plant); }, columns);
  return columns;
}

struct Begin {
  Job job;
  std::string protocol, at;
  std::vector<Column> columns;
};
struct Rows {
  std::size_t run;
  Round round;
  std::size_t agents, dimension, offset;  // of Batch::values
};
struct Happened {
  std::size_t run;
  Round round;
  std::string kind, text;
};
struct AgentRows {
  std::size_t run;
  std::vector<AgentCounters> counters;
  std::vector<std::uint64_t> hashes;
};
struct End {
  std::size_t run;
  Round rounds;
  bool converged;
  double seconds;
  AgentCounters totals;
  std::uint64_t hash;
  std::string at;  // empty: it did not come to its end
  std::vector<LinkTotals> links;
  std::vector<NetworkTotals> network;
  std::vector<Performance> processes;
  Metrics metrics;
};

/// What waits to be written, in order.
struct Batch {
  std::vector<std::variant<Begin, Rows, Happened, AgentRows, End, Summary>> entries;
  std::vector<double> values;
  void clear() {
    entries.clear();
    values.clear();
  }
};

/// Turns entries into rows. Used by the writer's thread alone.
class Writer {
 public:
  Writer(const std::filesystem::path& file, const Experiment& experiment)
      : experiment_(experiment), database_(file, Database::Open::create) {
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

  /// `committed` is told of the newest rows that are on the disk, also when what follows them fails.
  void write(const Batch& batch, const std::function<void(const Rows&)>& committed) {
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

 private:
  void write(const Begin& begin, const Batch&) {
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
    for (const Column& column : begin.columns) sql += ", " + sql_identifier(column.name);
    sql += ") VALUES (?, ?, ?";
    for (std::size_t i = 0; i < begin.columns.size(); ++i) sql += ", ?";
    insert_estimate_ = database_.prepare(sql + ")");
    if (experiment_.recording.graphs == false) return;
    schedule_.emplace(experiment_.schedule(begin.job.seed));
    if (const auto* random = std::get_if<RandomLinks>(&experiment_.topology)) draws_ = random->base->edges().size();
    next_segment_ = 0;
    write_graphs(begin.job.number, 1);
  }

  void describe_columns(const Begin& begin) {
    Statement row = database_.prepare("INSERT OR IGNORE INTO columns VALUES (?, ?, ?, ?, ?, ?, ?)");
    row.bind(0, begin.protocol);
    for (const Column& column : begin.columns) {
      row.bind(1, column.name);
      row.bind(2, column.kind);
      row.bind(3, column.field.name);
      row.bind(4, static_cast<std::int64_t>(column.row));
      row.bind(5, static_cast<std::int64_t>(column.column));
      row.bind(6, column.meaning);
      row.execute();
    }
  }

  /// The graphs of the rounds before `end`, as far as they are not there yet.
  void write_graphs(std::size_t run, Round end) {
    while (schedule_ && next_segment_ < std::min(end, experiment_.rounds)) {
      const Schedule::Segment segment = schedule_->segment(next_segment_);
      const auto graph = number_of(segment.graph);
      if (!graph) {
        write(Happened{run, next_segment_, "record",
                       fmt::format("the graphs from round {} on are not recorded; `record: {{graphs: true}}` records all", next_segment_)},
              {});
        schedule_.reset();
        return;
      }
      const Round last = std::min(segment.last, experiment_.rounds - 1);
      Statement row = database_.prepare("INSERT INTO segments VALUES (?, ?, ?, ?)");
      row.bind(0, static_cast<std::int64_t>(run));
      row.bind(1, static_cast<std::int64_t>(next_segment_));
      row.bind(2, static_cast<std::int64_t>(last));
      row.bind(3, *graph);
      row.execute();
      graph_rows_ += 1 + draws_ / kDrawsPerRow;
      next_segment_ = last + 1;
    }
  }

  /// Equal graphs have one number; a new one's edges are written. Nothing if that would be too much.
  std::optional<std::int64_t> number_of(const std::shared_ptr<const Graph>& graph) {
    const bool enough = !experiment_.recording.graphs && graph_rows_ >= kMostGraphRows;
    if (const auto known = by_object_.find(graph); known != by_object_.end()) return enough ? std::nullopt : std::optional(known->second);
    const auto edges = graph->edges();
    if (enough || (!experiment_.recording.graphs && graph_rows_ + edges.size() > kMostGraphRows)) return std::nullopt;
    HistoryHash content;
    for (const auto& [edge, weight] : edges) {
      content.mix(std::uint64_t{edge.from.value} << 32 | edge.to.value);
      content.extend(std::span(&weight, 1));
    }
    const auto [known, is_new] = by_content_.try_emplace({content.value(), edges.size()}, static_cast<std::int64_t>(by_content_.size()));
    if (by_object_.size() == kMostGraphsHeld) by_object_.clear();
    by_object_.emplace(graph, known->second);
    if (is_new) write_edges(known->second, edges);
    return known->second;
  }

  void write_edges(std::int64_t graph, const std::vector<WeightedEdge>& edges) {
    Statement row = database_.prepare("INSERT INTO edges VALUES (?, ?, ?, ?)");
    row.bind(0, graph);
    for (const auto& [edge, weight] : edges) {
      row.bind(1, static_cast<std::int64_t>(edge.from.value));
      row.bind(2, static_cast<std::int64_t>(edge.to.value));
      row.bind(3, weight);
      row.execute();
    }
    graph_rows_ += edges.size();
  }

  void write(const Rows& rows, const Batch& batch) {
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

  void write(const Happened& event, const Batch&) {
    Statement insert = database_.prepare("INSERT INTO events (run, round, kind, text) VALUES (?, ?, ?, ?)");
    insert.bind(0, static_cast<std::int64_t>(event.run));
    insert.bind(1, static_cast<std::int64_t>(event.round));
    insert.bind(2, event.kind);
    insert.bind(3, event.text);
    insert.execute();
  }

  void write(const AgentRows& rows, const Batch&) {
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

  void write(const End& end, const Batch&) {
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
    Statement link = database_.prepare("INSERT INTO links VALUES (?, ?, ?, ?, ?, ?, ?, ?)");
    link.bind(0, static_cast<std::int64_t>(end.run));
    for (const LinkTotals& totals : end.links) {
      link.bind(1, static_cast<std::int64_t>(totals.edge.from.value));
      link.bind(2, static_cast<std::int64_t>(totals.edge.to.value));
      link.bind(3, static_cast<std::int64_t>(totals.delivered));
      link.bind(4, static_cast<std::int64_t>(totals.lost));
      link.bind(5, static_cast<std::int64_t>(totals.duplicated));
      link.bind(6, static_cast<std::int64_t>(totals.reordered));
      link.bind(7, static_cast<std::int64_t>(totals.superseded));
      link.execute();
    }
    write_network(end);
    write_processes(end);
    Statement metric = database_.prepare("INSERT INTO metrics VALUES (?, ?, ?)");
    metric.bind(0, static_cast<std::int64_t>(end.run));
    for (const auto& [name, value] : end.metrics) {
      metric.bind(1, name);
      metric.bind(2, value);
      metric.execute();
    }
  }

  void write(const Summary& summary, const Batch&) {
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
    Statement result = database_.prepare("INSERT INTO results VALUES (?, ?)");
    for (const auto& [name, value] : summary.metrics) {
      result.bind(0, name);
      result.bind(1, value);
      result.execute();
    }
    Statement criterion = database_.prepare("INSERT INTO criteria VALUES (?, ?, ?, ?)");
    for (std::size_t i = 0; i < summary.criteria.size(); ++i) {
      criterion.bind(0, static_cast<std::int64_t>(i));
      criterion.bind(1, summary.criteria[i].text);
      if (summary.complete) criterion.bind(2, std::int64_t{summary.criteria[i].met});
      criterion.bind(3, summary.criteria[i].value);
      criterion.execute();
    }
  }

  void write_network(const End& end) {
    Statement row = database_.prepare("INSERT INTO network VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)");
    for (const auto& [edge, c] : end.network) {
      int column = 0;
      for (const std::uint64_t value : {std::uint64_t{end.run}, std::uint64_t{edge.from.value}, std::uint64_t{edge.to.value}, c.sent,
                                        c.received, c.lost, c.late, c.duplicated, c.reordered})
        row.bind(column++, static_cast<std::int64_t>(value));
      row.execute();
    }
  }

  void write_processes(const End& end) {
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

  /// Several protocols share the table: each brings the columns that are not there yet; the others' stay NULL in its rows.
  void add_columns(const std::vector<Column>& columns) {
    for (const Column& column : columns)
      if (columns_.insert(column.name).second) database_.run("ALTER TABLE estimates ADD COLUMN " + sql_identifier(column.name) + " REAL");
  }

  static void bind_seed(Statement& statement, int parameter, Seed seed) {
    if (seed.value <= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
      statement.bind(parameter, static_cast<std::int64_t>(seed.value));
    else
      statement.bind(parameter, std::to_string(seed.value));
  }

  static void bind_counters(Statement& statement, int first, const AgentCounters& counters) {
    statement.bind(first, static_cast<std::int64_t>(counters.sent));
    statement.bind(first + 1, static_cast<std::int64_t>(counters.delivered));
    statement.bind(first + 2, static_cast<std::int64_t>(counters.lost));
  }

  const Experiment& experiment_;
  Database database_;
  std::optional<Statement> insert_estimate_;
  std::set<std::string> columns_;
  std::optional<Schedule> schedule_;  // of the run that is going on; nothing where its graphs are not recorded, or not any more
  Round next_segment_ = 0;
  std::map<std::shared_ptr<const Graph>, std::int64_t> by_object_;
  std::map<std::pair<std::uint64_t, std::size_t>, std::int64_t> by_content_;  // by hash and number of edges
  std::size_t graph_rows_ = 0;                                                // of segments and edges
  std::size_t draws_ = 0;                                                     // that it takes to find the graph of a segment
};

}  // namespace

struct Record::Impl {
  Impl(const std::filesystem::path& file, const Experiment& about) : experiment(about), writer(file, about) {
    // The task's future carries the writer's failure to whoever asks next.
    finished = std::async(std::launch::async, [this] { write_until_closed(); }).share();
  }

  ~Impl() {
    {
      const std::lock_guard lock(mutex);
      hand_over_agents();
      closing = true;
    }
    wake.notify_all();
    finished.wait();
  }

  void write_until_closed() {
    // Whoever waits must learn that nobody writes any more, also when an exception ends this thread.
    struct Stopped {
      Impl& impl;
      ~Stopped() {
        const std::lock_guard lock(impl.mutex);
        impl.stopped = true;
        impl.progress.notify_all();
      }
    } stopped_on_return{*this};
    // The record takes what the agents leave of the cores: it has a quarter of a second and more for what agents wait microseconds for.
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kLeastPriority);
    Batch batch;
    for (;;) {
      {
        std::unique_lock lock(mutex);
        wake.wait_for(lock, kCommitPeriod, [&] { return closing || urgent || pending.values.size() >= kEagerDoubles; });
        if (closing && pending.entries.empty()) return;
        urgent = false;
        std::swap(batch, pending);
      }
      progress.notify_all();
      const auto keep_newest = [this](const Rows& rows) {
        const std::lock_guard lock(mutex);
        newest = std::pair(rows.run, rows.round);
      };
      if (!batch.entries.empty()) writer.write(batch, keep_newest);
      const std::lock_guard lock(mutex);
      committed += batch.entries.size();
      batch.clear();
      progress.notify_all();
    }
  }

  template <class Entry>
  void hand_over(Entry&& entry) {  // call with the mutex held
    pending.entries.emplace_back(std::forward<Entry>(entry));
    ++handed;
  }

  /// Counts of the run that is going on; they are written when it ends, and on closing if it never does. Call with the mutex held.
  void hand_over_agents() {
    if (current.counters.empty()) return;
    pending.entries.emplace_back(std::move(current));
    ++handed;
    current = {};
  }

  std::unique_lock<std::mutex> lock_for_writing() {
    std::unique_lock lock(mutex);
    progress.wait(lock, [&] { return stopped || pending.values.size() < kMaxPendingDoubles; });
    rethrow_failure();
    return lock;
  }

  void rethrow_failure() {
    if (stopped) finished.get();
  }

  const Experiment& experiment;
  Writer writer;
  std::mutex mutex;
  std::condition_variable wake, progress;
  Batch pending;
  AgentRows current{};
  std::uint64_t handed = 0, committed = 0;
  std::optional<std::pair<std::size_t, Round>> newest;  // run and round of the newest report that is on the disk
  bool closing = false, urgent = false, stopped = false;
  std::shared_future<void> finished;
};

Record::Record(const std::filesystem::path& file, const Experiment& experiment) : impl_(std::make_unique<Impl>(file, experiment)) {}
Record::~Record() = default;

void Record::begin_run(const Job& job, const RunLayouts& layouts) {
  const Experiment& experiment = impl_->experiment;
  const ProtocolChoice& choice = experiment.protocols.at(job.protocol);
  std::vector<Column> columns = columns_of(choice, experiment, layouts);
  if (columns.size() > kMaxValues)
    throw RunError(fmt::format("the record holds at most {} named values per agent; {} has {}{}", kMaxValues, choice.title(),
                               columns.size(), experiment.recording.state == true ? "; allowed: without `record: {state: true}`" : ""));
  const auto lock = impl_->lock_for_writing();
  impl_->hand_over_agents();
  impl_->current.run = job.number;
  impl_->hand_over(Begin{job, choice.title(), utc_now(), std::move(columns)});
}

void Record::add(const Job& job, const RoundReport& report) {
  const auto lock = impl_->lock_for_writing();
  const std::size_t agents = report.counters.size();
  auto& values = impl_->pending.values;
  const std::array parts{report.estimates, report.recorded, report.states};
  std::size_t width = 0;
  for (const auto& part : parts) width += agents == 0 ? 0 : part.size() / agents;
  impl_->hand_over(Rows{job.number, report.k, agents, width, values.size()});
  for (std::size_t i = 0; i < agents; ++i) {
    for (const auto& part : parts) {
      const auto of_agent = part.subspan(i * (part.size() / agents), part.size() / agents);
      values.insert(values.end(), of_agent.begin(), of_agent.end());
    }
  }
  impl_->current.counters.assign(report.counters.begin(), report.counters.end());
  impl_->current.hashes.assign(report.hashes.begin(), report.hashes.end());
  if (values.size() >= kEagerDoubles) impl_->wake.notify_one();
}

void Record::event(const Job& job, Round round, const std::string& kind, const std::string& text) {
  const auto lock = impl_->lock_for_writing();
  impl_->hand_over(Happened{job.number, round, kind, text});
}

void Record::end_run(const JobOutcome& outcome, const Metrics& metrics) {
  const auto lock = impl_->lock_for_writing();
  impl_->hand_over_agents();
  const Trace& trace = outcome.trace;
  impl_->hand_over(End{outcome.job.number, trace.last_round, trace.converged, outcome.seconds, trace.totals, trace.hash,
                       is_complete(outcome.end.ending) ? utc_now() : std::string(), trace.links, trace.network, trace.processes, metrics});
}

void Record::conclude(const Summary& summary) {
  const auto lock = impl_->lock_for_writing();
  impl_->hand_over_agents();
  impl_->hand_over(summary);
}

std::string Record::saved() const {
  const std::lock_guard lock(impl_->mutex);
  if (!impl_->newest) return "no report";
  const auto [run, round] = *impl_->newest;
  return fmt::format("the reports up to round {}{}", round, run == 0 ? std::string() : fmt::format(" of run {}", run));
}

void Record::flush() {
  std::unique_lock lock(impl_->mutex);
  const std::uint64_t mark = impl_->handed;
  impl_->urgent = true;
  impl_->wake.notify_all();
  impl_->progress.wait(lock, [&] { return impl_->stopped || impl_->committed >= mark; });
  impl_->rethrow_failure();
}

}  // namespace consort
