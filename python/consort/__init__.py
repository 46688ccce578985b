"""Runs of Consort, and what they left, as pandas DataFrames.

    import consort
    results = consort.run("experiments/meet_for_dinner.yaml", mode="simulate", seed=3)
    results = consort.load("results/meet_for_dinner-20250131-194500")
    results.estimates              # run, protocol, seed, round, time, agent, component, value
    results.wide("x")              # a column per agent, indexed by time
    results.plot("x")
    results.graph(round=40)        # a networkx.DiGraph

Needs numpy and pandas; matplotlib to plot, networkx for graphs.
"""

from .program import ConsortError, run, sweep
from .results import Results, load

__all__ = ["ConsortError", "Results", "load", "run", "sweep"]
