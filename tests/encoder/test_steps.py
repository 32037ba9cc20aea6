from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.datasets.capture import Points
from quarc_ref.encoder.config import EncoderConfig, StepSettings
from quarc_ref.encoder.encode_stream import suit_capture
from quarc_ref.encoder.steps import measure_pixel, measure_spacing, propose_steps
from quarc_ref.encoder.straight_through import position_step, translation_step
from quarc_ref.format.constants import POSITION_LIMIT
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import StreamHeader
from tests.encoder.toys import make_cameras, make_capture

_COUNT = 1000
_ASKED = StepSettings(position_pixels=0.25, translation_spacing=0.5)


_TOY = make_cameras(), make_capture().points


def _scaled(factor: float):
    """Return the toy's cameras and points in other units of length."""
    cameras, points = _TOY
    cameras = [
        replace(camera, translation=tuple(factor * x for x in camera.translation))
        for camera in cameras
    ]
    return cameras, Points((factor * points.positions).astype(np.float32), points.colors)


def _propose(factor: float = 1.0, settings: StepSettings = _ASKED) -> StreamHeader:
    return propose_steps(StreamHeader(), settings, *_scaled(factor), _COUNT)


def test_a_pixel_is_as_wide_as_the_median_point_is_far_over_the_focal_length():
    camera = replace(make_cameras()[0], rotation=(1.0, 0, 0, 0, 1, 0, 0, 0, 1))
    depths = np.array([1.0, 2, 3, -3, 2])
    positions = np.stack([[0, 0, 0, 0, 9], np.zeros(5), depths - 3], axis=1)
    points = Points(positions.astype(np.float32), np.zeros((5, 3), dtype=np.uint8))

    assert measure_pixel([camera], points) == pytest.approx(2 / 50)


def test_gaussians_are_as_far_apart_as_the_pixels_to_each_say():
    cameras = [replace(camera, width=60, height=40) for camera in make_cameras()]

    assert measure_spacing(cameras, 600) == pytest.approx(2.0)


def test_steps_are_the_pixels_and_the_spacings_asked_for():
    pixel = measure_pixel(*_TOY)
    spacing = pixel * measure_spacing(_TOY[0], _COUNT)

    header = _propose()

    assert position_step(header) == pytest.approx(0.25 * pixel, rel=1 / 16)
    assert translation_step(header) == pytest.approx(0.5 * spacing, rel=1 / 16)
    assert 8 <= header.position_step <= 16


def test_a_capture_in_units_of_an_eighth_differs_in_the_lattice_exponent_alone():
    header, larger = _propose(), _propose(8.0)

    assert larger == replace(header, lattice_exponent=header.lattice_exponent - 3)


@given(st.floats(1e-2, 1e3))
def test_steps_in_pixels_do_not_hang_on_the_unit_of_length(factor):
    header, other = _propose(), _propose(factor)

    assert position_step(other) == pytest.approx(factor * position_step(header), rel=1 / 7)
    assert translation_step(other) == pytest.approx(factor * translation_step(header), rel=1 / 7)


@given(st.floats(1e-4, 1.0))
def test_the_lattice_reaches_beyond_the_cameras_and_the_points(pixels):
    cameras, points = _TOY
    far = Points(np.concatenate([points.positions, [[9e3, 0, 0]]]), points.colors)

    header = propose_steps(StreamHeader(), StepSettings(pixels, pixels), cameras, far, _COUNT)

    assert 4 * 9e3 * 2.0**header.lattice_exponent <= POSITION_LIMIT


def test_without_pixels_the_steps_of_the_stream_stand():
    assert _propose(settings=StepSettings()) == StreamHeader()


def test_one_step_can_stand_in_world_units_while_the_other_is_in_pixels():
    header = _propose(settings=StepSettings(position_pixels=0.25))

    assert translation_step(header) == pytest.approx(translation_step(StreamHeader()), rel=1 / 16)
    assert position_step(header) == pytest.approx(position_step(_propose()), rel=1 / 16)


def test_points_that_no_view_sees_give_no_steps():
    cameras, points = _TOY
    behind = Points(points.positions + np.float32(1e3), points.colors)

    with pytest.raises(EncodeError, match="no training view"):
        propose_steps(StreamHeader(), _ASKED, cameras, behind, _COUNT)


def test_the_stream_of_an_encode_has_the_steps_of_its_training_views():
    capture = make_capture()
    training = [capture.cameras[index] for index in capture.training]

    suited = suit_capture(EncoderConfig(steps=_ASKED), capture)

    most = EncoderConfig().canonical.max_gaussians
    proposed = propose_steps(StreamHeader(), _ASKED, training, capture.points, most)
    assert suited.stream == proposed != StreamHeader()
