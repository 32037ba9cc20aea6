"""Tests the runner with wrong decoders: each has its own verdict and a failing exit status."""

import json
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).resolve().parents[2]
RUN = ROOT / "conformance" / "run.py"
REFERENCE = f"{sys.executable} -m quarc_ref.conformance"
STILL = "streams/still"


def run(decoder, *more, only=(STILL,)):
    """The finished process of the runner, for a decoder of a few cases."""
    names = [word for name in only for word in ("--only", name)]
    command = [sys.executable, str(RUN), "--decoder", decoder, *names, *more]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def make_decoder(tmp_path, *lines):
    """A command that reads all of its input and then runs the given lines."""
    program = tmp_path / "decoder.py"
    program.write_text("\n".join(["import sys, time", "data = sys.stdin.buffer.read()", *lines]))
    return f"{sys.executable} {program}"


def verdicts(done):
    return {line.split()[0] for line in done.stdout.splitlines() if line.startswith("  ")}


@pytest.mark.parametrize(
    ("lines", "verdict"),
    [
        ([], "silent"),
        (['print(\'{"refused": "field"}\')', "sys.exit(1)"], "refused"),
        (["raise RuntimeError('no')"], "crash"),
        (["import os", "os.abort()"], "crash"),
        (["time.sleep(60)"], "timeout"),
        (["keep = []", "while True: keep.append(bytearray(1 << 20))"], "memory"),
        (["print('frame 0')"], "garbage"),
        (["print('{\"picture\": 0}')"], "garbage"),
        (['print(\'{"frame": 0, "gaussians": 6, "sha256": "00"}\')'], "wrong"),
        (['print(\'{"refused": "field"}\')'], "status"),
    ],
)
def test_a_command_that_is_not_a_decoder_has_its_own_verdict(tmp_path, lines, verdict):
    seconds = "2" if verdict == "timeout" else "60"  # on a busy machine
    limits = ("--timeout", seconds, "--memory", "100")
    done = run(make_decoder(tmp_path, *lines), *limits, "--alone")

    assert verdict in verdicts(done), done.stdout
    assert done.returncode == 1


def test_a_decoder_that_always_rejects_fails_with_every_valid_stream(tmp_path):
    command = make_decoder(tmp_path, 'print(\'{"refused": "bad-magic"}\')', "sys.exit(1)")
    report = tmp_path / "report.json"

    done = run(command, "--json", str(report), only=("streams/s", "invalid/magic"))

    cases = {case["name"]: case["verdict"] for case in json.loads(report.read_text())["cases"]}
    assert done.returncode == 1
    assert {v for name, v in cases.items() if name.startswith("streams/")} == {"refused"}
    assert cases["invalid/magic"] == "pass"


def test_a_decoder_that_continues_after_a_fault_does_not_count_as_rejecting(tmp_path):
    report = tmp_path / "report.json"
    recovering = tmp_path / "decoder.py"
    recovering.write_text(
        "import json, sys\n"
        "from quarc_ref.decoder import compute_digest\n"
        "from quarc_ref.streams import Gap, recover\n"
        "for x in recover(sys.stdin.buffer.read()):\n"
        "    if not isinstance(x, Gap):\n"
        "        said = {'frame': x.frame, 'gaussians': x.count, 'sha256': compute_digest(x)}\n"
        "        print(json.dumps(said))\n"
    )

    run(f"{sys.executable} {recovering}", "--json", str(report), only=("invalid/state-crc-zero",))

    assert json.loads(report.read_text())["cases"][0]["verdict"] == "extra"


def test_reports_name_clauses_and_cases(tmp_path):
    as_json, junit = tmp_path / "report.json", tmp_path / "junit.xml"
    more = ("--json", str(as_json), "--junit", str(junit), "--clauses")

    done = run(REFERENCE, *more, only=(STILL, "unit/isqrt", "invalid/sync"))

    report = json.loads(as_json.read_text())
    assert done.returncode == 0, done.stdout
    assert report["passed"]
    assert report["clauses"]["5.2-1"]["passed"] > 0
    assert "5.2-1" in done.stdout
    assert len(ElementTree.parse(junit).getroot()) == len(report["cases"])


@pytest.mark.parametrize("manifest", [None, "{}", '{"vectors": [], "units": []}'])
def test_an_empty_suite_fails(tmp_path, manifest):
    if manifest is not None:
        (tmp_path / "manifest.json").write_text(manifest)

    done = run(REFERENCE, "--suite", str(tmp_path))

    assert done.returncode == 2
    assert str(tmp_path) in done.stderr


def test_an_empty_selection_fails():
    assert run(REFERENCE, only=("nothing",)).returncode == 2


def test_a_stream_that_differs_from_the_manifest_is_an_error_of_the_suite(tmp_path):
    suite = ROOT / "conformance"
    manifest = json.loads((suite / "manifest.json").read_text("utf-8"))
    kept = [entry for entry in manifest["vectors"] if entry["name"] == STILL]
    (tmp_path / "manifest.json").write_text(json.dumps({"vectors": kept, "units": []}))
    (tmp_path / "streams").mkdir()
    data = (suite / f"{STILL}.quarc").read_bytes()
    (tmp_path / f"{STILL}.quarc").write_bytes(data + b"\0")

    done = run(REFERENCE, "--suite", str(tmp_path))

    assert done.returncode == 2
    assert STILL in done.stderr


@pytest.mark.parametrize(
    ("command", "why"),
    [
        ("./no-such-decoder --fast", "'./no-such-decoder' cannot be started: No such file"),
        ("./conformance", "cannot be started: Permission denied"),
        ("conformance/manifest.json", "cannot be started: Permission denied"),
        ("", "the command is empty"),
        ("'unclosed", 'the command "\'unclosed" cannot be read: No closing quotation'),
    ],
)
@pytest.mark.parametrize("options", [[], ["--alone"], ["--encoder"]])
def test_a_command_that_cannot_be_started_is_not_a_failing_decoder(options, command, why):
    as_encoder = options == ["--encoder"]
    done = run(REFERENCE if as_encoder else command, *options, *[command] * as_encoder)

    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("run.py: ")
    assert why in done.stderr
    assert done.stderr.count("\n") == 1
