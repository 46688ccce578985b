#!/usr/bin/env python3
"""A figure for a paper: what lost messages cost two unbiased estimators (experiments/mdkc_loss.yaml), over many seeds.

    python/examples/loss_figure.py experiments/mdkc_loss.yaml loss.svg
"""

import argparse

import matplotlib

matplotlib.use("Agg")
import consort
from matplotlib import pyplot

options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
options.add_argument("study", help="experiments/mdkc_loss.yaml, or the folder of its results")
options.add_argument("figure", help="the file to write: .svg, .pdf, .png")
options.add_argument("--runs", type=int, help="seeds per value; the study's own otherwise")
chosen = options.parse_args()

if chosen.study.endswith(".yaml"):
    results = consort.run(chosen.study, mode="simulate", runs=chosen.runs)
else:
    results = consort.load(chosen.study)

pyplot.rcParams.update({"font.size": 8, "axes.spines.top": False, "axes.spines.right": False, "svg.hashsalt": "consort"})
figure, (left, right) = pyplot.subplots(1, 2, figsize=(6.2, 2.4), layout="constrained")
for name, protocol in results.metric("bias").groupby("protocol"):
    label = name.replace("_", " ")
    (line,) = left.plot(protocol["sweep_value"], protocol["median"], marker="o", markersize=3)
    left.fill_between(protocol["sweep_value"], protocol["q05"], protocol["q95"], color=line.get_color(), alpha=0.2, linewidth=0)
    right.plot(protocol["sweep_value"], protocol["std"], marker="o", markersize=3, label=label)
left.set(xlabel="share of messages lost", ylabel="bias: median, 5 to 95 %")
right.set(xlabel="share of messages lost", ylabel="standard deviation of the bias")
right.legend(frameon=False, loc=(0.2, 0.12))
figure.savefig(chosen.figure, metadata={"Date": None} if chosen.figure.endswith(".svg") else None)
