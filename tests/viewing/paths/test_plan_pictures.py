"""Tests of the frame and the share of every picture on a path."""

import json
from dataclasses import replace

import pytest

from quarc_ref.format.records import StreamHeader
from quarc_ref.streams import BytesSource
from quarc_ref.viewing.outline import outline_stream
from quarc_ref.viewing.paths.plan_pictures import plan_pictures
from tests.small_streams import CAMERA, make_stream


@pytest.fixture
def outline():
    """A stream of the frames 3 to 102, 25 per second."""
    outline = outline_stream(BytesSource(make_stream(StreamHeader(timescale=25))[0]))
    return replace(outline, first_frame=3, chunk_headers=outline.chunk_headers[:1] * 100)


@pytest.fixture
def path(tmp_path):
    keyframes = [{"time": time, "camera": CAMERA.name} for time in (0, 2)]
    path = tmp_path / "path.json"
    path.write_text(json.dumps({"schema": "quarc-ref/camera-path/1", "keyframes": keyframes}))
    return str(path)


@pytest.mark.parametrize(("start", "first"), [(0, 3), (20, 20)])
def test_a_path_file_plays_whole_frames_from_the_first_requested_one(start, first, outline, path):
    assert 29 / 25 * 25 < 29  # times have rounding errors
    pictures = plan_pictures(outline, path, CAMERA, (start, None))

    assert [picture.frame for picture in pictures] == list(range(first, first + 51))
    assert {picture.share for picture in pictures} == {0}


def test_more_pictures_than_frames_are_between_frames(outline):
    pictures = plan_pictures(outline, None, CAMERA, (5, 7), 8)

    assert [picture.frame for picture in pictures] == [5, 5, 5, 5, 6, 6, 6, 6]
    assert [picture.share for picture in pictures] == [0, 0.25, 0.5, 0.75, 0, 0, 0, 0]
