"""The JSON output of the command matches its schemas."""

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
from tests.cli.schemas import FOLDER, SHARED, load_schemas, validate
from tests.cli.stress import VERBS

_SCHEMAS = {name: it for name, it in load_schemas().items() if name != SHARED}


@pytest.fixture
def places(stream_file, encoded_stream, capture, recordings):
    return {
        "stream": stream_file,
        "encoded": encoded_stream.file,
        "capture": capture,
        "recordings": recordings,
    }


@pytest.mark.parametrize("verb", [name for name in VERBS if name != "view"])
def test_the_output_of_a_verb_matches_its_schema(verb, places, tmp_path):
    pytest.importorskip(VERBS[verb].needs)
    result = run(verb, *VERBS[verb].fill({**places, "out": tmp_path / "out"}), "--json")
    printed_output = json.loads(result.stdout)

    validate(printed_output)
    assert next(iter(printed_output)) == "schema"
    assert printed_output["schema"].split("/")[1] == verb
    second = list(printed_output)[1]
    less = {name: value for name, value in printed_output.items() if name != second}
    for damaged_data in ({**printed_output, "more": 0}, less):
        with pytest.raises(ValidationError):
            validate(damaged_data)


def test_the_output_of_view_matches_its_schema(stream_file):
    with start("view", stream_file, "--no-open", "--json", stdout=subprocess.PIPE) as viewer:
        printed_output = json.loads(b"".join(iter(viewer.stdout.readline, b"}\n")) + b"}")
        viewer.terminate()

    validate(printed_output)
    assert printed_output["schema"] == "quarc-ref/view/1"


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
def test_the_output_of_other_cases_matches_too(line, places, made, tmp_path):
    for name, data in _damaged(made.data).items():
        places[name] = tmp_path / f"{name}.quarc"
        places[name].write_bytes(data)
    result = run(*line.format(**places, out=tmp_path / "out").split(), "--json", "--quiet")

    validate(json.loads(result.stdout))


def _damaged(data):
    """Streams without an end, without a complete frame, and without any frame."""
    empty = Path(__file__).parents[2] / "conformance" / "streams" / "no-frames.quarc"
    return {"damaged": data[:-1], "broken": data[:200], "empty": empty.read_bytes()}


def test_every_verb_has_a_schema():
    assert {command.name for command in app.registered_commands} <= _SCHEMAS.keys()


def test_every_printed_object_has_a_schema_of_its_version():
    package = Path(quarc_ref.__file__).parent
    modules = [*(package / "cli").rglob("*.py"), *(package / "export").rglob("*.py")]
    modules += [*(package / "encoder").rglob("*.py"), *(package / "viewing").rglob("*.py")]
    listed_names = {
        f"quarc-ref/{item}"
        for path in modules
        for item in re.findall(r'"(?:quarc-ref/)?([a-z-]+/\d+)"', path.read_text())
    }

    assert listed_names == {item["properties"]["schema"]["const"] for item in _SCHEMAS.values()}


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
    page = (FOLDER / "README.md").read_text("utf-8")
    rows = dict(re.findall(r"^\| `(quarc-ref/.*?)` \|.*\]\((.*)\) \|$", page, re.MULTILINE))

    listed_names = {
        schema: json.loads((FOLDER / file).read_text()) for schema, file in rows.items()
    }
    assert all(
        item["properties"]["schema"]["const"] == schema for schema, item in listed_names.items()
    )
    assert {item["$id"] for item in listed_names.values()} >= {
        item["$id"] for item in _SCHEMAS.values()
    }
    assert "quarc-ref/conformance-report/1" in listed_names


def test_the_example_of_the_schema_page_runs(stream_file):
    page = (FOLDER / "README.md").read_text("utf-8")
    (program,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    printed_output = {"schema": "quarc-ref/info/2", **run_json("info", stream_file)}

    exec(program, {"printed": printed_output})
    with pytest.raises(ValidationError):
        exec(program, {"printed": {**printed_output, "more": 0}})
