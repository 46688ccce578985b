"""The schema of experiment files as editors use it: two validators of other makers must say the same of it, and of experiments."""

import copy
import json
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

import jsonschema
import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCHEMA = ROOT / "experiments" / "experiment.schema.json"
RING = {
    "experiment": "ring",
    "rounds": 10,
    "agents": {"count": 3, "protocol": "local_voting", "initial": {"x": [1, 2, 3]}},
    "topology": {"edges": ["1 -> 2", "2 -> 3", "3 -> 1"]},
}
AJV = """
const Ajv = require('ajv'), fs = require('fs');
const [schema, documents] = process.argv.slice(1).map(name => JSON.parse(fs.readFileSync(name, 'utf8')));
const validate = new Ajv({logger: false}).compile(schema);
console.log(JSON.stringify(documents.map(document => validate(document))));
"""


class Core(yaml.SafeLoader):
    """YAML 1.2, as editors and Consort read it: `on` is a word, and 1e4 a number."""


Core.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag not in ("tag:yaml.org,2002:bool", "tag:yaml.org,2002:float")]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
Core.add_implicit_resolver("tag:yaml.org,2002:bool", re.compile("^(true|false)$"), list("tf"))
Core.add_implicit_resolver("tag:yaml.org,2002:float", re.compile(r"^[-+]?(\.\d+|\d+\.\d*|\d+(?=[eE]))([eE][-+]?\d+)?$"), list("-+.0123456789"))


def read(path):
    """A file as the schema sees it: `<<` is taken up, keys are text."""

    def texts(value):
        if isinstance(value, dict):
            return {str(key): texts(entry) for key, entry in value.items()}
        return [texts(entry) for entry in value] if isinstance(value, list) else value

    return texts(yaml.load(path.read_text(), Core))


def with_protocol(protocol):
    document = copy.deepcopy(RING)
    document["agents"]["protocol"] = protocol
    return document


def with_model(model):
    return {**copy.deepcopy(RING), "plant": {"model": model}}


def by_jsonschema(documents):
    schema = json.loads(SCHEMA.read_text())
    jsonschema.Draft7Validator.check_schema(schema)
    validator = jsonschema.Draft7Validator(schema)
    return [validator.is_valid(document) for document in documents]


def by_ajv(documents):
    with tempfile.TemporaryDirectory() as folder:
        given = pathlib.Path(folder) / "documents.json"
        given.write_text(json.dumps(documents))
        environment = {**os.environ, "NODE_PATH": "/usr/share/nodejs"}
        done = subprocess.run(["node", "-e", AJV, str(SCHEMA), str(given)], env=environment, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise AssertionError(done.stderr)
    return json.loads(done.stdout)


class Schema(unittest.TestCase):
    def expect(self, valid, documents):
        for validator in (by_jsonschema, by_ajv):
            said = validator([document for _, document in documents])
            self.assertEqual([], [name for (name, _), answer in zip(documents, said) if answer != valid], validator.__name__)

    def test_every_shipped_experiment_is_valid(self):
        files = sorted((ROOT / "experiments").rglob("*.yaml"))
        self.assertGreater(len(files), 50)
        self.expect(True, [(file.name, read(file)) for file in files])

    def test_what_a_protocol_or_a_model_knows_is_valid_by_its_name(self):
        self.expect(
            True,
            [
                ("number", with_protocol({"name": "kalman_consensus", "Q": 0.2})),
                ("word", with_protocol({"name": "continuous_kalman_consensus", "method": "euler"})),
                ("plug-in", with_protocol({"name": "of_my_own", "anything": 1})),
                ("model", with_model({"name": "beam", "reduction": "finite_elements"})),
                ("model of a plug-in", with_model({"name": "of_my_own", "anything": 1})),
            ],
        )

    def test_what_it_does_not_know_is_not(self):
        self.expect(
            False,
            [
                ("another one's parameter", with_protocol({"name": "local_voting", "method": "euler"})),
                ("a slip", with_protocol({"name": "kalman_consensus", "Omgea": 0.3})),
                ("no such word", with_protocol({"name": "continuous_kalman_consensus", "method": "heun"})),
                ("no name", with_protocol({"Q": 0.3})),
                ("another model's parameter", with_model({"name": "integrator", "bending": 1})),
                ("no such reduction", with_model({"name": "beam", "reduction": "guyan"})),
            ],
        )

    def test_every_parameter_shows_what_it_means(self):
        definitions = json.loads(SCHEMA.read_text())["definitions"]
        for forms in ("protocol_by_name", "model_by_name"):
            for form in definitions[forms]["oneOf"][:-1]:
                self.assertTrue(form["description"], form["title"])
                for name, parameter in form["properties"].items():
                    self.assertTrue(name == "name" or len(parameter["description"]) > 10, f"{form['title']}: {name}")


if __name__ == "__main__":
    unittest.main()
