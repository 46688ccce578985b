"""The results folder of a run."""

import functools
import pathlib
import sqlite3

import numpy as np
import pandas as pd

FORMAT = 2  # the newest format of records that is known here


def _open(record):
    if not record.is_file():
        raise FileNotFoundError(f"{record.parent}: holds no record.sqlite; allowed: an output folder of `consort run`")
    database = sqlite3.connect(record.resolve().as_uri() + "?mode=ro", uri=True)
    try:
        version = database.execute("PRAGMA user_version").fetchone()[0]
        tables = {name for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    except sqlite3.DatabaseError as error:
        database.close()
        raise ValueError(f"{record}: is no record of consort: {error}") from error
    if not 2 <= version <= FORMAT or "estimates" not in tables:
        database.close()
        raise ValueError(f"{record}: found format {version}; allowed: a record of consort of format 2 to {FORMAT}")
    return database


def _quoted(name):
    return '"' + name.replace('"', '""') + '"'


class Results:
    """What a run left. The tables of its record are attributes: runs, agents, columns, results, criteria, segments, edges, links,
    network, processes, events; and metrics, with the protocol, seed and swept value of each run."""

    _TABLES = ("runs", "agents", "columns", "results", "criteria", "segments", "edges", "links", "network", "processes", "events")

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        _open(self.folder / "record.sqlite").close()

    def __repr__(self):
        return f"<Results of {self.experiment['name']}: {self.verdict}, {self.folder}>"

    def __getattr__(self, name):
        if name not in self._TABLES:
            raise AttributeError(f"'Results' has no attribute '{name}'")
        table = self.sql(f"SELECT * FROM {name}")
        setattr(self, name, table)
        return table

    def sql(self, query, parameters=()):
        """Whatever else there is to ask the record, as a DataFrame."""
        database = _open(self.folder / "record.sqlite")
        try:
            return pd.read_sql_query(query, database, params=parameters)
        finally:
            database.close()

    @functools.cached_property
    def experiment(self):
        """The row of the table experiment, as a dict; `text` is the experiment itself, as YAML."""
        row = self.sql("SELECT * FROM experiment")
        return row.iloc[0].to_dict() if len(row) else {"name": self.folder.name, "exit": None}

    @property
    def exit(self):
        """The exit code of `consort run`; None: it was killed, or goes on."""
        code = self.experiment["exit"]
        return None if code is None or pd.isna(code) else int(code)

    @property
    def passed(self):
        return self.exit == 0

    @property
    def verdict(self):
        words = {None: "has not ended", 0: "passed", 1: "not met", 4: "timed out", 130: "interrupted", 143: "interrupted"}
        return words.get(self.exit, "failed")

    @functools.cached_property
    def metrics(self):
        """A row per run and metric: run, protocol, sweep_value, seed, name, value."""
        return self.sql(
            "SELECT m.run, r.protocol, r.sweep_value, r.seed, m.name, m.value FROM metrics m JOIN runs r USING (run) ORDER BY m.run, m.name"
        )

    def metric(self, name):
        """One metric over the runs: a row per protocol and swept value, with count, mean, std, median and quantiles over the seeds."""
        found = self.metrics[self.metrics["name"] == name].copy()
        if found.empty:
            raise KeyError(f"no metric '{name}'; there are {', '.join(sorted(self.metrics['name'].unique()))}")
        if found["sweep_value"].notna().any():  # <protocol>.<value>: the value has a column of its own
            found["protocol"] = found["protocol"].str.split(".", n=1).str[0]
        groups = found.astype({"value": float}).groupby(["protocol", "sweep_value"], dropna=False, sort=True)["value"]
        table = groups.agg(["count", "mean", "std", "median"])
        table["q05"], table["q95"] = groups.quantile(0.05), groups.quantile(0.95)
        return table.reset_index()

    @functools.cached_property
    def estimates(self):
        """Every reported number: run, protocol, seed, round, time, agent, component, value. An agent that is not there has no row."""
        parts = []
        for run in self.runs.itertuples():
            names = self._components(run.protocol)
            table = self.sql(
                f"SELECT round, time, agent{''.join(', ' + _quoted(name) for name in names)} FROM estimates WHERE run = ?"
                " ORDER BY round, agent",
                (int(run.run),),
            )
            part = table.melt(["round", "time", "agent"], names, "component", "value").dropna(subset=["value"])
            part.insert(0, "run", run.run)
            part.insert(1, "protocol", run.protocol)
            part.insert(2, "seed", run.seed)
            parts.append(part)
        if not parts:
            return pd.DataFrame(columns=["run", "protocol", "seed", "round", "time", "agent", "component", "value"])
        return pd.concat(parts, ignore_index=True)

    def _components(self, protocol):
        return list(self.columns[self.columns["protocol"] == protocol]["name"])

    def _protocol(self, run):
        found = self.runs[self.runs["run"] == run]
        if found.empty:
            raise KeyError(f"no run {run}; there are {', '.join(map(str, self.runs['run']))}")
        return found["protocol"].iloc[0]

    def wide(self, component=None, run=0):
        """One component of every agent: indexed by time, a column per agent; NaN where an agent is not there."""
        names = self._components(self._protocol(run))
        component = names[0] if component is None else component
        if component not in names:
            raise KeyError(f"no component '{component}'; there are {', '.join(names)}")
        table = self.sql(f"SELECT time, agent, {_quoted(component)} AS value FROM estimates WHERE run = ?", (int(run),))
        return table.astype({"value": float}).pivot(index="time", columns="agent", values="value")

    def graph(self, round=0, run=0):  # noqa: A002 - it is called so everywhere
        """The network in a round: a networkx.DiGraph, an edge from who sends to who hears, with its weight."""
        import networkx

        self._protocol(run)
        found = self.segments[
            (self.segments["run"] == run) & (self.segments["first_round"] <= round) & (self.segments["last_round"] >= round)
        ]
        if found.empty:
            raise KeyError(f"no graph of round {round} of run {run} is recorded")
        edges = self.edges[self.edges["graph"] == found["graph"].iloc[0]]
        graph = networkx.DiGraph()
        graph.add_nodes_from(range(1, int(self.experiment["agents"]) + 1))
        graph.add_weighted_edges_from(edges[["sender", "receiver", "weight"]].itertuples(index=False, name=None))
        return graph

    def plot(self, component=None, run=0, ax=None, **options):
        """Draws a component of every agent over time; gives the matplotlib axes."""
        from matplotlib import pyplot

        ax = pyplot.gca() if ax is None else ax
        table = self.wide(component, run)
        ax.plot(table.index, table.to_numpy(), **options)
        ax.set_xlabel("time (s)")
        ax.set_ylabel(self._components(self._protocol(run))[0] if component is None else component)
        return ax

    def save_npz(self, file):
        """Every run as numpy arrays: run0_round, run0_time, and run0_<component>, rounds x agents."""
        arrays = {}
        for run in self.runs["run"]:
            for name in self._components(self._protocol(run)):
                table = self.wide(name, run)
                arrays[f"run{run}_{name}"] = table.to_numpy()
                arrays[f"run{run}_time"] = table.index.to_numpy()
            rounds = self.sql("SELECT DISTINCT round FROM estimates WHERE run = ? ORDER BY round", (int(run),))
            arrays[f"run{run}_round"] = rounds["round"].to_numpy()
        np.savez_compressed(file, **arrays)


def load(folder):
    """The results in `folder`. Raises FileNotFoundError or ValueError where there are none."""
    return Results(folder)
