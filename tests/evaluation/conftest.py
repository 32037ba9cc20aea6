"""A small capture with a stream and measurements; tests must not modify these files."""

import pytest

from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.evaluation.evaluate import evaluate_stream
from tests.datasets import scenes
from tests.evaluation.capture_streams import write_stream


def ignore_progress(_stage, _done, _total):
    """Ignore progress."""


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    """A capture of four cameras, 48 x 32, four frames, in N3DV's layout."""
    folder = tmp_path_factory.mktemp("evaluation") / "plane"
    return scenes.write_n3dv(folder, scenes.make_shots(), 4, scenes.make_plane_points())


@pytest.fixture(scope="session")
def capture(folder):
    return open_capture(folder, CaptureOptions(held_out=("cam01", "cam04")))


@pytest.fixture(scope="session")
def stream(capture):
    metadata = {"capture": "<b>plane</b>", "settings": "motion.lr=0.1"}
    return write_stream(capture.cameras, 4, metadata)


@pytest.fixture(scope="session")
def evaluation(stream, folder):
    return evaluate_stream(stream, folder, ignore_progress)
