"""The program `consort`, called."""

import json
import pathlib
import subprocess
import tempfile

from .results import load


class ConsortError(RuntimeError):
    """A run that did not come to its end; `exit` is its exit code."""

    def __init__(self, exit_code, text):
        super().__init__(text)
        self.exit = exit_code


def run(file, *, mode=None, seed=None, rounds=None, runs=None, output=None, options=(), program="consort"):
    """Runs an experiment and gives its Results, whether its criteria held (`passed`) or not. Raises ConsortError if the run failed.

    `options`: further options of `consort run`; `program`: where it lies, if not on the path.
    """
    words = [program, "run", str(file), "--quiet", "--json", "--no-report"]
    for name, value in (("mode", mode), ("seed", seed), ("rounds", rounds), ("runs", runs), ("output", output)):
        if value is not None:
            words += [f"--{name}", str(value)]
    done = subprocess.run([*words, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    try:
        summary = json.loads(done.stdout)
    except ValueError:
        summary = {}
    if done.returncode not in (0, 1) or "output" not in summary:
        raise ConsortError(done.returncode, summary.get("error") or done.stderr.strip())
    return load(summary["output"])


def sweep(file, values, **arguments):
    """Runs an experiment once per value of a key, as `sweep` of the experiment file does: sweep("ring.yaml", {"links.loss": [0, 0.1]}).

    Takes what run() takes, and gives all in one Results: `metric(name)` has a row per value. Criteria of the file are those of a sweep:
    they name <protocol>.<value>.<metric>.
    """
    file = pathlib.Path(file)
    text = file.read_text()
    if any(line.startswith("sweep:") for line in text.splitlines()):
        raise ValueError(f"{file}: has a sweep of its own; run() runs it")
    # Beside the original, which may name other files; JSON is YAML.
    with tempfile.NamedTemporaryFile("w", suffix=".yaml", prefix=file.stem + "-", dir=file.parent) as varied:
        varied.write(f"{text}\nsweep: {json.dumps({key: list(some) for key, some in values.items()})}\n")
        varied.flush()
        return run(varied.name, **arguments)
