#include "orchestrator/report/record_schema.hpp"

#include "core/errors.hpp"

#include <fmt/format.h>

namespace consort {
namespace {

// Comments inside CREATE TABLE stay in the file: `sqlite3 record.sqlite .schema` explains the record to whoever opens it.
constexpr const char* kTables = R"sql(
PRAGMA journal_mode = WAL;      -- a crash of the process loses nothing that was committed
PRAGMA synchronous = NORMAL;    -- commits do not wait for the disk; only a power cut may lose the last ones
PRAGMA user_version = {format};
CREATE TABLE experiment (        -- one row: what was to be run and, at the end, what came of it
  format INTEGER NOT NULL,       -- of this record, as PRAGMA user_version
  program TEXT NOT NULL,         -- version of consort that wrote it
  name TEXT NOT NULL,            -- of the experiment
  description TEXT NOT NULL,     -- comment at the head of its file
  text TEXT NOT NULL,            -- the experiment, resolved, as YAML; can be run again
  mode TEXT NOT NULL,            -- simulate, lockstep or realtime
  seed NOT NULL,                 -- of the first run of each protocol; an integer, a text if it exceeds 63 bits
  runs INTEGER NOT NULL,         -- asked for, per protocol and value of the sweep
  agents INTEGER NOT NULL,
  rounds INTEGER NOT NULL,       -- asked for, at most
  dt REAL NOT NULL,              -- s, length of a round
  report_every INTEGER NOT NULL, -- rounds between two reports
  plant TEXT,                    -- model of the plant; NULL: none
  sweep_key TEXT,                -- what is swept; NULL: nothing
  began TEXT NOT NULL,           -- UTC
  ended TEXT,                    -- UTC; NULL: nobody came to write what follows (the program was killed)
  exit INTEGER,                  -- exit code of consort run
  error TEXT,                    -- why it ended early; NULL: it did not
  complete INTEGER,              -- 1: every run came to its end; as in summary.json
  trace_hash TEXT,               -- 16 hexadecimal digits over the run_hash of all runs, in order; as in summary.json; NULL: none began
  startup_seconds REAL,          -- from the call to round 0 of the first run; NULL: none began
  rounds_per_second REAL
);
CREATE TABLE runs (              -- one row per protocol (and value of the sweep) and seed
  run INTEGER PRIMARY KEY,       -- 0, 1, ... protocol by protocol, seeds ascending
  protocol TEXT NOT NULL,        -- of a sweep, with the name of its value: <protocol>.loss_0.1
  sweep_value REAL,              -- the value as a number, durations in s; NULL: no sweep, or not a number
  seed NOT NULL,                 -- an integer; a text if it exceeds 63 bits
  agents INTEGER NOT NULL,
  began TEXT NOT NULL,           -- UTC
  ended TEXT,                    -- UTC; NULL: it did not come to its end (a signal, a failure, a deadline)
  complete INTEGER,              -- 1: it came to its end; 0: it did not, what follows is how far it came; NULL: nobody wrote that
  rounds INTEGER,                -- rounds executed
  converged INTEGER,             -- 1: the stop rule's convergence held
  seconds REAL,                  -- wall clock from round 0 to the last round
  messages_sent INTEGER, messages_delivered INTEGER, messages_lost INTEGER,
  run_hash TEXT                  -- 16 hexadecimal digits over every round of every agent of this run
);
CREATE TABLE agents (            -- one row per run and agent; counts up to the last reported round
  run INTEGER NOT NULL, agent INTEGER NOT NULL,
  messages_sent INTEGER,         -- one per out-neighbour and round
  messages_delivered INTEGER,    -- given to the protocol
  messages_lost INTEGER,         -- dropped by the link model
  history_hash TEXT,             -- over all rounds of this agent
  PRIMARY KEY (run, agent)
) WITHOUT ROWID;
CREATE TABLE estimates (         -- one row per run, reported round and agent; then a column per number, see columns; NULL: not there
  run INTEGER NOT NULL, round INTEGER NOT NULL, agent INTEGER NOT NULL,
  time REAL GENERATED ALWAYS AS (round * {dt}) VIRTUAL, -- s, when the round begins
  PRIMARY KEY (run, round, agent)
) WITHOUT ROWID;
CREATE TABLE columns (           -- what the columns of estimates are, for each protocol of the table runs
  protocol TEXT NOT NULL, name TEXT NOT NULL,
  kind TEXT NOT NULL,            -- estimate; state (what else of its state the protocol has recorded); plant (the true state of its part)
  field TEXT NOT NULL,           -- the number, vector or matrix it is of
  field_row INTEGER NOT NULL, field_column INTEGER NOT NULL, -- where in it, from 0
  meaning TEXT NOT NULL,         -- with unit, where it has one of its own; else that of the initial values
  PRIMARY KEY (protocol, name)
) WITHOUT ROWID;
CREATE TABLE metrics (           -- one row per run and metric (`consort list metrics`)
  run INTEGER NOT NULL, name TEXT NOT NULL,
  value REAL,                    -- NULL: not a number
  PRIMARY KEY (run, name)
) WITHOUT ROWID;
CREATE TABLE results (           -- the metrics over the runs, as the table of results, summary.json and the criteria have them
  name TEXT PRIMARY KEY,         -- <metric>, or <protocol>.<metric> of several; .std, .share: over the runs that have it, their share
  value REAL                     -- mean over the runs that have it; NULL: not a number
) WITHOUT ROWID;
CREATE TABLE criteria (          -- one row per acceptance criterion, in the order of the file
  number INTEGER PRIMARY KEY,    -- 0, 1, ...
  text TEXT NOT NULL,
  met INTEGER,                   -- 1: it holds; NULL: the run is not complete
  value REAL                     -- of the side of its first comparison that names a metric; NULL: not a number
);
CREATE TABLE segments (          -- rounds of a run that have one graph, as scheduled; who was given up meanwhile is in events
  run INTEGER NOT NULL, first_round INTEGER NOT NULL,
  last_round INTEGER NOT NULL,   -- a run may end before
  graph INTEGER NOT NULL,        -- see edges; equal graphs have one number
  PRIMARY KEY (run, first_round)
) WITHOUT ROWID;
CREATE TABLE edges (             -- the edges of each graph
  graph INTEGER NOT NULL, sender INTEGER NOT NULL, receiver INTEGER NOT NULL,
  weight REAL NOT NULL,
  PRIMARY KEY (graph, sender, receiver)
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
  run INTEGER NOT NULL, round INTEGER NOT NULL,
  time REAL GENERATED ALWAYS AS (round * {dt}) VIRTUAL, -- s, when the round begins
  kind TEXT NOT NULL, text TEXT NOT NULL
);
)sql";

}  // namespace

std::string record_schema(Seconds dt) { return fmt::format(fmt::runtime(kTables), fmt::arg("format", kRecordFormat), fmt::arg("dt", dt)); }

int record_format(Database& database, const std::string& file) {
  Statement version = database.prepare("PRAGMA user_version");
  const std::int64_t format = version.step() ? version.integer(0) : 0;
  Statement tables = database.prepare("SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name IN ('runs', 'estimates')");
  const bool ours = format > kRecordFormat || (tables.step() && tables.integer(0) == 2);  // a newer one may have others
  if (format < 1 || !ours)
    throw ConfigError(fmt::format("{}: is no record of consort; allowed: the record.sqlite of an output folder", file));
  if (format > kRecordFormat)
    throw ConfigError(
        fmt::format("{}: found a record of format {}, written by a newer consort; allowed: up to {}, the newest that this one reads", file,
                    format, kRecordFormat));
  return static_cast<int>(format);
}

std::vector<std::string> changes_since(int format) {
  std::vector<std::string> changes;
  if (format < 2) {
    changes.emplace_back(
        "format 1: trace_hash in runs is of that run alone; since format 2 it is called run_hash, and trace_hash in "
        "experiment is over all runs, as in summary.json");
    changes.emplace_back("format 1: holds no experiment, columns, metrics, results, criteria, segments and edges, and no times");
  }
  return changes;
}

}  // namespace consort
