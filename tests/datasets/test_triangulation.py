from dataclasses import replace

import numpy as np
import pycolmap
import pytest

from quarc_ref.datasets.calibration import make_pose
from quarc_ref.datasets.errors import UnreadablePointsError
from quarc_ref.datasets.triangulation import triangulate
from tests.datasets import scenes


@pytest.fixture(scope="module")
def triangulated_points(cameras_and_pictures):
    return triangulate(*cameras_and_pictures)


def test_points_lie_on_the_plane_in_the_pictures(triangulated_points):
    plane_distances = np.abs(triangulated_points.positions[:, 1])

    # A pixel is 0.027 units wide at the plane, 4 units away.
    assert len(plane_distances) >= 200
    assert np.median(plane_distances) < 0.01
    assert np.mean(plane_distances < 0.1) > 0.9


def test_points_have_the_colors_of_the_plane(triangulated_points):
    on_plane = np.abs(triangulated_points.positions[:, 1]) < 0.02
    x, _, z = triangulated_points.positions[on_plane].T
    difference = triangulated_points.colors[on_plane] - scenes.paint_grains(x, z, 0.0)
    mismatch = triangulated_points.colors[on_plane][::-1] - scenes.paint_grains(x, z, 0.0)

    assert np.abs(difference).mean() < 0.7 * np.abs(mismatch).mean()


def test_the_same_pictures_give_the_same_points(cameras_and_pictures, triangulated_points):
    repeated_points = triangulate(*cameras_and_pictures)

    assert np.array_equal(repeated_points.positions, triangulated_points.positions)
    assert np.array_equal(repeated_points.colors, triangulated_points.colors)


def test_wrong_poses_give_too_few_points(cameras_and_pictures):
    cameras, pictures = cameras_and_pictures
    rolled_cameras = []
    for index, camera in enumerate(cameras):
        roll = np.array(
            [[np.cos(index), -np.sin(index), 0], [np.sin(index), np.cos(index), 0], [0, 0, 1]]
        )
        axes = camera.pose.rotation.T
        rolled_cameras.append(
            replace(camera, pose=make_pose(axes @ roll, -axes @ camera.pose.translation))
        )

    with pytest.raises(
        UnreadablePointsError, match=r"only \d+ initial points .* provide points3D_init.ply"
    ):
        triangulate(rolled_cameras, pictures)


def test_pictures_without_content_give_no_points_and_leave_the_log_alone(
    cameras_and_pictures, capfd
):
    cameras, pictures = cameras_and_pictures
    level_before = pycolmap.logging.minloglevel

    with pytest.raises(UnreadablePointsError, match="only 0 initial points"):
        triangulate(cameras, [np.full_like(picture, 128) for picture in pictures])
    assert pycolmap.logging.minloglevel == level_before
    assert capfd.readouterr() == ("", "")


def test_a_single_camera_is_rejected(cameras_and_pictures):
    cameras, pictures = cameras_and_pictures

    with pytest.raises(UnreadablePointsError, match=r"one training camera: .* points3D_init.ply"):
        triangulate(cameras[:1], pictures[:1])
