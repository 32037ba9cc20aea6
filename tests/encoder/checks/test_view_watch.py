import io
import math
from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.datasets.capture import Capture
from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.checks.view_watch import ViewWatch
from tests.encoder.toys import SMALL, make_capture

_NAMES = ("a", "b", "c", "d")


def _watch(first_errors, start=0):
    watch = ViewWatch(_NAMES, start)
    watch.begin(first_errors)
    return watch


def _find(watch, errors, frame=5):
    return [finding.cameras for finding in watch.check(errors, frame)]


def test_errors_that_grow_in_all_views_are_not_reported():
    watch = _watch([0.01, 0.02, 0.03, 0.04])

    assert _find(watch, [0.05, 0.1, 0.15, 0.2]) == []
    assert _find(watch, [0.05, 0.1, 0.15, 0.39]) == []


def test_errors_that_grow_slowly_are_not_reported():
    watch = _watch([0.01, 0.02, 0.03, 0.04])

    for frame in range(10):
        assert _find(watch, [0.01, 0.02, 0.03, 0.04 * 1.9**frame]) == []


def test_a_view_whose_error_jumps_is_reported_once():
    watch = _watch([0.01, 0.02, 0.03, 0.04], start=100)

    (finding,) = watch.check([0.012, 0.1, 0.036, 0.048], 5)

    assert (finding.kind, finding.cameras) == ("camera-changed", ("b",))
    assert "in frame 105, the error of b grew 4.2 times as much" in finding.message
    assert '"ignored_frames": {"b": [[105, null]]}' in finding.message
    assert _find(watch, [0.012, 0.01, 0.036, 0.048]) == []
    assert _find(watch, [0.012, 0.03, 0.3, 0.048]) == [("c",)]


def test_views_without_pixels_and_tiny_errors_are_left_out():
    watch = _watch([math.nan, 1e-7, 0.03, 0.04])

    assert _find(watch, [0.5, 1.9e-3, 0.03, 0.04]) == []
    assert _find(watch, [math.nan, 1.9e-3, math.nan, 0.04]) == []
    assert _find(watch, [math.nan] * 4) == []
    assert _find(watch, [0.5] * 4) == []
    assert _find(_watch([]), []) == []


class _PushedSource:
    """Pictures of which those of camera 2 are shifted from frame 2 on."""

    def __init__(self, capture):
        self._capture = capture

    def read(self, camera, frame):
        picture = self._capture.image(camera, frame).copy()
        return np.roll(picture, 8, axis=1) if camera == 2 and frame >= 2 else picture


@pytest.mark.parametrize("is_pushed", [False, True])
def test_an_encode_reports_a_camera_that_is_pushed(is_pushed):
    capture = make_capture()
    config = replace(
        SMALL,
        canonical=replace(SMALL.canonical, exposure_lr=0.1),
        motion=replace(SMALL.motion, follow_exposures=True),
    )
    if is_pushed:
        capture = Capture(
            capture.name, capture.cameras, 4, 30.0, capture.points, _PushedSource(capture), "0"
        )
    findings = []
    options = EncodeOptions(config, device="cpu", checks=False, report=findings.append)

    encode(capture, io.BytesIO(), options)

    changed = [finding for finding in findings if finding.kind == "camera-changed"]
    assert [finding.cameras for finding in changed] == ([("cam02",)] if is_pushed else [])
    assert not is_pushed or changed[0].message.startswith("in frame 2, ")
