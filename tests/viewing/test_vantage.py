import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format.constants import NEAR_FRACTION
from quarc_ref.viewing.vantage import find_up, stand_at
from tests.small_streams import CAMERA

NOWHERE = np.zeros((0, 3), dtype=np.float32)
angles = st.floats(-math.pi, math.pi)


def _camera(yaw, pitch, roll):
    """A camera at (1, 2, 3) in a world whose z points up."""
    turns = []
    for angle, (i, j) in ((roll, (0, 1)), (pitch, (1, 2)), (yaw, (2, 0))):
        turn = np.eye(3)
        turn[i, i] = turn[j, j] = math.cos(angle)
        turn[i, j], turn[j, i] = -math.sin(angle), math.sin(angle)
        turns.append(turn)
    level = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # looks along y, its down is -z
    rotation = turns[0] @ turns[1] @ turns[2] @ level
    center = np.array([1.0, 2.0, 3.0])
    return replace(
        CAMERA, rotation=tuple(rotation.ravel()), translation=tuple(-rotation @ center)
    ), rotation


def _orbit_axes(vantage):
    """The right, down and forward of what looks at the target with up on top."""
    forward = vantage.target - vantage.position
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, vantage.up)
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


@given(angles, st.floats(-1.4, 1.4), st.floats(-1.4, 1.4))
def test_an_orbit_begins_with_the_view_of_its_camera(yaw, pitch, roll):
    camera, rotation = _camera(yaw, pitch, roll)
    vantage = stand_at(camera, np.array([0.0, 0.0, 1.0]), NOWHERE)

    assert vantage.position == pytest.approx([1, 2, 3])
    assert _orbit_axes(vantage) == pytest.approx(rotation, abs=1e-5)


@given(angles, angles)
def test_a_camera_on_its_head_stays_there(yaw, pitch):
    camera, rotation = _camera(yaw, pitch, math.pi)
    vantage = stand_at(camera, np.array([0.0, 0.0, 1.0]), NOWHERE)

    assert _orbit_axes(vantage) == pytest.approx(rotation, abs=1e-5)


@given(angles, st.floats(-1.0, 1.0))
def test_a_camera_without_roll_turns_about_the_direction_up(yaw, pitch):
    vantage = stand_at(_camera(yaw, pitch, 0)[0], np.array([0.0, 0.0, 1.0]), NOWHERE)

    assert vantage.up == pytest.approx([0, 0, 1], abs=1e-6)


def test_the_target_is_in_the_depth_of_what_is_seen():
    camera, rotation = _camera(0.3, 0.1, 0)
    ahead = np.array([[0, 0, 2.0], [0.1, 0, 3.0], [0, 0.1, 4.0], [50, 0, 1.0], [0, 0, -9.0]])
    positions = (ahead @ rotation + [1, 2, 3]).astype(np.float32)
    vantage = stand_at(camera, np.array([0.0, 0.0, 1.0]), positions)

    assert np.linalg.norm(vantage.target - vantage.position) == pytest.approx(3, abs=1e-5)


def test_the_lens_is_that_of_the_camera():
    vantage = stand_at(CAMERA, np.array([0.0, -1.0, 0.0]), NOWHERE)

    assert math.tan(vantage.view_angle / 2) == pytest.approx(24 / 50)
    assert vantage.near == NEAR_FRACTION * CAMERA.near
    assert vantage.far > 100 * CAMERA.near


@pytest.mark.parametrize(
    ("axis", "up"),
    [
        (1, (1, 0, 0)),
        (2, (-1, 0, 0)),
        (3, (0, 1, 0)),
        (4, (0, -1, 0)),
        (5, (0, 0, 1)),
        (6, (0, 0, -1)),
    ],
)
def test_up_is_what_the_stream_says(axis, up):
    assert find_up([CAMERA], axis) == pytest.approx(up)


def test_up_is_else_what_the_cameras_have_in_common():
    rig = [_camera(yaw, pitch, 0)[0] for yaw in (0, 1.5, 3, 4.5) for pitch in (-0.4, 0.5)]

    assert find_up(rig, 0) == pytest.approx([0, 0, 1], abs=0.05)


def test_without_cameras_up_is_z():
    assert find_up([], 0) == pytest.approx([0, 0, 1])
