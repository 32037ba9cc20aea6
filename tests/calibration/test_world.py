import numpy as np
import pytest

from quarc_ref.calibration.errors import CalibrationError, UnknownCameraError
from quarc_ref.calibration.world import Distance, define_world
from tests.calibration.rigs import center, look_at, make_ring, measure_pose_errors, transform_camera

POINTS = np.zeros((5, 3))
_, _, ROTATION = np.linalg.svd(np.array([[1.0, 2, 3], [0, 1, 4], [5, 6, 0]]))
ROTATION = ROTATION * np.linalg.det(ROTATION)
SHIFT = np.array([4.0, -2, 7])


def transform_rig(cameras, rotation=ROTATION):
    return [transform_camera(camera, rotation, SHIFT, 0.3) for camera in cameras]


@pytest.mark.parametrize("signs", [(1, 1, 1), (1, -1, -1), (-1, -1, 1)])
@pytest.mark.parametrize(("up", "height"), [("level", 0.5), ("plane", 0.5), ("cam03", 0.0)])
def test_a_tilted_ring_becomes_upright(up, height, signs):
    rig = make_ring(height=height)

    world = define_world(transform_rig(rig, np.diag(signs) @ ROTATION), POINTS, up)

    heights = [-center(camera)[1] for camera in world.cameras]
    down_components = [camera.pose.rotation[1, 1] for camera in world.cameras]
    assert np.ptp(heights) < 1e-6
    assert min(down_components) > 0.9
    rotation_error, position_error = measure_pose_errors(world.cameras, rig)
    assert rotation_error < 0.01
    assert position_error < 1e-6


def test_the_origin_is_what_the_cameras_look_at_and_their_mean_distance_is_1():
    world = define_world(transform_rig(make_ring()), POINTS)

    distances = [np.linalg.norm(center(camera)) for camera in world.cameras]
    assert np.mean(distances) == pytest.approx(1)
    assert np.ptp(distances) < 1e-6
    assert world.meters_per_unit is None


def test_a_known_distance_makes_a_unit_a_meter():
    world = define_world(
        transform_rig(make_ring()), POINTS, distance=Distance("cam00", "cam03", 6.0)
    )

    assert np.linalg.norm(center(world.cameras[0]) - center(world.cameras[3])) == pytest.approx(6)
    assert world.meters_per_unit == 1.0


def test_parallel_cameras_give_their_mean_up_axis():
    cameras = [look_at(f"cam{i}", (i, 0.0, 0.0), (i, 0.0, 9.0)) for i in range(4)]

    points = 0.3 * np.array([[1.5, 0, 5.0]]) @ ROTATION.T + SHIFT
    world = define_world(transform_rig(cameras), points)

    assert "mean" in world.up_source
    assert min(camera.pose.rotation[1, 1] for camera in world.cameras) > 0.999
    for i, camera in enumerate(world.cameras):  # the origin is the median point
        directions = camera.pose.translation / camera.pose.translation[2]
        assert directions == pytest.approx([(1.5 - i) / 5, 0, 1], abs=1e-6)


def test_the_origin_of_cameras_that_look_apart_is_the_median_point():
    cameras = [look_at(f"cam{i}", (i - 1.5, 0.0, 0.0), (2 * i - 3, 0.0, 9.0)) for i in range(4)]

    world = define_world(transform_rig(cameras), 0.3 * np.array([[0, 0, 6]]) @ ROTATION.T + SHIFT)

    assert all(camera.pose.translation[2] > 0 for camera in world.cameras)


@pytest.mark.parametrize("pitch", [-90, -89.99, -30, 0, 30, 89.99, 90])
def test_the_first_camera_looks_along_z_with_x_on_its_right_side(pitch):
    angle = np.radians(pitch)
    forward = np.array([0, np.sin(angle), np.cos(angle)])
    down = (0.0, np.cos(angle), -np.sin(angle))
    first = look_at("first", -4 * forward, up=-np.array(down))

    world = define_world(transform_rig([first, *make_ring(height=0.0)]), POINTS, "cam01")

    expected = [[1, 0, 0], down, forward]
    assert world.cameras[0].pose.rotation == pytest.approx(np.array(expected), abs=1e-6)


@pytest.mark.parametrize("length", [1, 20])
def test_a_rig_that_fills_space_has_no_plane(length):
    cameras = [
        look_at(f"cam{index}", position * (1, 1, length))
        for index, position in enumerate(np.vstack([np.eye(3), -np.eye(3)]) + 0.1)
    ]

    with pytest.raises(CalibrationError, match="do not lie in one plane"):
        define_world(cameras, POINTS, "plane")


def test_an_unregistered_camera_is_named():
    with pytest.raises(UnknownCameraError, match="camera cam99 was not calibrated"):
        define_world(make_ring(), POINTS, "cam99")
