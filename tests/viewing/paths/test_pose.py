from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.format.records import StreamHeader
from quarc_ref.viewing.paths.automatic import plan_orbit, plan_spiral, plan_tour
from quarc_ref.viewing.paths.interpolation import interpolate_poses
from quarc_ref.viewing.paths.pose import (
    PathError,
    WorldAxes,
    find_center,
    find_up,
    get_camera_pose,
    look_at,
)
from tests.viewing.paths.rigs import make_ring, mirror_cameras

_UP = np.array([0.0, 0.0, 1.0])
_AXES = WorldAxes()
_CENTER = np.array([1.0, 2.0, 0.5])


def test_poses_and_cameras_convert_exactly():
    camera = replace(make_ring(_CENTER)[0], fx=30.0)  # pixels that are not square
    converted = get_camera_pose(camera).as_camera(camera)

    assert converted.rotation == pytest.approx(camera.rotation)
    assert converted.translation == pytest.approx(camera.translation)
    assert (converted.fx, converted.fy) == pytest.approx((camera.fx, camera.fy))


def test_the_point_looked_at_and_the_up_axis_follow_from_the_cameras():
    ring = make_ring(_CENTER)

    assert find_center(ring) == pytest.approx(_CENTER, abs=1e-6)
    assert find_up(ring, _AXES) == pytest.approx(_UP, abs=1e-6)


@pytest.mark.parametrize(
    ("up_axis", "text", "expected_up"),
    [
        (4, "1 0 0", [0, -1, 0]),  # the header has priority
        (0, "0 -3 4", [0, -0.6, 0.8]),
        (0, "1e-300 0 0", [1, 0, 0]),
        (0, "1e300 0 0", [1, 0, 0]),
        (0, "no direction", _UP),
        (0, "0 0 0", _UP),
    ],
)
def test_the_up_direction_is_that_of_the_stream(up_axis, text, expected_up):
    axes = WorldAxes.from_stream(StreamHeader(up_axis=up_axis), {"up": text})

    assert find_up(make_ring(_CENTER), axes) == pytest.approx(np.array(expected_up), abs=1e-6)


def test_a_single_camera_looks_at_a_point_in_front_of_it():
    (camera, *_) = make_ring(_CENTER)
    pose = get_camera_pose(camera)

    assert find_center([camera]) == pytest.approx(pose.eye + 4 * camera.near * pose.axes[2])


def test_cameras_whose_axes_meet_far_away_look_at_a_point_in_front_of_the_first():
    (reference_camera, *_) = make_ring(_CENTER)
    cameras = [
        look_at(np.array([x, 0.0, 0.0]), np.array([0.0, 1e4, 0.0]), _UP, 1.0).as_camera(
            reference_camera
        )
        for x in (1.0, 2.0, -2.0)
    ]

    assert find_center(cameras) == pytest.approx(np.array([1, 4 * cameras[0].near, 0]), abs=1e-3)


def test_an_orbit_goes_around_the_center_at_constant_height_and_distance():
    ring = make_ring(_CENTER)
    poses = plan_orbit(ring, ring[2], _AXES, 8)
    offsets = np.array([pose.eye for pose in poses]) - _CENTER

    assert poses[0].eye == pytest.approx(get_camera_pose(ring[2]).eye)
    assert np.linalg.norm(offsets, axis=1) == pytest.approx(np.linalg.norm(offsets[0]))
    assert offsets[:, 2] == pytest.approx(offsets[0, 2])
    assert offsets[4, :2] == pytest.approx(-offsets[0, :2])
    for pose in poses:
        assert pose.axes @ pose.axes.T == pytest.approx(np.eye(3), abs=1e-9)
        assert np.linalg.det(pose.axes) == pytest.approx(1)
        assert pose.axes[2] @ (_CENTER - pose.eye) > 0
        assert pose.axes[0] @ _UP == pytest.approx(0, abs=1e-9)


def test_a_spiral_stays_among_the_cameras_and_looks_at_the_center():
    cameras = make_ring(_CENTER)[:4]
    eyes = np.array([get_camera_pose(camera).eye for camera in cameras])
    poses = plan_spiral(cameras, cameras[0], _AXES, 12)
    distances = [np.linalg.norm(pose.eye - eyes.mean(axis=0)) for pose in poses]

    for pose in poses:
        direction = _CENTER - pose.eye
        assert direction / np.linalg.norm(direction) == pytest.approx(pose.axes[2], abs=1e-6)
    assert 0.2 < max(distances) / np.ptp(eyes, axis=0).max() < 1


def test_a_tour_starts_at_its_camera_and_passes_all_others():
    ring = make_ring(_CENTER)
    poses = plan_tour(ring, ring[3], _AXES, 600)
    positions = np.array([pose.eye for pose in poses])

    assert positions[0] == pytest.approx(get_camera_pose(ring[3]).eye)
    for camera in ring:
        distances = np.linalg.norm(positions - get_camera_pose(camera).eye, axis=1)
        assert distances.min() < 0.02
    assert len(plan_tour(ring[:1], ring[0], _AXES, 5)) == 5


def test_a_tour_goes_on_to_the_nearest_camera():
    arc = make_ring(_CENTER)[:4]
    poses = plan_tour([arc[3], arc[0], arc[2], arc[1]], arc[0], _AXES, 600)
    positions = np.array([pose.eye for pose in poses])
    visits = [
        np.linalg.norm(positions - get_camera_pose(camera).eye, axis=1).argmin() for camera in arc
    ]

    assert visits == sorted(visits)
    assert (visits[0], visits[-1]) == (0, 599)


@pytest.mark.parametrize("plan", [plan_orbit, plan_spiral, plan_tour])
def test_a_left_handed_stream_has_the_mirrored_path(plan):
    ring = make_ring(_CENTER)[:5]
    mirrored_ring, mirror = mirror_cameras(ring)
    poses = plan(ring, ring[1], _AXES, 9)
    mirrored_poses = plan(mirrored_ring, mirrored_ring[1], WorldAxes(right_handed=False), 9)

    for pose, mirrored_pose in zip(poses, mirrored_poses, strict=True):
        assert mirrored_pose.eye == pytest.approx(mirror @ pose.eye)
        assert mirrored_pose.axes == pytest.approx(pose.axes @ mirror, abs=1e-6)
        assert mirrored_pose.view_angle == pytest.approx(pose.view_angle)


def test_a_singular_rotation_cannot_be_interpolated():
    poses = [get_camera_pose(camera) for camera in make_ring(_CENTER)[:2]]
    poses[1].axes[:] = 0
    times = np.array([0.0, 1.0])
    with pytest.raises(PathError, match="singular"):
        interpolate_poses(times, poses, times)


def test_interpolation_passes_through_its_poses():
    ring = make_ring(_CENTER)[:3]
    poses = [get_camera_pose(camera) for camera in ring]
    times = np.array([0.0, 1.0, 4.0])
    for pose, expected in zip(interpolate_poses(times, poses, times), poses, strict=True):
        assert pose.eye == pytest.approx(expected.eye)
        assert pose.axes == pytest.approx(expected.axes, abs=1e-9)
        assert pose.view_angle == pytest.approx(expected.view_angle)


@pytest.mark.parametrize(
    ("target", "message"), [((0, 0, 0), "are the same point"), ((0, 0, 3), "straight")]
)
def test_a_camera_cannot_look_at_its_own_position(target, message):
    with pytest.raises(PathError, match=message):
        look_at(np.zeros(3), np.array(target, dtype=float), _UP, 1.0)
