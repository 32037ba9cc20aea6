"""The vectors: regeneration gives the same files, they are small, and none is missing."""

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
MAX_BYTES = 3 << 20
MIN_BROKEN = 120


def test_regenerated_files_equal_the_committed_ones():
    command = [sys.executable, str(SUITE / "generate.py"), "--check"]

    done = subprocess.run(command, capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stdout + done.stderr


def test_the_suite_is_small():
    files = (p for p in SUITE.rglob("*") if p.is_file() and p.suffix != ".pyc")

    assert sum(path.stat().st_size for path in files) <= MAX_BYTES


def test_many_streams_are_invalid_or_damaged():
    broken = [v for v in VECTORS if v["name"].startswith(("invalid/", "damaged/")) and "file" in v]

    assert len(broken) >= MIN_BROKEN
    assert all("parent" in vector and vector["patch"] for vector in broken)


def test_every_reject_id_has_an_invalid_stream_with_that_fault_alone():
    known = {row[0] for row in spec_text.read_table(spec_text.read_spec(), "rejects")}
    message = {
        vector["decode"]["refused"][0]
        for vector in VECTORS
        if vector["name"].startswith("invalid/") and len(vector["decode"].get("refused", ())) == 1
    }

    assert message == known


def validator(name):
    schema = json.loads((SUITE / "schema" / f"{name}.schema.json").read_text("utf-8"))
    return jsonschema.Draft202012Validator(schema)


def test_the_manifest_matches_its_schema():
    validator("manifest").validate(MANIFEST)


@pytest.mark.parametrize("name", MANIFEST["units"])
def test_known_answers_match_their_schema(name):
    validator("unit").validate(json.loads((SUITE / name).read_text("utf-8")))


def test_a_report_matches_its_schema(tmp_path):
    report = tmp_path / "report.json"
    reference = f"{sys.executable} -m quarc_ref.conformance"
    command = [sys.executable, str(SUITE / "run.py"), "--decoder", reference]

    subprocess.run([*command, "--only", "levels/3", "--json", str(report)], check=True)

    validator("report").validate(json.loads(report.read_text("utf-8")))
