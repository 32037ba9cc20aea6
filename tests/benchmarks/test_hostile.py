import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hostile import blocks, judge
from hostile.mutations import Mutator
from quarc_ref.streams.chunk_reader import split_chunks
from tests.benchmarks.test_hostile_mutations import SEEDS
from tests.engines import needs_fast
from tests.small_streams import rebuild_stream

_SERIES = blocks.Series(Mutator(SEEDS, 0))
SCRIPT = Path(judge.__file__).parents[1] / "hostile.py"


def _run_fuzzer(folder, *arguments):
    command = [sys.executable, SCRIPT, "--out", folder, "--json", *map(str, arguments)]
    completed = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(completed.stdout)


@needs_fast
def test_mutants_end_in_frames_or_rejections_and_a_run_resumes_where_it_stopped(tmp_path):
    first_report = _run_fuzzer(tmp_path, "--streams", 150)
    (blocks_path,) = tmp_path.glob("series_0*/blocks.jsonl")
    saved_blocks = blocks_path.read_text()
    second_report = _run_fuzzer(tmp_path, "--streams", 150)

    assert first_report == second_report
    assert blocks_path.read_text() == saved_blocks
    assert first_report["streams"] == 150
    assert (
        first_report["decoded"]
        + first_report["declined"]
        + sum(first_report["rejections"].values())
        == 150
    )
    assert first_report["escapes"] == first_report["hangs"] == 0
    assert 0 < first_report["peak_rss_mib"] < judge.MAX_MEBIBYTES


@needs_fast
def test_results_of_other_seeds_are_not_reused(tmp_path):
    seeds = tmp_path / "seeds"
    seeds.mkdir()
    (seeds / "full.quarc").write_bytes(SEEDS["full"])

    reports = [_run_fuzzer(tmp_path, "--streams", 40)]
    reports.append(_run_fuzzer(tmp_path, "--streams", 40, "--seeds", seeds))

    assert reports[0]["rejections"] != reports[1]["rejections"]


def test_a_folder_without_seeds_is_rejected(tmp_path):
    command = [sys.executable, SCRIPT, "--out", tmp_path, "--seeds", tmp_path]
    completed = subprocess.run(command, capture_output=True, text=True, check=False)

    assert completed.returncode == 1
    assert completed.stderr == f"{tmp_path} contains no streams (*.quarc) to mutate\n"


@needs_fast
def test_every_mutant_can_be_decoded_by_both_engines(tmp_path):
    report = _run_fuzzer(tmp_path, "--both-engines", "--streams", 60)

    assert report["modes"] == {judge.BOTH_ENGINES_MODE: 60}
    assert report["escapes"] == report["hangs"] == 0


@pytest.fixture
def decode_modes(monkeypatch):
    """A copy of the table of decode functions, in which a test may replace an entry."""
    monkeypatch.setattr(judge, "MODES", dict(judge.MODES))
    return judge.MODES


def _raise_unexpected_error(_data):
    yield 1
    message = "not what a decoder may raise"
    raise ValueError(message)


def _loop_forever(_data):
    while True:
        yield


@pytest.fixture
def _restored_signal_handler():
    handler_before = signal.signal(signal.SIGPROF, judge._raise_too_long)
    yield
    signal.signal(signal.SIGPROF, handler_before)


@pytest.mark.usefixtures("_restored_signal_handler")
@pytest.mark.parametrize(
    ("decode", "outcome"), [(_raise_unexpected_error, "escape"), (_loop_forever, "hang")]
)
def test_failures_of_the_decoder_are_kept_with_their_bytes(
    decode, outcome, decode_modes, tmp_path, monkeypatch
):
    monkeypatch.setattr(judge, "MAX_SECONDS", 0.02)
    decode_modes["decode"] = decode
    tally = blocks.judge_block(_SERIES, 30, 1, tmp_path)

    assert tally.failures == {30: outcome}
    assert (tmp_path / "30.quarc").read_bytes() == Mutator(SEEDS, 0).make(30).data
    assert (tmp_path / "30.txt").read_text().startswith(outcome)


def test_a_forged_mutant_is_decoded_beyond_a_wrong_state_crc():
    stream = _change_state_crc(SEEDS["still"])
    verdicts = [
        judge.judge("decode", stream, has_forged_crcs=is_forged) for is_forged in (False, True)
    ]

    assert [verdict.outcome for verdict in verdicts] == ["state-crc", "decoded"]


def _change_state_crc(stream):
    chunks = [(chunk.kind, chunk.payload) for chunk in split_chunks(stream)]
    chunks[1] = (chunks[1][0], chunks[1][1][:-4] + bytes(4))
    return rebuild_stream(chunks)


def test_blocks_are_read_as_they_were_written(tmp_path):
    path = tmp_path / "blocks.jsonl"
    tally = blocks.judge_block(_SERIES, 0, 20, tmp_path)
    blocks.append_block(path, 0, 20, tally)
    with path.open("a") as file:
        file.write('{"first": 20, "cou')

    assert blocks.read_blocks(path) == {(0, 20): tally}
