"""Tests that generation reproduces all files of the suite, which are small and complete."""

import json
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest

from plain import spec_text

SUITE = Path(__file__).resolve().parents[2] / "conformance"
MANIFEST = json.loads((SUITE / "manifest.json").read_text("utf-8"))
VECTORS = MANIFEST["vectors"]
MAX_SUITE_BYTES = 3 << 20
MIN_BROKEN_STREAMS = 120


def test_regenerated_files_equal_the_committed_ones():
    command = [sys.executable, str(SUITE / "generate.py"), "--check"]

    completed = subprocess.run(command, capture_output=True, text=True, check=False)

    assert completed.returncode == 0, completed.stdout + completed.stderr


def test_the_suite_is_small():
    paths = [path for path in SUITE.rglob("*") if path.is_file() and path.suffix != ".pyc"]

    assert sum(path.stat().st_size for path in paths) <= MAX_SUITE_BYTES


def test_many_streams_are_invalid_or_damaged():
    broken_vectors = [
        vector
        for vector in VECTORS
        if vector["name"].startswith(("invalid/", "damaged/")) and "file" in vector
    ]

    assert len(broken_vectors) >= MIN_BROKEN_STREAMS
    assert all("parent" in vector and vector["patch"] for vector in broken_vectors)


def test_every_reject_id_has_an_invalid_stream_with_that_fault_alone():
    spec_ids = {row[0] for row in spec_text.read_table(spec_text.read_spec(), "rejects")}
    tested_ids = {
        vector["decode"]["refused"][0]
        for vector in VECTORS
        if vector["name"].startswith("invalid/") and len(vector["decode"].get("refused", ())) == 1
    }

    assert tested_ids == spec_ids


def make_validator(name):
    schema = json.loads((SUITE / "schema" / f"{name}.schema.json").read_text("utf-8"))
    return jsonschema.Draft202012Validator(schema)


def test_the_manifest_matches_its_schema():
    make_validator("manifest").validate(MANIFEST)


@pytest.mark.parametrize("name", MANIFEST["units"])
def test_known_answers_match_their_schema(name):
    make_validator("unit").validate(json.loads((SUITE / name).read_text("utf-8")))


def test_a_report_matches_its_schema(tmp_path):
    report = tmp_path / "report.json"
    reference = f"{sys.executable} -m quarc_ref.conformance"
    command = [sys.executable, str(SUITE / "run.py"), "--decoder", reference]

    subprocess.run([*command, "--only", "levels/3", "--json", str(report)], check=True)

    make_validator("report").validate(json.loads(report.read_text("utf-8")))
