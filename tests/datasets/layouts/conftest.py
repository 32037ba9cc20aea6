"""One traced capture, from which tests build every layout; they must not write into it."""

import pytest

from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.synth import SynthOptions, write_synthetic_capture
from tests.datasets.layouts.builders import TracedCapture


@pytest.fixture(scope="session")
def traced_capture(tmp_path_factory):
    """Four cameras of three frames, 64x48, which all see the points."""
    folder = tmp_path_factory.mktemp("traced") / "room"
    write_synthetic_capture(folder, SynthOptions(width=64, height=48, frames=3, cameras=3))
    capture = open_capture(folder)
    pictures = [
        [capture.image(camera, frame) for frame in range(capture.frame_count)]
        for camera in range(len(capture.cameras))
    ]
    return TracedCapture(folder, capture, pictures)
