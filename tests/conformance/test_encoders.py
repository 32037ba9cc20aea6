"""Tests that the runner compares an encoder's stream with its declarations."""

import json
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest

from runner.encoders import judge_encoder

SUITE = Path(__file__).resolve().parents[2] / "conformance"
SCENES = sorted((SUITE / "encoder").glob("*.json"))
REFERENCE = f"{sys.executable} -m quarc_ref.conformance"


@pytest.fixture(scope="module")
def encoded_scene(tmp_path_factory):
    """A scene, the declarations and stream of the reference encoder, and the decoded frames."""
    scene, output = SUITE / "encoder" / "born.json", tmp_path_factory.mktemp("born") / "s.quarc"
    encoder = [sys.executable, str(SUITE / "encoder" / "encode_scene.py"), str(scene), str(output)]
    declared_lines = subprocess.run(encoder, capture_output=True, text=True, check=True).stdout
    stream = output.read_bytes()
    job = json.dumps({"job": "decode", "values": True, "bytes": len(stream)}).encode() + b"\n"
    jobs = [*REFERENCE.split(), "--jobs"]
    decoder_output = subprocess.run(
        jobs, input=job + stream, capture_output=True, check=True
    ).stdout
    lines = [json.loads(line) for line in decoder_output.splitlines()]
    return json.loads(scene.read_text()), declared_lines, stream, lines[:-1]


def judge_changed_lines(encoded_scene, change):
    scene, declared_lines, stream, decoded_frames = encoded_scene
    lines = [json.loads(line) for line in declared_lines.splitlines()]
    change(lines)
    return judge_encoder(scene, lines, stream, decoded_frames).name


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        (lambda _: None, "pass"),
        (lambda lines: lines[1].update(sha256="0" * 64), "wrong"),
        (lambda lines: lines.pop(0), "wrong"),
        (lambda lines: lines.pop(), "silent"),
        (lambda lines: lines[-1].update(bounds=5), "silent"),
        (lambda lines: lines[-1]["bounds"].pop("opacity"), "silent"),
        (lambda lines: lines[-1]["bounds"].update(shift=float("nan")), "silent"),
        (lambda lines: lines[-1].update(level=20), "level"),
        (lambda lines: lines[-1]["bounds"].update(opacity=1e-9), "bounds"),
        (lambda lines: lines[-1]["bounds"].update(rotation=1e-9), "bounds"),
        (lambda lines: lines[-1]["bounds"].update(shift=1e-9), "bounds"),
    ],
)
def test_declared_properties_must_hold(encoded_scene, change, verdict):
    assert judge_changed_lines(encoded_scene, change) == verdict


def test_a_higher_level_than_needed_is_detected(encoded_scene):
    scene, declared_lines, stream, decoded_frames = encoded_scene
    lines = [json.loads(line) for line in declared_lines.splitlines()]
    lines[-1]["level"] = 20
    changed_stream = stream[:38] + b"\x14" + stream[39:]

    assert judge_encoder(scene, lines, changed_stream, decoded_frames).name == "level"


@pytest.mark.parametrize(
    ("line", "verdict"),
    [
        ({"refused": "field"}, "refused"),
        ({"declined": "too large"}, "refused"),
        ({"unsupported": "decode"}, "garbage"),
        ({"frame": 4, "gaussians": 1, "sha256": "0" * 64}, "garbage"),
    ],
)
def test_a_stream_that_the_decoder_does_not_decode_is_reported(encoded_scene, line, verdict):
    scene, declared_lines, stream, decoded_frames = encoded_scene
    lines = [json.loads(line) for line in declared_lines.splitlines()]

    assert judge_encoder(scene, lines, stream, [*decoded_frames, line]).name == verdict


def test_an_encoder_that_writes_nothing_fails(tmp_path):
    program = tmp_path / "encoder.py"
    program.write_text("")
    command = [sys.executable, str(SUITE / "run.py"), "--decoder", REFERENCE]

    completed = subprocess.run(
        [*command, "--encoder", f"{sys.executable} {program}"],
        capture_output=True,
        text=True,
        check=False,
    )

    assert completed.returncode == 1
    assert completed.stdout.startswith("encoder: ")
    assert f"silent {len(SCENES)}" in completed.stdout


def test_scenes_can_be_selected(tmp_path):
    program = tmp_path / "encoder.py"
    program.write_text("")
    command = [sys.executable, str(SUITE / "run.py"), "--decoder", REFERENCE]
    encoder = ["--encoder", f"{sys.executable} {program}", "--only", "encoder/born"]

    completed = subprocess.run([*command, *encoder], capture_output=True, text=True, check=False)

    assert "0 of 1 cases passed" in completed.stdout


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_scenes_match_their_schema(path):
    schema = json.loads((SUITE / "schema" / "scene.schema.json").read_text())

    jsonschema.validate(json.loads(path.read_text()), schema)
