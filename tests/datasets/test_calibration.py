import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quarc_ref.datasets.calibration import (
    CalibratedCamera,
    Lens,
    choose_near,
    make_camera,
    make_pose,
    measure_depths,
    require_video_size,
)
from quarc_ref.datasets.errors import UnreadablePoseError
from tests.datasets import scenes

coordinates = st.tuples(*[st.floats(-5.0, 5.0)] * 3)


@settings(deadline=None, max_examples=50)
@given(center=coordinates, target=coordinates, points=st.lists(coordinates, min_size=1, max_size=5))
def test_a_pose_projects_like_dot_products_with_the_axes(center, target, points):
    direction = np.subtract(target, center)
    if np.linalg.norm(np.cross(direction, (0, 0, 1))) < 1e-3:
        return
    shot = scenes.Shot("a", 48, 32, 40.0, 41.0, 20.0, 17.0, scenes.look_at(center, target), center)
    positions = np.array(points)
    positions = positions[np.abs((positions - center) @ shot.axes[:, 2]) > 1e-3]
    lens = Lens(shot.width, shot.height, shot.fx, shot.fy, shot.cx, shot.cy)
    camera = CalibratedCamera("a", lens, make_pose(shot.axes, shot.center))

    expected = shot.project(positions).reshape(-1, 3)
    assert np.allclose(scenes.project(camera, positions), expected, rtol=1e-6, atol=1e-6)


def test_axes_with_four_digits_become_a_rotation():
    rounded_axes = np.round(scenes.look_at((1, -3, 2), (0, 0, 0)), 4)
    rotation = make_pose(rounded_axes, (1, -3, 2)).rotation

    assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-15)
    assert np.allclose(rotation, rounded_axes.T, atol=1e-4)


@pytest.mark.parametrize(
    ("axes", "error"),
    [
        (np.diag([1.0, 1.0, -1.0]), "left-handed"),
        (np.diag([1.0, 1.0, 1.1]), "not orthonormal"),
        (np.zeros((3, 3)), "not orthonormal"),
        (np.full((3, 3), np.nan), "non-finite"),
    ],
)
def test_axes_that_are_not_a_rotation_are_rejected(axes, error):
    with pytest.raises(ValueError, match=error):
        make_pose(axes, np.zeros(3))


def test_a_center_that_is_not_finite_is_rejected():
    with pytest.raises(ValueError, match="non-finite"):
        make_pose(np.eye(3), [0, np.inf, 0])


@pytest.mark.parametrize(
    "lens",
    [(0, 32, 40, 40, 24, 16), (48, 32, -40, 40, 24, 16), (48, 32, 40, 40, float("nan"), 16)],
)
def test_an_impossible_lens_is_rejected(lens):
    with pytest.raises(ValueError, match=r"positive|finite"):
        Lens(*lens)


def test_only_a_perspective_lens_without_distortion_is_a_pinhole():
    assert Lens(48, 32, 40, 40, 24, 16, (0.0, 0.0)).is_pinhole
    assert not Lens(48, 32, 40, 40, 24, 16, (0.0, 1e-3)).is_pinhole
    assert not Lens(48, 32, 40, 40, 24, 16, (), fisheye=True).is_pinhole


def test_depths_are_those_in_front_and_inside():
    camera = CalibratedCamera("a", Lens(40, 20, 10, 10, 20, 10), make_pose(np.eye(3), np.zeros(3)))
    positions = np.array(
        [
            [0, 0, 2],  # in the middle of the picture
            [-3.9, 1.9, 2],  # in a corner of the picture
            [4.1, 0, 2],  # right of the picture
            [0, -2.1, 2],  # above the picture
            [0, 0, -2],  # behind the camera
            [0, 0, 0],  # at the center of the camera
        ]
    )

    assert measure_depths(camera, positions).tolist() == [2, 2]


def test_a_near_bound_excludes_one_point_in_a_hundred():
    depths = np.random.default_rng(0).permutation(np.linspace(1, 2, 1001))

    assert choose_near(depths) == pytest.approx(1.01)
    assert choose_near(np.array([3.0])) == 3.0


@pytest.mark.parametrize("size", [(1 << 15, 4), (4, 10**30), (1 << 14, 1 << 14)])
def test_a_size_too_large_for_undistortion_maps_is_rejected(size):
    with pytest.raises(
        ValueError, match="too large: the limits are 32,767 pixels per side and 134,217,728"
    ):
        Lens(*size, 40.0, 40.0, 20.0, 17.0)


@pytest.mark.parametrize("size", [((1 << 14) + 1, 4), (4, 10**400), (1 << 14, (1 << 13) + 1)])
def test_a_size_that_no_video_has_is_rejected(size):
    require_video_size(1 << 14, 1 << 13)
    with pytest.raises(
        ValueError, match=r"H\.264: the limits are 16,384 pixels per side and 134,217,728"
    ):
        require_video_size(*size)


@pytest.mark.parametrize(("axes", "center"), [(1e200, 0.0), (1.0, 1.7e308)])
def test_numbers_too_large_to_multiply_are_not_a_pose(axes, center):
    with pytest.raises(ValueError, match=r"orthonormal|too large"):
        make_pose(axes * scenes.look_at((1, -3, 2), (0, 0, 0)), (center, center, -center))


@pytest.mark.parametrize(
    ("focal_length", "near", "distance"),
    [(1e-60, 1.0, 1.0), (1e60, 1.0, 1.0), (40.0, 1e-60, 1.0), (40.0, 1.0, 1e60)],
)
def test_a_camera_that_no_stream_can_store_is_rejected(focal_length, near, distance):
    lens = Lens(48, 32, focal_length, 40.0, 20.0, 17.0)
    camera = CalibratedCamera("left", lens, make_pose(np.eye(3), (0, 0, -distance)), near)

    with pytest.raises(UnreadablePoseError, match="a number of camera left is too large or too"):
        make_camera(camera, np.zeros((1, 3)))
