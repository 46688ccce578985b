"""The Python package, with the real program: CONSORT_BIN is the folder it lies in."""

import os
import pathlib
import sqlite3
import subprocess
import sys
import tempfile
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python"))
os.environ.setdefault("MPLBACKEND", "Agg")

import consort  # noqa: E402

PROGRAM = str(pathlib.Path(os.environ.get("CONSORT_BIN", ROOT / "build/release/bin")) / "consort")
RING = """experiment: ring
mode: simulate
seed: 3
rounds: 40
dt: 0.5
agents: {count: 3, protocol: local_voting, initial: {x: [[0, 1], [1, 2], [5, 3]]}}
topology: {edges: [1 -> 2, 2 -> 3, 3 -> 1]}
links: {loss: 0}
events: [{round: 20, leave: [2]}]
criteria: ["disagreement < 100"]
"""


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.scratch.name)
        cls.file = cls.folder / "ring.yaml"
        cls.file.write_text(RING)
        cls.results = consort.run(cls.file, output=cls.folder / "ring", program=PROGRAM)

    @classmethod
    def tearDownClass(cls):
        cls.scratch.cleanup()

    def test_estimates_are_those_of_the_record(self):
        table = self.results.estimates
        self.assertEqual(list(table), ["run", "protocol", "seed", "round", "time", "agent", "component", "value"])
        with sqlite3.connect(self.folder / "ring/record.sqlite") as record:
            rows = record.execute("SELECT round, time, agent, x_0, x_1 FROM estimates").fetchall()
        expected = {(k, t, i, c): v for k, t, i, *x in rows for c, v in zip(("x_0", "x_1"), x) if v is not None}
        found = {row[:4]: row[4] for row in table[["round", "time", "agent", "component", "value"]].itertuples(index=False, name=None)}
        self.assertEqual(found, expected)
        self.assertEqual(len(found), 2 * (3 * 41 - 21), "an agent that has left has no rows")

    def test_wide_has_a_column_per_agent(self):
        table = self.results.wide("x_1")
        self.assertEqual(list(table.columns), [1, 2, 3])
        self.assertEqual(list(table.loc[0.0]), [1.0, 2.0, 3.0])
        self.assertTrue(np.isnan(table.loc[20.0, 2]), "it has left")
        self.assertTrue(self.results.wide().equals(self.results.wide("x_0")))
        with self.assertRaisesRegex(KeyError, "no component 'y'; there are x_0, x_1"):
            self.results.wide("y")
        with self.assertRaisesRegex(KeyError, "no run 7"):
            self.results.wide(run=7)

    def test_graphs_change_with_the_rounds(self):
        self.assertEqual(sorted(self.results.graph().edges), [(1, 2), (2, 3), (3, 1)])
        later = self.results.graph(round=30)
        self.assertEqual(sorted(later.edges), [(3, 1)])
        self.assertEqual(sorted(later.nodes), [1, 2, 3])
        with self.assertRaises(KeyError):
            self.results.graph(round=1000)

    def test_plot_draws_a_curve_per_agent(self):
        axes = self.results.plot("x_0")
        self.assertEqual(len(axes.lines), 3)
        self.assertEqual(list(axes.lines[2].get_ydata())[0], 5.0)

    def test_numpy_reads_what_was_saved(self):
        self.results.save_npz(self.folder / "ring.npz")
        arrays = np.load(self.folder / "ring.npz")
        self.assertEqual(arrays["run0_x_0"].shape, (41, 3))
        self.assertEqual(list(arrays["run0_round"][:3]), [0, 1, 2])
        self.assertEqual(list(arrays["run0_time"][:3]), [0.0, 0.5, 1.0])

    def test_a_sweep_of_any_key_has_a_row_per_value(self):
        file = self.folder / "any.yaml"
        file.write_text(RING[: RING.index("criteria:")])
        results = consort.sweep(file, {"dt": [0.05, 0.1]}, runs=3, output=self.folder / "study", program=PROGRAM)
        self.assertEqual(list(results.metric("disagreement")["sweep_value"]), [0.05, 0.1])
        self.assertEqual(len(results.metrics[results.metrics["name"] == "disagreement"]), 6)

    def test_a_sweep_has_a_row_per_value(self):
        file = self.folder / "swept.yaml"
        file.write_text(RING[: RING.index("criteria:")])
        results = consort.sweep(file, {"links.loss": [0, 0.3]}, runs=3, output=self.folder / "sweep", program=PROGRAM)
        table = results.metric("disagreement")
        self.assertEqual(list(table["sweep_value"]), [0.0, 0.3])
        self.assertEqual(list(table["count"]), [3, 3])
        values = results.metrics[(results.metrics["name"] == "disagreement") & (results.metrics["sweep_value"] == 0.3)]["value"]
        self.assertAlmostEqual(table["mean"].iloc[1], np.mean(values), places=15)
        self.assertEqual([path.name for path in self.folder.glob("swept-*.yaml")], [], "nothing is left beside the file")
        with self.assertRaisesRegex(KeyError, "no metric 'cost'; there are "):
            results.metric("cost")

    def test_verdicts_and_failures(self):
        self.assertTrue(self.results.passed)
        self.file.with_name("strict.yaml").write_text(RING.replace("< 100", "< 0"))
        strict = consort.run(self.file.with_name("strict.yaml"), output=self.folder / "strict", program=PROGRAM)
        self.assertFalse(strict.passed)
        self.assertEqual(strict.verdict, "not met")
        with self.assertRaisesRegex(consort.ConsortError, "nowhere.yaml") as failure:
            consort.run(self.folder / "nowhere.yaml", program=PROGRAM)
        self.assertEqual(failure.exception.exit, 2)

    def test_what_is_no_record_is_refused(self):
        with self.assertRaisesRegex(FileNotFoundError, "holds no record.sqlite"):
            consort.load(self.folder)
        for name, content in (("text", b"no database at all, but long enough to be read as one" * 20), ("empty", b"")):
            (self.folder / name).mkdir()
            (self.folder / name / "record.sqlite").write_bytes(content)
            with self.assertRaises(ValueError):
                consort.load(self.folder / name)

    def test_the_example_makes_its_figure(self):
        study = self.folder / "study.yaml"
        study.write_text(RING[: RING.index("criteria:")].replace("[[0, 1], [1, 2], [5, 3]]", "[0, 1, 5]") + "sweep: {links.loss: [0, 0.2]}\nruns: 2\n")
        environment = {**os.environ, "PATH": f"{pathlib.Path(PROGRAM).parent}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT / "python")}
        example = ROOT / "python/examples/loss_figure.py"
        subprocess.run([sys.executable, example, study, "loss.svg"], cwd=self.folder, env=environment, check=True)
        self.assertIn("share of messages lost", (self.folder / "loss.svg").read_text().replace("<!-- ", ""))


if __name__ == "__main__":
    unittest.main()
