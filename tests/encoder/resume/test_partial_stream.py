from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.encoder import EncodeOptions, encode_stream
from quarc_ref.encoder.resume.partial_stream import PartialStream, read_partial_stream
from quarc_ref.encoder.settings.config import StepSettings
from quarc_ref.encoder.settings.frames import UpdateSettings
from quarc_ref.encoder.stream_file import encode_file
from quarc_ref.format import container
from quarc_ref.format.errors import BadMagicError, PayloadCrcError, ResumeError
from quarc_ref.streams.chunk_reader import split_chunks
from quarc_ref.streams.source import BytesSource
from tests.encoder.toys import SMALL, make_capture
from tests.small_streams import make_stream, rebuild_stream
from tests.streams.edits import cut_bytes, join_bytes

# Enables all features that could carry information from frame to frame.
CONFIG = replace(
    SMALL,
    stream=replace(SMALL.stream, updates=True),
    steps=StepSettings(position_pixels=0.2, translation_change=0.004, translation_error=0.25),
    canonical=replace(
        SMALL.canonical, iterations=30, exposure_lr=0.2, exposure_from_iter=5, keyframe_interval=3
    ),
    motion=replace(SMALL.motion, iterations=8, warm_start="anchors", follow_exposures=True),
    updates=UpdateSettings(lr=0.5, rd_lambda=0.1),
    births=replace(SMALL.births, placement="errors", error_threshold=0.03, rd_selection=True),
    target_kb_per_frame=0.2,
)
_OPTIONS = EncodeOptions(CONFIG, 5, "cpu")


def _resume(path, data, options=_OPTIONS, frames=5):
    """Write the beginning of a stream to a file, encode to the file, and return its content."""
    path.write_bytes(data)
    encode_file(make_capture(frames), path, options)
    return path.read_bytes()


@pytest.fixture(scope="module")
def complete_stream(tmp_path_factory):
    path = tmp_path_factory.mktemp("resume") / "whole.quarc"
    encode_file(make_capture(5), path, _OPTIONS)
    return path.read_bytes()


def _chunk_ends(data):
    """Return the offset of the end of each chunk of a stream."""
    return [chunk.offset + chunk.byte_count() for chunk in split_chunks(data)]


@pytest.mark.parametrize("frame", range(4))
@pytest.mark.parametrize("extra_bytes", [0, 1, 25])
def test_an_interrupted_stream_is_resumed_to_the_same_bytes(
    frame, extra_bytes, complete_stream, tmp_path, monkeypatch
):
    monkeypatch.setattr(encode_stream, "train_canonical", None)  # frame 0 exists
    partial_data = complete_stream[: _chunk_ends(complete_stream)[3 + frame] + extra_bytes]

    assert _resume(tmp_path / "a.quarc", partial_data) == complete_stream


@pytest.mark.parametrize("cut_bytes", [60, 1])
def test_a_file_that_is_followed_does_not_become_shorter(
    cut_bytes, complete_stream, tmp_path, monkeypatch
):
    path, sizes, fit_motion = tmp_path / "a.quarc", [], encode_stream.fit_motion

    def fit_and_note_size(*arguments):
        sizes.append(path.stat().st_size)
        return fit_motion(*arguments)

    monkeypatch.setattr(encode_stream, "fit_motion", fit_and_note_size)
    ends = _chunk_ends(complete_stream)
    frame_2_end, tail_start = ends[5], ends[-2]
    for end in (frame_2_end - cut_bytes, tail_start - cut_bytes, len(complete_stream) - 1):
        sizes.clear()
        assert _resume(path, complete_stream[:end]) == complete_stream
        assert [end, *sizes] == sorted([end, *sizes])


class _DarkeningSource:
    """A picture source whose last camera takes darker pictures from frame to frame."""

    def __init__(self, capture):
        self._capture = capture

    def read(self, camera, frame):
        picture = self._capture.image(camera, frame)
        return np.round(picture * (1 - 0.1 * frame if camera == 3 else 1)).astype(np.uint8)


def test_the_change_gate_is_the_same_after_resuming_when_exposures_change(tmp_path):
    births = replace(SMALL.births, max_births=3, split_iters=())  # placed by the gate
    canonical = replace(CONFIG.canonical, keyframe_interval=0)
    config = replace(CONFIG, births=births, canonical=canonical, target_kb_per_frame=0.0)
    options = replace(_OPTIONS, config=config, frames=4)
    capture = make_capture(4)
    capture._source = _DarkeningSource(make_capture(4))
    path = tmp_path / "a.quarc"
    encode_file(capture, path, options)
    whole = path.read_bytes()

    path.write_bytes(whole[: _chunk_ends(whole)[5]])  # frames 0 to 2
    encode_file(capture, path, options)

    assert path.read_bytes() == whole


@pytest.mark.parametrize("share", [0, 0.3, 0.999])
def test_without_a_complete_frame_the_stream_starts_again(share, complete_stream, tmp_path):
    before_frames, frame_0 = _chunk_ends(complete_stream)[2:4]
    partial_data = (
        complete_stream[: int(share * before_frames)]
        if share < 0.5
        else complete_stream[: frame_0 - 1]
    )

    assert _resume(tmp_path / "a.quarc", partial_data) == complete_stream


@pytest.mark.parametrize("garbage", [bytes(3000), bytes(range(256)) * 12])
def test_garbage_in_place_of_frame_0_is_ignored(garbage, complete_stream, tmp_path):
    before_frames, frame_0 = _chunk_ends(complete_stream)[2:4]
    partial_data = complete_stream[: (before_frames + frame_0) // 2] + garbage

    assert _resume(tmp_path / "a.quarc", partial_data) == complete_stream


def test_a_stream_of_another_encode_is_kept_even_without_a_complete_frame(
    complete_stream, tmp_path
):
    path, (before_frames, *_) = tmp_path / "a.quarc", _chunk_ends(complete_stream)[2:]
    partial_data = complete_stream[: before_frames + 40]
    other_options = replace(_OPTIONS, config=replace(CONFIG, seed=9))

    with pytest.raises(ResumeError, match="these differ: seed; encode to another file, or use"):
        _resume(path, partial_data, other_options)
    assert path.read_bytes() == partial_data


def test_a_stream_that_is_damaged_before_its_first_frame_is_unchanged(complete_stream, tmp_path):
    path = tmp_path / "a.quarc"
    for end in _chunk_ends(complete_stream)[:3]:
        damaged = bytearray(complete_stream)
        damaged[end - 5] ^= 1
        with pytest.raises(PayloadCrcError):
            _resume(path, bytes(damaged))

        assert path.read_bytes() == damaged


def test_damage_ends_the_intact_part(complete_stream, tmp_path):
    ends = _chunk_ends(complete_stream)
    damaged = bytearray(complete_stream)
    damaged[ends[4] + 30] ^= 1  # in frame 2
    zeroed = complete_stream[: ends[4]] + bytes(100)

    assert _resume(tmp_path / "a.quarc", bytes(damaged)) == complete_stream
    assert _resume(tmp_path / "b.quarc", zeroed) == complete_stream


@pytest.mark.parametrize("missing_chunks", [0, 1])
def test_a_stream_without_its_end_is_completed(
    missing_chunks, complete_stream, tmp_path, monkeypatch
):
    monkeypatch.setattr(encode_stream, "fit_motion", None)  # all frames exist

    assert (
        _resume(
            tmp_path / "a.quarc",
            complete_stream[: _chunk_ends(complete_stream)[-2 - missing_chunks]],
        )
        == complete_stream
    )


def test_a_finished_file_is_unchanged(complete_stream, tmp_path):
    path = tmp_path / "a.quarc"
    path.write_bytes(complete_stream)
    before = path.stat().st_mtime_ns
    encode_file(make_capture(5), path, _OPTIONS)

    assert path.stat().st_mtime_ns == before
    assert path.read_bytes() == complete_stream


def test_a_file_is_written_by_one_encode_at_a_time(complete_stream, tmp_path):
    path, message = tmp_path / "a.quarc", []

    class SecondEncode:
        def advance(self, stage, _done, _total):
            if stage == "frames" and not message:
                with pytest.raises(ResumeError) as caught:
                    encode_file(make_capture(5), path, _OPTIONS)
                message.append(str(caught.value))

    encode_file(make_capture(5), path, replace(_OPTIONS, progress=SecondEncode()))

    assert message == [f"{path} is being written by another process"]
    assert path.read_bytes() == complete_stream


def _replace_metadata(data, **changes):
    chunks = [
        (chunk.kind, chunk.payload)
        for chunk in split_chunks(data)
        if chunk.kind not in (container.INDX, container.TAIL)
    ]
    partial_stream = read_partial_stream(BytesSource(data))
    metadata = container.wire.build_metadata({**partial_stream.metadata, **changes})
    chunks[2] = (container.META, metadata)
    return rebuild_stream(chunks)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seed": 1}, "these differ: seed;"),
        ({"motion": replace(CONFIG.motion, lr=0.5)}, "these differ: motion.lr;"),
        (
            {"rd_lambda": 2.0, "motion": replace(CONFIG.motion, momentum=0.1)},
            "these differ: motion.momentum, rd_lambda;",
        ),
    ],
)
def test_other_settings_are_rejected_by_name(changes, message, complete_stream, tmp_path):
    partial_data = complete_stream[: _chunk_ends(complete_stream)[4]]
    options = replace(_OPTIONS, config=replace(CONFIG, **changes))
    with pytest.raises(ResumeError, match=message):
        _resume(tmp_path / "a.quarc", partial_data, options)

    assert (tmp_path / "a.quarc").read_bytes() == partial_data


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("capture", "capture"),
        ("fingerprint", r"fingerprint \(of the capture's files, including masks\)"),
        ("encoder", r"encoder \(the version of quarc-ref or of a library\)"),
    ],
)
def test_another_capture_or_encoder_is_rejected(name, message, complete_stream, tmp_path):
    changed_stream = _replace_metadata(complete_stream, **{name: "another"})
    with pytest.raises(
        ResumeError, match=f"encoded with different inputs; these differ: {message};"
    ):
        _resume(tmp_path / "a.quarc", changed_stream)


def test_other_cameras_or_another_time_base_are_rejected(complete_stream, tmp_path):
    capture = make_capture(5)
    capture.cameras = (replace(capture.cameras[0], fx=51.0), *capture.cameras[1:])
    capture.frames_per_second = 25.0
    (tmp_path / "a.quarc").write_bytes(complete_stream)
    expected_message = r"these differ: cameras \(--downscale, --held-out\), timescale;"
    with pytest.raises(ResumeError, match=expected_message):
        encode_file(capture, tmp_path / "a.quarc", _OPTIONS)


def test_frames_that_do_not_match_are_rejected(complete_stream, tmp_path):
    with pytest.raises(ResumeError, match="4 are requested: use --frames 5, or encode to"):
        _resume(tmp_path / "a.quarc", complete_stream, replace(_OPTIONS, frames=4))
    with pytest.raises(ResumeError, match=r"b\.quarc: the stream is complete with 5 frames, but 6"):
        _resume(tmp_path / "b.quarc", complete_stream, replace(_OPTIONS, frames=6), frames=6)
    with pytest.raises(ResumeError, match=r"has 4 frames, but 3 are .* --frames 4 or more"):
        _resume(
            tmp_path / "c.quarc",
            complete_stream[: _chunk_ends(complete_stream)[6]],
            replace(_OPTIONS, frames=3),
        )


def test_an_edited_stream_is_rejected(complete_stream, tmp_path):
    cut_stream, joined_stream = (
        cut_bytes(complete_stream, 3),
        join_bytes(complete_stream, complete_stream),
    )
    with pytest.raises(ResumeError, match="frame 0 of the stream does not match"):
        _resume(tmp_path / "a.quarc", cut_stream)
    with pytest.raises(ResumeError, match="these differ: fingerprint"):
        _resume(tmp_path / "b.quarc", joined_stream, replace(_OPTIONS, frames=10), frames=10)


def test_a_file_that_is_not_a_stream_is_unchanged(tmp_path):
    with pytest.raises(BadMagicError):
        _resume(tmp_path / "a.quarc", b"my thesis")

    assert (tmp_path / "a.quarc").read_bytes() == b"my thesis"


def test_chunks_that_the_encoder_does_not_write_are_rejected():
    data, _ = make_stream(gaussian_count=8, frame_count=2)
    kinds = [(chunk.kind, chunk.payload) for chunk in split_chunks(data)]
    for position in (1, 2, 4):
        with pytest.raises(ResumeError, match="not in the order"):
            read_partial_stream(
                BytesSource(rebuild_stream([*kinds[:position], (b"more", b""), *kinds[position:]]))
            )


def test_complete_frames_are_reported():
    data, states = make_stream(gaussian_count=8, frame_count=3)
    ends = _chunk_ends(data)

    assert [read_partial_stream(BytesSource(data[:end])) for end in (0, 4, *ends[:2])] == [None] * 4
    empty, part, finished = (
        read_partial_stream(BytesSource(data[:end])) for end in (ends[3] - 1, ends[4] + 9, ends[-1])
    )
    assert isinstance(empty, PartialStream)
    assert (empty.frames, empty.end, empty.is_finished) == ((), 0, False)
    assert isinstance(part, PartialStream)
    assert (len(part.frames), part.end, part.is_finished) == (2, ends[4], False)
    assert (len(finished.frames), finished.end, finished.is_finished) == (3, ends[5], True)
    assert part.header == states[0].scene.header
