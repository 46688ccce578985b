#include "orchestrator/record.hpp"

#include "core/errors.hpp"
#include "orchestrator/sqlite.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <ctime>
#include <future>
#include <limits>
#include <mutex>
#include <optional>
#include <variant>
#include <vector>

namespace consort {
namespace {

// Comments inside CREATE TABLE stay in the file: `sqlite3 record.sqlite .schema` explains the record to whoever opens it.
constexpr const char* kSchema = R"sql(
PRAGMA journal_mode = WAL;      -- a crash of the process loses nothing that was committed
PRAGMA synchronous = NORMAL;    -- commits do not wait for the disk; only a power cut may lose the last ones
PRAGMA user_version = 1;
CREATE TABLE runs (              -- one row per protocol and seed
  run INTEGER PRIMARY KEY,       -- 0, 1, ... protocol by protocol, seeds ascending
  protocol TEXT NOT NULL,
  seed NOT NULL,                 -- an integer; a text if it exceeds 63 bits
  agents INTEGER NOT NULL,
  began TEXT NOT NULL,           -- UTC
  ended TEXT,                    -- UTC; NULL: the run did not reach its end
  rounds INTEGER,                -- rounds executed
  converged INTEGER,             -- 1: the stop rule's convergence held
  seconds REAL,                  -- wall clock from round 0 to the last round
  messages_sent INTEGER, messages_delivered INTEGER, messages_lost INTEGER,
  trace_hash TEXT                -- 16 hexadecimal digits over every round of every agent
);
CREATE TABLE agents (            -- one row per run and agent; counts up to the last reported round
  run INTEGER NOT NULL, agent INTEGER NOT NULL,
  messages_sent INTEGER,         -- one per out-neighbour and round
  messages_delivered INTEGER,    -- given to the protocol
  messages_lost INTEGER,         -- dropped by the link model
  history_hash TEXT,             -- over all rounds of this agent
  PRIMARY KEY (run, agent)
) WITHOUT ROWID;
CREATE TABLE estimates (         -- one row per run, reported round and agent; then a column per named value: x, or x_0, x_1, or P_0_0, ...,
                                 -- and plant_position, ... for the true state of the agent's part of the plant; NULL: not there
  run INTEGER NOT NULL, round INTEGER NOT NULL, agent INTEGER NOT NULL,
  PRIMARY KEY (run, round, agent)
) WITHOUT ROWID;
CREATE TABLE links (             -- one row per run and directed link that agents have told of
  run INTEGER NOT NULL, sender INTEGER NOT NULL, receiver INTEGER NOT NULL,
  delivered INTEGER NOT NULL,    -- given to the protocol
  lost INTEGER NOT NULL,         -- dropped by the link model
  duplicated INTEGER NOT NULL,   -- second copies the link model made
  reordered INTEGER NOT NULL,    -- arrived in a later round than a newer message
  superseded INTEGER NOT NULL,   -- arrived together with the same or a newer message, and not given to the protocol
  PRIMARY KEY (run, sender, receiver)
) WITHOUT ROWID;
CREATE TABLE network (           -- real time: what the network did to a link's messages, apart from the link model
  run INTEGER NOT NULL, sender INTEGER NOT NULL, receiver INTEGER NOT NULL,
  sent INTEGER NOT NULL, received INTEGER NOT NULL, lost INTEGER NOT NULL, late INTEGER NOT NULL,
  duplicated INTEGER NOT NULL, reordered INTEGER NOT NULL,
  PRIMARY KEY (run, sender, receiver)
) WITHOUT ROWID;
CREATE TABLE processes (         -- how each process (0: the plant) kept time (in real time), and what it used; times in s
  run INTEGER NOT NULL, process INTEGER NOT NULL,
  periods INTEGER, missed_deadlines INTEGER, missed_inputs INTEGER, jitter_p50 REAL, jitter_p99 REAL, jitter_max REAL,
  cpu REAL, resident_bytes INTEGER, sent_again_bytes INTEGER, dds_deadlines_missed INTEGER, liveliness_lost INTEGER
);
CREATE TABLE events (            -- what happened, in order
  run INTEGER NOT NULL, round INTEGER NOT NULL, kind TEXT NOT NULL, text TEXT NOT NULL
);
)sql";

constexpr std::size_t kMaxValues = 1900;                        // SQLite allows 2000 columns
constexpr std::size_t kMaxPendingDoubles = 8u << 20;            // 64 MiB waiting for the disk; beyond that the run waits
constexpr std::size_t kEagerDoubles = kMaxPendingDoubles / 8;   // start writing before the period is over
constexpr auto kCommitPeriod = std::chrono::milliseconds(100);  // seldom enough to leave the cores to the agents
constexpr int kLeastPriority = 19;                              // nice value

std::string utc_now() { return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr))); }

std::string hex(std::uint64_t word) { return fmt::format("{:016x}", word); }

/// One name per number of the layout, usable in SQL without quotes: x; x_0, x_1, ...; P_0_0, P_1_0, ... (column-major).
std::vector<std::string> column_names(const Layout& layout, const std::string& prefix = "") {
  std::vector<std::string> names;
  for (Field field : layout.fields) {
    field.name.insert(0, prefix);
    for (std::size_t column = 0; column < field.cols; ++column) {
      for (std::size_t row = 0; row < field.rows; ++row) {
        if (field.size() == 1)
          names.push_back(field.name);
        else if (field.cols == 1)
          names.push_back(fmt::format("{}_{}", field.name, row));
        else
          names.push_back(fmt::format("{}_{}_{}", field.name, row, column));
      }
    }
  }
  return names;
}

struct Begin {
  Job job;
  std::string protocol, at;
  std::size_t agents;
  std::vector<std::string> columns;
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
  std::string at;
  std::vector<LinkTotals> links;
  std::vector<NetworkTotals> network;
  std::vector<Performance> processes;
};

/// What waits to be written, in order.
struct Batch {
  std::vector<std::variant<Begin, Rows, Happened, AgentRows, End>> entries;
  std::vector<double> values;
  void clear() {
    entries.clear();
    values.clear();
  }
};

/// Turns entries into rows. Used by the writer's thread alone.
class Writer {
 public:
  explicit Writer(const std::filesystem::path& file) : database_(file, Database::Open::create) { database_.run(kSchema); }

  void write(const Batch& batch) {
    database_.run("BEGIN");
    for (const auto& entry : batch.entries) std::visit([&](const auto& e) { write(e, batch); }, entry);
    database_.run("COMMIT");
  }

 private:
  void write(const Begin& begin, const Batch&) {
    add_columns(begin.columns);
    Statement run = database_.prepare("INSERT INTO runs (run, protocol, seed, agents, began) VALUES (?, ?, ?, ?, ?)");
    run.bind(0, static_cast<std::int64_t>(begin.job.number));
    run.bind(1, begin.protocol);
    if (begin.job.seed.value <= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
      run.bind(2, static_cast<std::int64_t>(begin.job.seed.value));
    else
      run.bind(2, std::to_string(begin.job.seed.value));
    run.bind(3, static_cast<std::int64_t>(begin.agents));
    run.bind(4, begin.at);
    run.execute();
    Statement agent = database_.prepare("INSERT INTO agents (run, agent) VALUES (?, ?)");
    agent.bind(0, static_cast<std::int64_t>(begin.job.number));
    for (std::size_t i = 0; i < begin.agents; ++i) {
      agent.bind(1, static_cast<std::int64_t>(i + 1));
      agent.execute();
    }
    std::string sql = "INSERT INTO estimates (run, round, agent";
    for (const auto& column : begin.columns) sql += ", " + sql_identifier(column);
    sql += ") VALUES (?, ?, ?";
    for (std::size_t i = 0; i < begin.columns.size(); ++i) sql += ", ?";
    insert_estimate_ = database_.prepare(sql + ")");
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
  }

  void write(const Happened& event, const Batch&) {
    Statement insert = database_.prepare("INSERT INTO events VALUES (?, ?, ?, ?)");
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
        "trace_hash = ? WHERE run = ?");
    bind_counters(update, 0, end.totals);
    update.bind(3, end.at);
    update.bind(4, static_cast<std::int64_t>(end.rounds));
    update.bind(5, static_cast<std::int64_t>(end.converged));
    update.bind(6, end.seconds);
    update.bind(7, hex(end.hash));
    update.bind(8, static_cast<std::int64_t>(end.run));
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
  void add_columns(const std::vector<std::string>& columns) {
    for (const auto& column : columns) {
      if (std::find(columns_.begin(), columns_.end(), column) != columns_.end()) continue;
      database_.run("ALTER TABLE estimates ADD COLUMN " + sql_identifier(column) + " REAL");
      columns_.push_back(column);
    }
  }

  static void bind_counters(Statement& statement, int first, const AgentCounters& counters) {
    statement.bind(first, static_cast<std::int64_t>(counters.sent));
    statement.bind(first + 1, static_cast<std::int64_t>(counters.delivered));
    statement.bind(first + 2, static_cast<std::int64_t>(counters.lost));
  }

  Database database_;
  std::optional<Statement> insert_estimate_;
  std::vector<std::string> columns_;
};

}  // namespace

struct Record::Impl {
  explicit Impl(const std::filesystem::path& file) : writer(file) {
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
      if (!batch.entries.empty()) writer.write(batch);
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

  Writer writer;
  std::mutex mutex;
  std::condition_variable wake, progress;
  Batch pending;
  AgentRows current{};
  std::uint64_t handed = 0, committed = 0;
  bool closing = false, urgent = false, stopped = false;
  std::shared_future<void> finished;
};

Record::Record(const std::filesystem::path& file) : impl_(std::make_unique<Impl>(file)) {}
Record::~Record() = default;

void Record::begin_run(const Job& job, const Experiment& experiment, const RunLayouts& layouts) {
  const std::string protocol = experiment.protocols.at(job.protocol).title();
  const std::size_t size = layouts.estimate.size() + layouts.state.size();
  if (size > kMaxValues)
    throw RunError(fmt::format("the record holds at most {} named values per agent; {} has {}", kMaxValues, protocol, size));
  const auto lock = impl_->lock_for_writing();
  impl_->hand_over_agents();
  impl_->current.run = job.number;
  std::vector<std::string> columns = column_names(layouts.estimate);
  const std::vector<std::string> of_plant = column_names(layouts.state, "plant_");
  columns.insert(columns.end(), of_plant.begin(), of_plant.end());
  impl_->hand_over(Begin{job, protocol, utc_now(), experiment.agents, std::move(columns)});
}

void Record::add(const Job& job, const RoundReport& report) {
  const auto lock = impl_->lock_for_writing();
  const std::size_t agents = report.counters.size();
  auto& values = impl_->pending.values;
  const std::size_t of_agent = agents == 0 ? 0 : report.estimates.size() / agents,
                    of_plant = agents == 0 ? 0 : report.states.size() / agents;
  impl_->hand_over(Rows{job.number, report.k, agents, of_agent + of_plant, values.size()});
  for (std::size_t i = 0; i < agents; ++i) {
    const auto estimate = report.estimates.subspan(i * of_agent, of_agent), state = report.states.subspan(i * of_plant, of_plant);
    values.insert(values.end(), estimate.begin(), estimate.end());
    values.insert(values.end(), state.begin(), state.end());
  }
  impl_->current.counters.assign(report.counters.begin(), report.counters.end());
  impl_->current.hashes.assign(report.hashes.begin(), report.hashes.end());
  if (values.size() >= kEagerDoubles) impl_->wake.notify_one();
}

void Record::event(const Job& job, Round round, const std::string& kind, const std::string& text) {
  const auto lock = impl_->lock_for_writing();
  impl_->hand_over(Happened{job.number, round, kind, text});
}

void Record::end_run(const JobOutcome& outcome) {
  const auto lock = impl_->lock_for_writing();
  impl_->hand_over_agents();
  const Trace& trace = outcome.trace;
  impl_->hand_over(End{outcome.job.number, trace.last_round, trace.converged, outcome.seconds, trace.totals, trace.hash, utc_now(),
                       trace.links, trace.network, trace.processes});
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
