"""Tests that the JSON output of all verbs matches the schemas in docs/schemas."""

import json
import re
import subprocess
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator, ValidationError

import quarc_ref
from quarc_ref.cli.app import app
from tests.cli.commands import run, run_json
from tests.cli.processes import start
from tests.cli.schemas import SCHEMA_FOLDER, SHARED_SCHEMA, load_schemas, validate
from tests.cli.stress import VERBS

_SCHEMAS = {name: schema for name, schema in load_schemas().items() if name != SHARED_SCHEMA}


@pytest.fixture
def paths(stream_file, encoded_stream, capture, recordings):
    return {
        "stream": stream_file,
        "encoded": encoded_stream.file,
        "capture": capture,
        "recordings": recordings,
    }


@pytest.mark.parametrize("verb", [name for name in VERBS if name != "view"])
def test_the_output_of_a_verb_matches_its_schema(verb, paths, tmp_path):
    pytest.importorskip(VERBS[verb].required_package)
    result = run(verb, *VERBS[verb].fill_arguments({**paths, "out": tmp_path / "out"}), "--json")
    json_output = json.loads(result.stdout)

    validate(json_output)
    assert next(iter(json_output)) == "schema"
    assert json_output["schema"].split("/")[1] == verb
    second_key = list(json_output)[1]
    incomplete_output = {name: value for name, value in json_output.items() if name != second_key}
    for wrong_output in ({**json_output, "more": 0}, incomplete_output):
        with pytest.raises(ValidationError):
            validate(wrong_output)


def test_the_output_of_view_matches_its_schema(stream_file):
    with start("view", stream_file, "--no-open", "--json", stdout=subprocess.PIPE) as viewer:
        json_output = json.loads(b"".join(iter(viewer.stdout.readline, b"}\n")) + b"}")
        viewer.terminate()

    validate(json_output)
    assert json_output["schema"] == "quarc-ref/view/1"


@pytest.mark.parametrize(
    "line",
    [
        "verify {stream} --deep",
        "verify {damaged}",
        "decode {damaged} -o {out} --recover",
        "decode {broken} -o {out} --recover",
        "info {empty}",
        "inspect {empty}",
        "verify {empty} --deep",
        "inspect {encoded}",
        "render {stream} -o {out}.mp4",
        "eval {encoded} {capture}",
    ],
)
def test_the_output_of_other_cases_matches_too(line, paths, small_stream, tmp_path):
    for name, data in _make_damaged_streams(small_stream.data).items():
        paths[name] = tmp_path / f"{name}.quarc"
        paths[name].write_bytes(data)
    result = run(*line.format(**paths, out=tmp_path / "out").split(), "--json", "--quiet")

    validate(json.loads(result.stdout))


def _make_damaged_streams(data):
    """Return a truncated stream, a stream without a complete frame, and a stream of no frames."""
    stream_without_frames = (
        Path(__file__).parents[2] / "conformance" / "streams" / "no-frames.quarc"
    )
    return {"damaged": data[:-1], "broken": data[:200], "empty": stream_without_frames.read_bytes()}


def test_every_verb_has_a_schema():
    assert {command.name for command in app.registered_commands} <= _SCHEMAS.keys()


def test_every_printed_object_has_a_schema_of_its_version():
    package = Path(quarc_ref.__file__).parent
    modules = [*(package / "cli").rglob("*.py"), *(package / "export").rglob("*.py")]
    modules += [*(package / "encoder").rglob("*.py"), *(package / "viewing").rglob("*.py")]
    used_ids = {
        f"quarc-ref/{schema_id}"
        for path in modules
        for schema_id in re.findall(r'"(?:quarc-ref/)?([a-z-]+/\d+)"', path.read_text())
    }

    assert used_ids == {
        schema_id["properties"]["schema"]["const"] for schema_id in _SCHEMAS.values()
    }


@pytest.mark.parametrize("name", load_schemas())
def test_every_schema_is_valid(name):
    Draft202012Validator.check_schema(load_schemas()[name])
    assert load_schemas()[name]["$id"] == f"{name}.json"


@pytest.mark.parametrize("name", _SCHEMAS)
def test_a_schema_names_itself_and_every_key(name):
    schema = _SCHEMAS[name]

    assert schema["additionalProperties"] is False
    assert "schema" in schema["required"]
    assert re.fullmatch(f"quarc-ref/{name}/[0-9]+", schema["properties"]["schema"]["const"])


def test_the_schema_page_lists_every_schema():
    page = (SCHEMA_FOLDER / "README.md").read_text("utf-8")
    files_by_id = dict(re.findall(r"^\| `(quarc-ref/.*?)` \|.*\]\((.*)\) \|$", page, re.MULTILINE))

    documents_by_id = {
        schema: json.loads((SCHEMA_FOLDER / file).read_text())
        for schema, file in files_by_id.items()
    }
    assert all(
        schema_document["properties"]["schema"]["const"] == schema
        for schema, schema_document in documents_by_id.items()
    )
    assert {schema_document["$id"] for schema_document in documents_by_id.values()} >= {
        schema_document["$id"] for schema_document in _SCHEMAS.values()
    }
    assert "quarc-ref/conformance-report/1" in documents_by_id


def test_the_example_of_the_schema_page_runs(stream_file, monkeypatch):
    page = (SCHEMA_FOLDER / "README.md").read_text("utf-8")
    (program,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    command = ("quarc-ref", "info", "steak.quarc", "--json")
    json_output = {"schema": "quarc-ref/info/3", **run_json("info", stream_file)}

    def run_example(printed):
        output_by_command = {command: json.dumps(printed).encode()}
        monkeypatch.setattr(
            subprocess, "check_output", lambda arguments: output_by_command[tuple(arguments)]
        )
        exec(program, {})

    run_example(json_output)
    with pytest.raises(ValidationError):
        run_example({**json_output, "more": 0})
