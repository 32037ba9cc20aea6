import pytest

from quarc_ref.decoder import compute_digest
from quarc_ref.format.records import StreamHeader
from quarc_ref.streams import decode
from tests.cli.commands import list_names, run, run_json
from tests.small_streams import make_stream

_DATA, _STATES = make_stream(gaussian_count=12, frame_count=9, canonical_every=3)
_DIGESTS = [compute_digest(state.scene) for state in _STATES]


@pytest.fixture
def long_file(tmp_path):
    path = tmp_path / "long.quarc"
    path.write_bytes(_DATA)
    return path


@pytest.mark.parametrize(
    ("frames", "start", "stop"),
    [(":", 0, 9), ("3:6", 3, 6), ("6:", 6, 9), (":4", 0, 4), ("3:99", 3, 9), ("3", 3, 4)],
)
def test_a_cut_has_the_frames_of_the_range_with_their_ordinals(
    frames, start, stop, long_file, tmp_path
):
    json_output = run_json("cut", long_file, "--frames", frames, "-o", tmp_path / "cut.quarc")

    data = (tmp_path / "cut.quarc").read_bytes()
    assert json_output == {
        "file": str(tmp_path / "cut.quarc"),
        "frames": stop - start,
        "bytes": len(data),
    }
    frames_and_digests = [(scene.frame, compute_digest(scene)) for scene in decode(data)]
    assert frames_and_digests == list(enumerate(_DIGESTS))[start:stop]


def test_the_joined_parts_equal_the_whole(long_file, tmp_path):
    parts = []
    for frames in (":3", "3:6", "6:"):
        parts.append(tmp_path / f"{len(parts)}.quarc")
        assert run("cut", long_file, "--frames", frames, "-o", parts[-1]).exit_code == 0
    result = run("join", *parts, "-o", tmp_path / "joined.quarc")

    assert result.exit_code == 0
    assert f"{len(_DATA):,} bytes" in result.stdout
    assert (tmp_path / "joined.quarc").read_bytes() == _DATA


@pytest.mark.parametrize(
    ("frames", "message"),
    [
        ("4:", "frames are 3 and 6"),
        ("7:", "frame is 6"),
        ("9:", "no frame 9"),
        ("3:3", "empty"),
        ("3-6", "A:B"),
    ],
)
def test_an_impossible_cut_is_a_usage_error_and_writes_nothing(
    frames, message, long_file, tmp_path
):
    result = run("cut", long_file, "--frames", frames, "-o", tmp_path / "cut.quarc")

    assert result.exit_code == 2
    assert message in result.stderr
    assert list_names(tmp_path) == ["long.quarc"]


def test_streams_that_do_not_match_are_a_usage_error_that_names_the_reason(long_file, tmp_path):
    other_data, _ = make_stream(StreamHeader(position_step=3), frame_count=1)
    (tmp_path / "other.quarc").write_bytes(other_data)
    result = run("join", long_file, tmp_path / "other.quarc", "-o", tmp_path / "joined.quarc")

    assert result.exit_code == 2
    assert "stream 2 differs from the first in position_step (4 and 3)" in result.stderr
    assert list_names(tmp_path) == ["long.quarc", "other.quarc"]


def test_a_damaged_stream_is_neither_cut_nor_joined(long_file, tmp_path):
    long_file.write_bytes(_DATA[:-1])
    cut_run = run("cut", long_file, "--frames", "6:", "-o", tmp_path / "a.quarc")
    join_run = run("join", long_file, long_file, "-o", tmp_path / "b.quarc")

    assert (cut_run.exit_code, join_run.exit_code) == (1, 1)
    assert "truncated" in cut_run.stderr
    assert list_names(tmp_path) == ["long.quarc"]


def test_the_frames_before_damage_can_be_cut_out(long_file, tmp_path):
    long_file.write_bytes(_DATA[:-1])

    assert run("cut", long_file, "--frames", "3:6", "-o", tmp_path / "a.quarc").exit_code == 0
    assert run_json("verify", tmp_path / "a.quarc")["frames"] == 3


@pytest.mark.parametrize("verb", ["cut", "join"])
def test_an_existing_target_is_replaced_only_with_force(verb, long_file, tmp_path):
    target = tmp_path / "old.quarc"
    target.write_text("mine")
    command = [verb, long_file, "-o", target, *(["--frames", ":"] if verb == "cut" else [])]

    rejected_run = run(*command)
    data_after_rejection = target.read_bytes()
    forced_run = run(*command, "--force")

    assert (rejected_run.exit_code, data_after_rejection) == (2, b"mine")
    assert forced_run.exit_code == 0
    assert target.read_bytes() == _DATA


def test_the_usage_of_join_shows_several_streams_once():
    usage_text = run("join", "-h").stdout.split("Write")[0]

    assert "FILE}..." in usage_text
    assert usage_text.count("...") == 1


def test_join_cannot_read_a_pipe_twice(long_file, tmp_path):
    result = run("join", long_file, "-", "-o", tmp_path / "b.quarc")

    assert result.exit_code == 2
    assert "twice" in result.stderr


@pytest.mark.parametrize("verb", ["cut", "join", "inspect"])
def test_a_missing_stream_is_a_usage_error(verb, tmp_path):
    extra_options = {"cut": ["--frames", ":", "-o", tmp_path / "x"], "join": ["-o", tmp_path / "x"]}
    for path in (tmp_path / "none.quarc", tmp_path):
        result = run(verb, path, *extra_options.get(verb, []))
        assert result.exit_code == 2
        assert "FILE" in result.stderr


@pytest.mark.parametrize("verb", ["cut", "join"])
def test_a_stream_and_json_cannot_both_go_to_standard_output(verb, long_file):
    extra_options = ["--frames", ":"] if verb == "cut" else []
    result = run(verb, long_file, *extra_options, "-o", "-", "--json")

    assert result.exit_code == 2
    assert result.stdout == ""
