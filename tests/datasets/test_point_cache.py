"""Tests that triangulated points are cached until the inputs of triangulation change."""

import logging

import numpy as np
import pytest

from quarc_ref.datasets import choose_points as choose_points_module
from quarc_ref.datasets.capture import Points
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.datasets.point_cache import load_or_compute_points, make_cache_key


@pytest.fixture(autouse=True)
def cache_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "quarc-ref" / "points"


@pytest.fixture
def triangulations(monkeypatch):
    """A list with an element for each triangulation."""
    calls = []

    def triangulate(*_):
        calls.append(1)
        rng = np.random.default_rng(len(calls))
        positions = rng.uniform(-0.5, 0.5, (50, 3)).astype(np.float32)
        return Points(positions, rng.integers(0, 255, (50, 3)).astype(np.uint8))

    monkeypatch.setattr(choose_points_module, "triangulate", triangulate)
    return calls


@pytest.fixture
def capture_without_points(n3dv_folder, tmp_path):
    """A capture without a file of initial points."""
    folder = tmp_path / "bare"
    folder.mkdir()
    for path in n3dv_folder.iterdir():
        if path.suffix != ".ply":
            (folder / path.name).write_bytes(path.read_bytes())
    return folder


def test_a_second_opening_has_the_same_points_without_triangulation(
    capture_without_points, triangulations, caplog
):
    caplog.set_level(logging.INFO)
    first, second = open_capture(capture_without_points), open_capture(capture_without_points)

    assert len(triangulations) == 1
    assert np.array_equal(first.points.positions, second.points.positions)
    assert np.array_equal(first.points.colors, second.points.colors)
    assert "triangulating them, and saving them to" in caplog.messages[0]
    assert "initial points that were triangulated earlier" in caplog.messages[1]


def test_other_pictures_cameras_or_frames_have_their_own_points(
    capture_without_points, triangulations
):
    open_capture(capture_without_points)
    open_capture(capture_without_points, CaptureOptions(held_out=("cam01",)))
    open_capture(capture_without_points, CaptureOptions(start=1))
    open_capture(capture_without_points, CaptureOptions(downscale=2))
    (capture_without_points / "cam01.mp4").write_bytes(
        (capture_without_points / "cam03.mp4").read_bytes()
    )
    open_capture(capture_without_points)

    assert len(triangulations) == 5


def test_a_damaged_file_is_detected_and_rewritten(
    capture_without_points, triangulations, cache_folder
):
    open_capture(capture_without_points)
    (cached_file,) = cache_folder.iterdir()
    data = cached_file.read_bytes()
    cached_file.write_bytes(data[:-1])
    open_capture(capture_without_points)

    assert len(triangulations) == 2
    assert len(cached_file.read_bytes()) == len(data)


def test_a_cache_that_cannot_be_written_is_only_a_warning(cache_folder, caplog):
    cache_folder.parent.parent.mkdir()
    cache_folder.parent.write_bytes(b"")
    points = Points(np.zeros((1, 3), np.float32), np.zeros((1, 3), np.uint8))

    assert load_or_compute_points(make_cache_key("0", 0, 1, ["cam00"]), lambda: points) is points
    assert "cannot be saved" in caplog.text
