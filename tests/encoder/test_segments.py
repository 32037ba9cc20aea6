import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.datasets.open_capture import CaptureOptions
from quarc_ref.encoder import EncodeOptions, encode, encode_stream
from quarc_ref.encoder.segments import (
    Segment,
    encode_segment,
    require_finished,
    slice_capture,
    split_frames,
)
from quarc_ref.format.errors import EncodeError, ResumeError, UnusableCaptureError
from tests.datasets import scenes
from tests.encoder.toys import SMALL, make_capture
from tests.streams.edits import join_bytes

_CONFIG = replace(
    SMALL,
    canonical=replace(SMALL.canonical, iterations=5),
    motion=replace(SMALL.motion, iterations=2),
    births=replace(SMALL.births, iterations=0),
)
_OPTIONS = EncodeOptions(_CONFIG, device="cpu")


@given(st.integers(1, 500), st.data())
def test_segments_cover_all_frames_once_in_even_lengths(frame_count, data):
    segment_count = data.draw(st.integers(1, frame_count))
    spans = split_frames(frame_count, segment_count)

    assert [frame for first, count in spans for frame in range(first, first + count)] == [
        *range(frame_count)
    ]
    assert len(spans) == segment_count
    assert max(count for _, count in spans) - min(count for _, count in spans) <= 1


@pytest.mark.parametrize("segment_count", [0, 6])
def test_more_segments_than_frames_are_rejected(segment_count):
    with pytest.raises(ValueError, match=r"^5 frames cannot be split"):
        split_frames(5, segment_count)


def test_a_single_frame_is_named_in_the_singular():
    with pytest.raises(ValueError, match=r"^1 frame cannot be split into 2 segments"):
        split_frames(1, 2)


def test_a_segment_of_a_capture_has_its_own_pictures():
    capture = make_capture(5)
    segment = slice_capture(capture, 2, 3)

    assert segment.frame_count == 3
    for frame in range(3):
        assert np.array_equal(segment.image(1, frame), capture.image(1, frame + 2))
    assert not np.array_equal(segment.image(1, 0), capture.image(1, 0))
    with pytest.raises(ValueError, match="frame 3"):
        segment.image(0, 3)
    assert segment.start == capture.start + 2
    for name in ("name", "cameras", "frames_per_second", "points", "fingerprint", "training"):
        assert getattr(segment, name) == getattr(capture, name)


@pytest.mark.parametrize(("start", "failing"), [(0, "add_first_frame"), (7, "add_frame")])
def test_errors_of_a_segment_name_the_frame_of_the_capture(monkeypatch, start, failing):
    def fail(*_arguments):
        message = "no room"
        raise EncodeError(message)

    capture = make_capture(5)
    capture.start = start
    monkeypatch.setattr(encode_stream._Encoding, failing, fail)
    with pytest.raises(EncodeError) as caught:
        encode(slice_capture(capture, 2, 3), io.BytesIO(), _OPTIONS)

    frame = start + (2 if failing == "add_first_frame" else 3)
    assert str(caught.value) == f"frame {frame} of the capture: no room"


@pytest.fixture(scope="module")
def joined_stream():
    parts = []
    for first, count in split_frames(3, 2):
        sink = io.BytesIO()
        encode(slice_capture(make_capture(3), first, count), sink, _OPTIONS)
        parts.append(sink.getvalue())
    return join_bytes(*parts)


def _make_segments(count):
    return [
        Segment(Path("capture"), CaptureOptions(), _OPTIONS, first, length, Path("a.quarc"))
        for first, length in split_frames(3, count)
    ]


def test_a_joined_stream_is_recognized(joined_stream, tmp_path):
    path, segments = tmp_path / "a.quarc", _make_segments(2)
    path.write_bytes(joined_stream)
    other_options = replace(_OPTIONS, config=replace(_CONFIG, seed=1))

    require_finished(path, make_capture(3), _OPTIONS, segments)
    with pytest.raises(ResumeError, match="these differ: seed"):
        require_finished(path, make_capture(3), other_options, segments)
    with pytest.raises(ResumeError, match=f"{path}: the stream is complete with 3 frames, but"):
        require_finished(path, make_capture(3), replace(_OPTIONS, frames=2), segments)
    path.write_bytes(joined_stream[:-1])
    with pytest.raises(ResumeError, match="not a complete stream"):
        require_finished(path, make_capture(3), _OPTIONS, segments)


@pytest.mark.parametrize("segment_count", [1, 3])
def test_a_stream_that_was_joined_from_other_segments_is_rejected(
    segment_count, joined_stream, tmp_path
):
    path = tmp_path / "a.quarc"
    path.write_bytes(joined_stream)

    with pytest.raises(ResumeError, match=f"{path}: .* not encoded in these segments"):
        require_finished(path, make_capture(3), _OPTIONS, _make_segments(segment_count))


def test_a_segment_that_begins_with_a_single_training_camera_is_rejected(tmp_path):
    folder = scenes.write_n3dv(
        tmp_path / "plane", scenes.make_shots(3), 4, scenes.make_plane_points()
    )
    (folder / "quarc-capture.json").write_text('{"ignored_frames": {"cam01": [2]}}')
    segment = Segment(folder, CaptureOptions(start=1), _OPTIONS, 1, 2, tmp_path / "b.quarc")

    with pytest.raises(UnusableCaptureError, match=r"^frame 2 begins a segment"):
        encode_segment(segment)
