import numpy as np
import pytest

from quarc_ref.synth.options import SynthOptions
from quarc_ref.synth.rig import place_cameras


def _measure_angles(cameras):
    """Return the angle of each camera around the stage, in degrees."""
    return np.array(
        [np.degrees(np.arctan2(camera.center[0], camera.center[2])) for camera in cameras]
    )


@pytest.mark.parametrize("seed", range(5))
def test_axes_are_orthonormal_and_right_handed(seed):
    for camera in place_cameras(SynthOptions(seed=seed)):
        np.testing.assert_allclose(camera.axes @ camera.axes.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(camera.axes) == pytest.approx(1)


@pytest.mark.parametrize("count", [2, 5, 12])
def test_the_held_out_camera_is_between_two_neighbors_on_the_arc(count):
    held_out, *training_angles = _measure_angles(place_cameras(SynthOptions(cameras=count)))

    assert np.count_nonzero(np.array(training_angles) < held_out) == (count - 1) // 2 + 1
    assert training_angles == sorted(training_angles)


def test_cameras_span_about_120_degrees_at_two_heights():
    cameras = place_cameras(SynthOptions())[1:]
    heights = np.array([camera.center[1] for camera in cameras])

    assert np.ptp(_measure_angles(cameras)) == pytest.approx(80, abs=4)
    assert np.ptp(heights[::2]) < 0.2
    assert (heights[1::2] - heights[::2] > 0.4).all()


def test_every_camera_has_the_stage_in_the_center_of_its_picture():
    for camera in place_cameras(SynthOptions()):
        x, y, depth = camera.axes @ (np.array([0.0, 0.7, 0.0]) - camera.center)

        assert depth > 2
        assert abs(x / depth) < 0.1
        assert abs(y / depth) < 0.1


def test_a_pose_is_down_right_backwards_and_center_then_height_width_focal():
    camera = place_cameras(SynthOptions(width=64, height=48))[3]
    pose = camera.as_poses_bounds_row(2.0, 5.0)
    down, right, backwards, center, size = pose[:15].reshape(3, 5).T

    np.testing.assert_array_equal(np.stack((right, down, -backwards)), camera.axes)
    np.testing.assert_array_equal(center, camera.center)
    np.testing.assert_array_equal(size, (48, 64, camera.focal_length))
    assert 1.8 < pose[15] < 2
    assert 5 < pose[16] < 5.5


def test_a_pixel_and_its_depth_give_the_world_point():
    camera = place_cameras(SynthOptions())[5]
    points = np.array([[0.3, 0.5, -0.4], [-1.0, 0.1, 0.6]])
    x, y, depth = camera.axes @ (points - camera.center).T
    pixels = np.stack(
        (camera.focal_length * x / depth + 80, camera.focal_length * y / depth + 60), axis=1
    )

    np.testing.assert_allclose(camera.to_world(pixels, depth), points, atol=1e-12)
