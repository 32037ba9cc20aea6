import numpy as np
import pytest

from quarc_ref.datasets.capture import Capture
from quarc_ref.format.cameras import Camera
from tests.datasets import scenes

IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
SIZE = (32, 48, 3)


class CountingPictures:
    """Gray pictures whose gray level identifies camera and frame; records each read."""

    def __init__(self):
        self.reads = []

    def read(self, camera, frame):
        self.reads.append((camera, frame))
        return np.full(SIZE, 10 * camera + frame, dtype=np.uint8)


def make_capture(source, cache_bytes=1 << 20):
    cameras = [
        Camera(name, 48, 32, 40, 40, 24, 16, IDENTITY, (0.0, 0.0, 0.0), 1.0, name == "b")
        for name in "abc"
    ]
    return Capture("gray", cameras, 9, 30.0, scenes.make_plane_points(), source, "00", cache_bytes)


def test_cameras_are_either_for_training_or_held_out():
    capture = make_capture(CountingPictures())

    assert (capture.training, capture.held_out) == ((0, 2), (1,))


def test_a_picture_is_read_once_and_is_read_only():
    source = CountingPictures()
    capture = make_capture(source)

    assert (capture.image(2, 3) == 23).all()
    assert capture.image(2, 3) is capture.image(2, 3)
    assert source.reads == [(2, 3)]
    assert not capture.image(2, 3).flags.writeable


def test_the_most_recent_pictures_are_cached_within_the_limit():
    source = CountingPictures()
    capture = make_capture(source, cache_bytes=2 * np.prod(SIZE))
    for frame in (0, 1, 0, 2):
        capture.image(0, frame)
    source.reads.clear()
    for frame in (0, 2, 1):
        capture.image(0, frame)

    assert source.reads == [(0, 1)]


def test_a_picture_beyond_the_limit_is_returned_uncached():
    source = CountingPictures()
    capture = make_capture(source, cache_bytes=1)

    assert (capture.image(0, 4) == 4).all()
    assert (capture.image(0, 5) == 5).all()


@pytest.mark.parametrize("frame", [-1, 9])
def test_a_missing_frame_is_rejected(frame):
    with pytest.raises(ValueError, match="not among the 9 frames"):
        make_capture(CountingPictures()).image(0, frame)
