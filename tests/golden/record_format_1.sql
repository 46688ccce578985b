PRAGMA user_version = 1;
BEGIN TRANSACTION;
CREATE TABLE agents (            -- one row per run and agent; counts up to the last reported round
  run INTEGER NOT NULL, agent INTEGER NOT NULL,
  messages_sent INTEGER,         -- one per out-neighbour and round
  messages_delivered INTEGER,    -- given to the protocol
  messages_lost INTEGER,         -- dropped by the link model
  history_hash TEXT,             -- over all rounds of this agent
  PRIMARY KEY (run, agent)
) WITHOUT ROWID;
INSERT INTO "agents" VALUES(0,1,4,6,0,'2781a83c74304974');
INSERT INTO "agents" VALUES(0,2,6,4,0,'988569bf97a677b1');
INSERT INTO "agents" VALUES(0,3,6,6,0,'2b9401b97d92e402');
INSERT INTO "agents" VALUES(1,1,4,6,0,'2581eaae36ab8779');
INSERT INTO "agents" VALUES(1,2,6,4,0,'b9b4aa21b7fce2c7');
INSERT INTO "agents" VALUES(1,3,6,6,0,'ccb850beb1182725');
CREATE TABLE estimates (         -- one row per run, reported round and agent; then a column per named value: x, or x_0, x_1, or P_0_0, ...,
                                 -- and plant_position, ... for the true state of the agent's part of the plant; NULL: not there
  run INTEGER NOT NULL, round INTEGER NOT NULL, agent INTEGER NOT NULL, "x" REAL,
  PRIMARY KEY (run, round, agent)
) WITHOUT ROWID;
INSERT INTO "estimates" VALUES(0,0,1,1.0);
INSERT INTO "estimates" VALUES(0,0,2,2.0);
INSERT INTO "estimates" VALUES(0,0,3,6.0);
INSERT INTO "estimates" VALUES(0,1,1,7.0);
INSERT INTO "estimates" VALUES(0,1,2,5.0);
INSERT INTO "estimates" VALUES(0,1,3,-3.0);
INSERT INTO "estimates" VALUES(0,2,1,-5.0);
INSERT INTO "estimates" VALUES(0,2,2,-3.0);
INSERT INTO "estimates" VALUES(0,2,3,15.0);
INSERT INTO "estimates" VALUES(0,3,1,17.0);
INSERT INTO "estimates" VALUES(0,3,2,15.0);
INSERT INTO "estimates" VALUES(0,3,3,-23.0);
INSERT INTO "estimates" VALUES(1,0,1,1.0);
INSERT INTO "estimates" VALUES(1,0,2,2.0);
INSERT INTO "estimates" VALUES(1,0,3,6.0);
INSERT INTO "estimates" VALUES(1,1,1,3.0);
INSERT INTO "estimates" VALUES(1,1,2,3.0);
INSERT INTO "estimates" VALUES(1,1,3,3.0);
INSERT INTO "estimates" VALUES(1,2,1,3.0);
INSERT INTO "estimates" VALUES(1,2,2,3.0);
INSERT INTO "estimates" VALUES(1,2,3,3.0);
INSERT INTO "estimates" VALUES(1,3,1,3.0);
INSERT INTO "estimates" VALUES(1,3,2,3.0);
INSERT INTO "estimates" VALUES(1,3,3,3.0);
CREATE TABLE events (            -- what happened, in order
  run INTEGER NOT NULL, round INTEGER NOT NULL, kind TEXT NOT NULL, text TEXT NOT NULL
);
INSERT INTO "events" VALUES(0,1,'cut','1 -> 2');
INSERT INTO "events" VALUES(1,1,'cut','1 -> 2');
CREATE TABLE links (             -- one row per run and directed link that agents have told of
  run INTEGER NOT NULL, sender INTEGER NOT NULL, receiver INTEGER NOT NULL,
  delivered INTEGER NOT NULL,    -- given to the protocol
  lost INTEGER NOT NULL,         -- dropped by the link model
  duplicated INTEGER NOT NULL,   -- second copies the link model made
  reordered INTEGER NOT NULL,    -- arrived in a later round than a newer message
  superseded INTEGER NOT NULL,   -- arrived together with the same or a newer message, and not given to the protocol
  PRIMARY KEY (run, sender, receiver)
) WITHOUT ROWID;
INSERT INTO "links" VALUES(0,1,2,1,0,0,0,0);
INSERT INTO "links" VALUES(0,1,3,3,0,0,0,0);
INSERT INTO "links" VALUES(0,2,1,3,0,0,0,0);
INSERT INTO "links" VALUES(0,2,3,3,0,0,0,0);
INSERT INTO "links" VALUES(0,3,1,3,0,0,0,0);
INSERT INTO "links" VALUES(0,3,2,3,0,0,0,0);
INSERT INTO "links" VALUES(1,1,2,1,0,0,0,0);
INSERT INTO "links" VALUES(1,1,3,3,0,0,0,0);
INSERT INTO "links" VALUES(1,2,1,3,0,0,0,0);
INSERT INTO "links" VALUES(1,2,3,3,0,0,0,0);
INSERT INTO "links" VALUES(1,3,1,3,0,0,0,0);
INSERT INTO "links" VALUES(1,3,2,3,0,0,0,0);
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
INSERT INTO "runs" VALUES(0,'local_voting',7,3,'2026-11-29T06:23:30Z','2026-11-29T06:23:30Z',3,0,1.9038e-05,16,16,0,'c37df015d45c30fb');
INSERT INTO "runs" VALUES(1,'kalman_consensus',7,3,'2026-11-29T06:23:30Z','2026-11-29T06:23:30Z',3,0,1.0126e-05,16,16,0,'531e36f82f63c4b8');
COMMIT;
