from pathlib import Path

import pytest

from quarc_ref.streams import Gap, recover
from quarc_ref.streams.chunk_reader import split_chunks
from tests.cli.commands import list_names, read_json, run, run_json
from tests.small_streams import make_stream

_DATA, _ = make_stream(gaussian_count=12, frame_count=9, canonical_every=3)
_INVALID = Path(__file__).parents[2] / "conformance" / "invalid"
_FRAMES = [chunk for chunk in split_chunks(_DATA) if chunk.kind in {b"CANO", b"FRAM"}]


def _flip_bit_in_frame(frame, data=_DATA):
    damaged_data = bytearray(data)
    damaged_data[_FRAMES[frame].offset + 30] ^= 1
    return bytes(damaged_data)


def _name_files(*frames):
    return [f"frame_{frame:04}.ply" for frame in frames]


@pytest.fixture
def file(tmp_path):
    return tmp_path / "some.quarc"


@pytest.mark.parametrize(
    ("data", "expected_frames"),
    [
        (_flip_bit_in_frame(1), [0, 3, 4, 5, 6, 7, 8]),
        (_flip_bit_in_frame(3), [0, 1, 2, 6, 7, 8]),
        (_flip_bit_in_frame(1, _flip_bit_in_frame(7)), [0, 3, 4, 5, 6]),
        (_DATA[: _FRAMES[5].offset + 9], [0, 1, 2, 3, 4]),
    ],
)
def test_frames_after_damage_are_written_and_gaps_reported(data, expected_frames, file, tmp_path):
    file.write_bytes(data)
    result = run("decode", file, "-o", tmp_path / "out", "--recover", "--json", "-q")

    gaps = [frame_or_gap for frame_or_gap in recover(data) if isinstance(frame_or_gap, Gap)]
    json_output = read_json(result.stdout)
    assert result.exit_code == 1
    assert json_output["files"] == _name_files(*expected_frames) == list_names(tmp_path / "out")
    assert [
        (gap["offset"], gap["byte_count"], gap["reject_id"]) for gap in json_output["gaps"]
    ] == [(gap.offset, gap.byte_count, gap.reject_id) for gap in gaps]
    lines = result.stderr.splitlines()
    assert len(lines) == len(gaps)
    for line, gap in zip(lines, gaps, strict=True):
        assert line.startswith(f"quarc-ref: gap at byte {gap.offset}, {gap.byte_count:,} bytes")
        assert gap.message in line


@pytest.mark.parametrize("options", [[], ["--follow", "--patience", 0]])
def test_damage_after_the_requested_frames_is_no_gap(options, file, tmp_path):
    file.write_bytes(_flip_bit_in_frame(2))
    json_output = run_json(
        "decode", file, "-o", tmp_path / "out", "--recover", "--frames", ":2", *options
    )

    assert json_output["files"] == _name_files(0, 1)
    assert json_output["gaps"] == []


def test_an_intact_stream_has_no_gaps_and_ends_without_error(file, tmp_path):
    file.write_bytes(_DATA)
    json_output = run_json("decode", file, "-o", tmp_path / "out", "--recover")

    assert json_output["gaps"] == []
    assert json_output["files"] == _name_files(*range(9))


def test_of_a_range_with_damage_the_remaining_frames_are_written(file, tmp_path):
    file.write_bytes(_flip_bit_in_frame(1))
    result = run("decode", file, "-o", tmp_path / "out", "--recover", "--frames", "2:5")

    assert result.exit_code == 1
    assert "gaps" in result.stdout
    assert list_names(tmp_path / "out") == _name_files(3, 4)


def test_damage_after_the_range_is_not_reached(file, tmp_path):
    file.write_bytes(_flip_bit_in_frame(7))

    json_output = run_json("decode", file, "-o", tmp_path / "out", "--recover", "--frames", "2:5")
    assert json_output["files"] == _name_files(2, 3, 4)


def test_if_nothing_can_be_recovered_nothing_is_written(file, tmp_path):
    file.write_bytes(_flip_bit_in_frame(0, _flip_bit_in_frame(3, _flip_bit_in_frame(6))))
    result = run("decode", file, "-o", tmp_path / "out", "--recover", "--json", "-q")

    assert result.exit_code == 1
    assert read_json(result.stdout)["folder"] is None
    assert read_json(result.stdout)["files"] == []
    assert read_json(result.stdout)["gaps"] != []
    assert list_names(tmp_path) == ["some.quarc"]


def test_a_stream_without_a_head_is_rejected(file, tmp_path):
    file.write_bytes(_DATA[:20])
    result = run("decode", file, "-o", tmp_path / "out", "--recover")

    assert result.exit_code == 1
    assert "rejected: truncated" in result.stderr
    assert list_names(tmp_path) == ["some.quarc"]


@pytest.mark.parametrize(
    ("data", "options", "expected_message"),
    [
        (_DATA[:-1], [], "complete frames before the error: 9; --recover keeps them"),
        (_DATA[: _FRAMES[5].offset + 9], [], "complete frames before the error: 5; --recover"),
        (_DATA[: _FRAMES[1].offset + 9], [], "complete frames before the error: 1; --recover"),
        (_flip_bit_in_frame(3), [], "complete frames before the error: 3; --recover"),
        (_DATA[:-1], ["--frames", "2:"], "complete frames of --frames 2: before the error: 7"),
    ],
)
def test_an_interrupted_decode_says_how_many_frames_can_be_recovered(
    data, options, expected_message, file, tmp_path
):
    file.write_bytes(data)
    command = ["decode", file, "-o", tmp_path / "out", *options]
    rejected_run = run(*command)
    recovered_run = run(*command, "--recover")

    assert rejected_run.exit_code == 1
    assert expected_message in rejected_run.stderr
    assert rejected_run.stderr.count("\n") == 1
    assert "--recover" not in recovered_run.stderr
    frame_count = int(expected_message.rpartition(": ")[2].partition(";")[0])
    first_frame = 2 if options else 0
    assert list_names(tmp_path / "out")[:frame_count] == _name_files(
        *range(first_frame, first_frame + frame_count)
    )


@pytest.mark.parametrize(
    "data", [_DATA[: _FRAMES[0].offset + 9], _DATA[:12], b"not a stream at all"]
)
def test_without_a_complete_frame_nothing_is_promised(data, file, tmp_path):
    file.write_bytes(data)
    result = run("decode", file, "-o", tmp_path / "out")

    assert result.exit_code == 1
    assert "--recover" not in result.stderr


def test_a_followed_decode_keeps_its_frames_without_recovery(file, tmp_path):
    file.write_bytes(_DATA[: _FRAMES[5].offset + 9])
    options = ["--follow", "--patience", "0"]
    result = run("decode", file, "-o", tmp_path / "out", *options)

    assert result.exit_code == 1
    assert "--recover" not in result.stderr
    assert list_names(tmp_path / "out") == _name_files(*range(5))


def test_an_unrecoverable_stream_is_rejected_without_a_promise(tmp_path):
    result = run("decode", _INVALID / "critical.quarc", "-o", tmp_path / "out")

    assert result.exit_code == 1
    assert "unknown-critical" in result.stderr
    assert "--recover" not in result.stderr


def test_frames_that_share_a_file_can_be_recovered_as_well(file, tmp_path):
    pytest.importorskip("pxr")
    file.write_bytes(_DATA[:-1])
    result = run("decode", file, "-o", tmp_path / "all.usdc")

    assert result.exit_code == 1
    assert "complete frames before the error: 9; --recover keeps them" in result.stderr
