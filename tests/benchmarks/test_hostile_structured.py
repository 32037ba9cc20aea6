import itertools
import json
import subprocess
import sys
from collections import Counter

import pytest

from hostile import blocks, judge
from hostile.structured.fault import Stage
from hostile.structured.generator import RecordGenerator
from hostile.structured.maker import StructuredMaker, build_donors
from hostile.structured.pieces import assemble
from quarc_ref.decoder import reconstruct
from quarc_ref.format.errors import CountError
from quarc_ref.streams import decode
from tests.benchmarks.test_hostile import SCRIPT
from tests.engines import needs_fast
from tests.small_streams import make_stream

_FAULT_COUNT = 84


@pytest.fixture(scope="module")
def maker():
    return StructuredMaker(0)


@pytest.fixture(scope="module")
def streams(maker, pytestconfig):
    rounds = 4 if pytestconfig.getoption("--thorough") else 1
    return [maker.make(number) for number in range(rounds * _FAULT_COUNT)]


@pytest.fixture(scope="module")
def outcomes(streams):
    return Counter(_judge(stream.data).outcome for stream in streams)


def _judge(data):
    return judge.judge(judge.BOTH_ENGINES_MODE, data, has_forged_crcs=False)


def test_a_series_and_a_number_reproduce_the_stream(streams):
    build_donors.cache_clear()
    same_series, other_series = StructuredMaker(0), StructuredMaker(1)

    assert [same_series.make(number) for number in (70, 0, 7)] == [streams[i] for i in (70, 0, 7)]
    assert [other_series.make(number).data for number in range(4)] != [
        stream.data for stream in streams[:4]
    ]


def test_every_kind_of_hostile_value_is_used(maker, streams):
    used_names = {name for stream in streams for name in stream.recipe[:1]}

    assert len(maker.faults) == _FAULT_COUNT
    assert used_names == {fault.name for fault in maker.faults if fault is not None}


@needs_fast
def test_both_engines_agree_and_no_other_error_is_raised(outcomes, streams):
    assert outcomes.total() == len(streams)
    assert outcomes["escape"] == outcomes["hang"] == 0
    assert outcomes["decoded"] > len(streams) / 20


@pytest.mark.thorough
@needs_fast
def test_few_streams_reach_most_reject_ids_including_the_deep_ones(outcomes):
    unreached_ids = blocks.Tally(outcomes=outcomes).list_missing_reject_ids()

    assert len(unreached_ids) <= 3
    assert not {
        *("degenerate-rotation", "unconsumed-words", "invalid-words", "bad-probability"),
        *("symbol-range", "count-exceeds-level", "position-range", "code-range"),
        *("rotation-range", "parent-range", "frame-order", "state-crc"),
    } & set(unreached_ids)


def test_streams_without_hostile_values_are_valid_and_have_many_frames(maker):
    faultless_streams = [maker.make(len(maker.faults) * number) for number in range(20)]
    frame_counts = [
        len(list(decode(stream.data))) for stream in faultless_streams if not stream.recipe
    ]

    assert len(frame_counts) > 10
    assert max(frame_counts) >= 5


@pytest.mark.parametrize("seed", range(4))
def test_any_two_faults_of_the_container_can_be_combined(maker, seed):
    pieces = maker._donors[0].pieces
    faults = [fault for fault in maker.faults if fault and fault.stage is Stage.STREAM]
    generator = RecordGenerator.from_seed(seed)

    combined = [
        second.change(generator, first.change(generator, pieces))
        for first, second in itertools.product(faults, faults)
    ]

    assert all(assemble(changed_pieces) for changed_pieces in combined)


def test_spliced_data_comes_from_another_stream(maker):
    fault_names = [fault.name if fault else "" for fault in maker.faults]
    fault_number = fault_names.index("chunks of another stream")
    payloads = {piece.payload for donor in maker._donors for piece in donor.pieces[1:-2]}
    spliced_streams = [
        maker.make(fault_number + len(fault_names) * round_number).data
        for round_number in range(20)
    ]

    assert sum(any(payload in data for payload in payloads) for data in spliced_streams) > 5


@needs_fast
def test_a_disagreement_of_the_engines_is_detected(streams, monkeypatch):
    rotate = reconstruct.rotate

    def change_rotations(rotations, residuals):
        changed_rotations = rotate(rotations, residuals)
        changed_rotations[3, -1] ^= 1
        return changed_rotations

    monkeypatch.setattr(reconstruct, "rotate", change_rotations)
    verdicts = [_judge(stream.data) for stream in streams[::84]]

    assert "escape" in {verdict.outcome for verdict in verdicts}
    assert any(
        "the engines differ: the reference engine returns" in verdict.detail for verdict in verdicts
    )


@needs_fast
def test_engines_with_different_reject_ids_are_detected(monkeypatch):
    data, _ = make_stream()

    def reject(*_arguments):
        message = "not by this engine"
        raise CountError(message)

    assert _judge(data).outcome == "decoded"
    monkeypatch.setattr(reconstruct, "rotate", reject)  # used only by the reference engine
    assert _judge(data).outcome == "escape"


@needs_fast
def test_the_command_lists_unreached_reject_ids_and_fails(tmp_path):
    command = [sys.executable, SCRIPT, "--structured", "--streams", "3", "--out", tmp_path]
    completed = subprocess.run([*command, "--json"], capture_output=True, text=True, check=False)
    report = json.loads(completed.stdout)

    assert completed.returncode == 1
    assert report["streams"] == report["modes"][judge.BOTH_ENGINES_MODE] == 3
    assert report["escapes"] == report["hangs"] == 0
    assert "degenerate-rotation" in report["unreached"]
    assert (tmp_path / "structured_0" / "blocks.jsonl").exists()
