"""Tests that the runner gives each kind of wrong decoder its verdict and a failing exit code."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from runner.limits import Limits
from runner.process import CodecProcess

ROOT = Path(__file__).resolve().parents[2]
RUN = ROOT / "conformance" / "run.py"
REFERENCE = f"{sys.executable} -m quarc_ref.conformance"
STILL_VECTOR = "streams/still"


def run_conformance(decoder, *options, selected=(STILL_VECTOR,)):
    """Run the conformance runner on a decoder with selected cases; return the finished process."""
    selection = [argument for name in selected for argument in ("--only", name)]
    command = [sys.executable, str(RUN), "--decoder", decoder, *selection, *options]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def make_decoder(tmp_path, *lines):
    """Return a command that reads its standard input to the end and then runs lines of Python."""
    program = tmp_path / "decoder.py"
    program.write_text("\n".join(["import sys, time", "data = sys.stdin.buffer.read()", *lines]))
    return f"{sys.executable} {program}"


def list_verdicts(completed):
    return {line.split()[0] for line in completed.stdout.splitlines() if line.startswith("  ")}


@pytest.mark.parametrize(
    ("lines", "verdict"),
    [
        ([], "silent"),
        (['print(\'{"refused": "field"}\')', "sys.exit(1)"], "refused"),
        (["raise RuntimeError('no')"], "crash"),
        (["import os", "os.abort()"], "crash"),
        (["if len(sys.argv) == 1: time.sleep(60)"], "timeout"),
        (["keep = []", "while True: keep.append(bytearray(1 << 20))"], "memory"),
        (["while True: print('{\"frame\": 0}')"], "extra"),
        (["while len(sys.argv) == 1: print('{\"values\": \"' + '0' * 999000 + '\"}')"], "extra"),
        (["print('frame 0')"], "garbage"),
        (["print('[' * 5000)"], "garbage"),
        (["print('{\"picture\": 0}')"], "garbage"),
        (['print(\'{"frame": 0, "gaussians": 6, "sha256": "00"}\')'], "wrong"),
        (['print(\'{"refused": "field"}\')'], "status"),
    ],
)
def test_a_command_that_is_not_a_decoder_has_its_own_verdict(tmp_path, lines, verdict):
    timeout = "2" if verdict == "timeout" else "60"  # 60 s suffice on a busy machine
    limits = ("--timeout", timeout, "--memory", "100")
    completed = run_conformance(make_decoder(tmp_path, *lines), *limits, "--alone")

    assert verdict in list_verdicts(completed), completed.stdout
    assert completed.returncode == 1


def test_memory_of_a_process_that_a_thread_started_counts(tmp_path):
    child = "memory = b'x' * (200 << 20); import time; time.sleep(60)"
    lines = [
        "import subprocess, threading",
        f"child = [sys.executable, '-c', {child!r}]",
        "if len(sys.argv) == 1: threading.Thread(target=subprocess.run, args=(child,)).start()",
    ]
    completed = run_conformance(make_decoder(tmp_path, *lines), "--memory", "100")

    assert list_verdicts(completed) >= {"memory"}, completed.stdout


def test_the_runner_does_not_wait_for_a_process_that_a_decoder_leaves_behind(tmp_path):
    """The process has a session of its own, so that it survives, and still holds all pipes."""
    lines = [
        "import subprocess",
        "if len(sys.argv) > 1: sys.exit()",
        "child = subprocess.Popen(['sleep', '60'], start_new_session=True)",
        f"open({str(tmp_path / 'pid')!r}, 'w').write(str(child.pid))",
    ]
    completed = run_conformance(make_decoder(tmp_path, *lines), "--timeout", "1")
    os.kill(int((tmp_path / "pid").read_text()), signal.SIGKILL)  # fails if it has ended

    assert list_verdicts(completed) >= {"timeout"}, completed.stdout


def test_all_that_a_command_writes_to_standard_error_is_read():
    for _ in range(20):
        process = CodecProcess('sh -c "echo MemoryError >&2; exit 7"', Limits())
        fault = process.make_crash_fault(process.finish())
        process.kill()

        assert (fault.verdict, str(fault)) == ("memory", "exit status 7: MemoryError")


def test_a_decoder_that_always_rejects_fails_with_every_valid_stream(tmp_path):
    command = make_decoder(tmp_path, 'print(\'{"refused": "bad-magic"}\')', "sys.exit(1)")
    report = tmp_path / "report.json"

    completed = run_conformance(
        command, "--json", str(report), selected=("streams/s", "invalid/magic")
    )

    cases = {case["name"]: case["verdict"] for case in json.loads(report.read_text())["cases"]}
    assert completed.returncode == 1
    assert {verdict for name, verdict in cases.items() if name.startswith("streams/")} == {
        "refused"
    }
    assert cases["invalid/magic"] == "pass"


def test_a_decoder_that_continues_after_a_fault_does_not_count_as_rejecting(tmp_path):
    report = tmp_path / "report.json"
    decoder = tmp_path / "decoder.py"
    decoder.write_text(
        "import json, sys\n"
        "from quarc_ref.decoder import compute_digest\n"
        "from quarc_ref.streams import Gap, recover\n"
        "for x in recover(sys.stdin.buffer.read()):\n"
        "    if not isinstance(x, Gap):\n"
        "        line = {'frame': x.frame, 'gaussians': x.count, 'sha256': compute_digest(x)}\n"
        "        print(json.dumps(line))\n"
    )

    run_conformance(
        f"{sys.executable} {decoder}", "--json", str(report), selected=("invalid/state-crc-zero",)
    )

    assert json.loads(report.read_text())["cases"][0]["verdict"] == "extra"


def test_reports_name_clauses_and_cases(tmp_path):
    json_path, junit_path = tmp_path / "report.json", tmp_path / "junit.xml"
    options = ("--json", str(json_path), "--junit", str(junit_path), "--clauses")

    completed = run_conformance(
        REFERENCE, *options, selected=(STILL_VECTOR, "unit/isqrt", "invalid/sync")
    )

    report = json.loads(json_path.read_text())
    assert completed.returncode == 0, completed.stdout
    assert report["passed"]
    assert report["clauses"]["5.2-1"]["passed"] > 0
    assert "5.2-1" in completed.stdout
    assert len(ElementTree.parse(junit_path).getroot()) == len(report["cases"])


def test_reports_escape_control_characters(tmp_path):
    junit_path = tmp_path / "junit.xml"
    lines = [r"sys.stderr.write('\x1b[31mred\x1b[0m \x00 here')", "sys.exit(7)"]
    completed = run_conformance(make_decoder(tmp_path, *lines), "--junit", str(junit_path))

    (failure,) = ElementTree.parse(junit_path).getroot().iter("failure")
    assert failure.get("message") == r"exit status 7: \x1b[31mred\x1b[0m \x00 here"
    assert r"\x1b[31mred" in completed.stdout


@pytest.mark.parametrize(
    "answer",
    [
        '{"capabilities": [1, {}]}',
        '{"capabilities": ["jobs"], "units": 5}',
        '{"capabilities": ["jobs"], "levels": []}',
        '{"capabilities": ["jobs"], "levels": [11]}',
        "[" * 5000,
    ],
)
def test_any_answer_to_capabilities_is_allowed(answer, tmp_path):
    completed = run_conformance(make_decoder(tmp_path, f"print({answer!r})"))

    assert completed.returncode == 1
    assert "0 of 1 cases passed" in completed.stdout


@pytest.mark.parametrize(
    ("answer", "complaint"),
    [
        ('{"capabilities": ["jobs"],\n "units": []}', "is ignored: the command printed a line"),
        ('{"capabilities": ["jobs"], "units": 5}', "is ignored: a list is missing"),
        ('{"refused": "truncated"}', ""),
        ("usage: mydecoder FILE", ""),
    ],
)
def test_an_answer_to_capabilities_that_is_ignored_is_reported(answer, complaint, tmp_path):
    completed = run_conformance(make_decoder(tmp_path, f"print({answer!r})"))

    assert complaint in completed.stderr
    assert bool(complaint) == bool(completed.stderr)
    assert "not tested: jobs, seek, recover, grow, " in completed.stdout


def test_without_jobs_other_capabilities_are_still_tested(tmp_path):
    report = tmp_path / "report.json"
    cases = ("streams/updates-edge", "streams/journey#")

    completed = run_conformance(REFERENCE, "--alone", "--json", str(report), selected=cases)

    names = [case["name"] for case in json.loads(report.read_text())["cases"]]
    assert completed.returncode == 0, completed.stdout
    assert names == ["streams/journey#grow", "streams/updates-edge"]


@pytest.mark.parametrize("capabilities", ['["seek"]', "[]"])
def test_capabilities_that_need_jobs_are_not_tested_without_jobs(tmp_path, capabilities):
    line = f'{{"capabilities": {capabilities}, "units": ["crc"]}}'
    decoder = make_decoder(tmp_path, f"print({line!r})")

    completed = run_conformance(decoder, selected=("unit/", "streams/journey#from"))

    assert completed.returncode == 2
    assert completed.stderr.startswith("run.py: no case that can be run has a name")


def test_only_known_capabilities_are_reported_as_tested(tmp_path):
    line = '{"capabilities": ["jobs", "seeks", "updates"]}'

    decoder = make_decoder(tmp_path, f"print({line!r})")  # waits for the end of the jobs
    completed = run_conformance(decoder, "--timeout", "5")

    assert "tested: decode, jobs, updates\n" in completed.stdout


@pytest.mark.parametrize(("levels", "declined"), [("[10]", 5), ("[10, 20, 30, 31]", 0)])
def test_a_decoder_may_decline_levels_that_it_does_not_claim(tmp_path, levels, declined):
    program = tmp_path / "decoder.py"
    line = f'{{"capabilities": ["grow"], "levels": {levels}}}'
    program.write_text(
        "import sys\n"
        f'print({line!r} if sys.argv[1:] else \'{{"declined": "level"}}\')\n'
        "sys.exit(0 if sys.argv[1:] else 3)\n"
    )
    selected = ("levels/20", "levels/30", STILL_VECTOR)

    completed = run_conformance(f"{sys.executable} {program}", selected=selected)

    assert completed.returncode == 1
    assert f"levels {levels[1:-1]}\n" in completed.stdout
    assert f"  refused      {STILL_VECTOR}: declined: level\n" in completed.stdout
    assert f"{declined} of 6 cases passed" in completed.stdout


@pytest.mark.parametrize("limit", ["0", "-1", "nan", "inf", "much"])
@pytest.mark.parametrize("option", ["--memory", "--timeout"])
def test_limits_are_above_0(option, limit):
    completed = run_conformance(REFERENCE, option, limit)

    assert completed.returncode == 2
    assert f"argument {option}: {limit} is not a finite number above 0" in completed.stderr


def test_a_growing_stream_that_is_rejected_is_reported_as_such(tmp_path):
    program = tmp_path / "decoder.py"
    program.write_text(
        "import sys\n"
        "is_asked = len(sys.argv) > 1\n"
        'print(\'{"capabilities": ["grow"]}\' if is_asked else \'{"refused": "field"}\')\n'
        "sys.exit(not is_asked)\n"
    )
    decoder = f"{sys.executable} {program}"

    assert "refused" in list_verdicts(run_conformance(decoder, selected=("streams/journey#grow",)))


@pytest.mark.parametrize("option", ["--json", "--junit"])
def test_a_report_that_cannot_be_written_is_still_printed(tmp_path, option):
    completed = run_conformance(REFERENCE, option, str(tmp_path / "none" / "report"))

    assert completed.returncode == 2
    assert "cases passed" in completed.stdout
    assert completed.stderr.startswith("run.py: ")
    assert completed.stderr.count("\n") == 1


@pytest.mark.parametrize(
    "manifest", [None, "{}", "[]", '{"units": []}', '{"vectors": [], "units": []}']
)
def test_an_empty_suite_fails(tmp_path, manifest):
    if manifest is not None:
        (tmp_path / "manifest.json").write_text(manifest)

    completed = run_conformance(REFERENCE, "--suite", str(tmp_path))

    assert completed.returncode == 2
    assert str(tmp_path) in completed.stderr


def test_an_empty_selection_fails():
    assert run_conformance(REFERENCE, selected=("nothing",)).returncode == 2


def test_a_stream_that_differs_from_the_manifest_is_an_error_of_the_suite(tmp_path):
    suite = ROOT / "conformance"
    manifest = json.loads((suite / "manifest.json").read_text("utf-8"))
    vectors = [entry for entry in manifest["vectors"] if entry["name"] == STILL_VECTOR]
    (tmp_path / "manifest.json").write_text(json.dumps({"vectors": vectors, "units": []}))
    (tmp_path / "streams").mkdir()
    data = (suite / f"{STILL_VECTOR}.quarc").read_bytes()
    (tmp_path / f"{STILL_VECTOR}.quarc").write_bytes(data + b"\0")

    completed = run_conformance(REFERENCE, "--suite", str(tmp_path))

    assert completed.returncode == 2
    assert STILL_VECTOR in completed.stderr


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("./no-such-decoder --fast", "'./no-such-decoder' cannot be started: No such file"),
        ("./conformance", "cannot be started: Permission denied"),
        ("conformance/manifest.json", "cannot be started: Permission denied"),
        ("", "the command is empty"),
        ("'unclosed", 'the command "\'unclosed" cannot be read: No closing quotation'),
    ],
)
@pytest.mark.parametrize("options", [[], ["--alone"], ["--encoder"]])
def test_a_command_that_cannot_be_started_is_not_a_failing_decoder(options, command, message):
    is_encoder = options == ["--encoder"]
    completed = run_conformance(
        REFERENCE if is_encoder else command,
        *options,
        *[command] * is_encoder,
        selected=("encoder/" if is_encoder else STILL_VECTOR,),
    )

    assert completed.returncode == 2
    assert completed.stdout == ""
    assert completed.stderr.startswith("run.py: ")
    assert message in completed.stderr
    assert completed.stderr.count("\n") == 1
