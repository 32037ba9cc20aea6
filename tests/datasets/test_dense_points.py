import numpy as np
import pytest

from quarc_ref.datasets.capture import Points
from quarc_ref.datasets.dense_points import add_dense_points
from quarc_ref.datasets.plane_sweep import average_best_two
from tests.datasets import scenes

PLANE_POINTS = scenes.make_plane_points(50)


@pytest.fixture(scope="module")
def dense_points(cameras_and_pictures):
    points = add_dense_points(*cameras_and_pictures, PLANE_POINTS)
    count = len(points.positions) - len(PLANE_POINTS.positions)
    return Points(points.positions[:count], points.colors[:count])


def test_most_pixels_become_points_on_the_plane_in_the_pictures(dense_points):
    plane_distances = np.abs(dense_points.positions[:, 1])

    # A pixel is 0.027 units wide at the plane, 4 units away. Depths of single cameras have errors
    # that are twice as large.
    assert len(plane_distances) > 0.5 * 5 * 160 * 120 or len(plane_distances) == 40_000
    assert np.median(plane_distances) < 0.004
    assert np.mean(plane_distances < 0.1) > 0.99


def test_dense_points_have_the_colors_of_the_plane(dense_points):
    x, _, z = dense_points.positions.T
    true_colors = scenes.paint_grains(x, z, 0.0).astype(float)
    difference = np.abs(dense_points.colors - true_colors).mean()

    assert difference < 0.5 * np.abs(dense_points.colors[::-1] - true_colors).mean()


def test_a_sparse_point_that_cameras_see_through_is_dropped(cameras_and_pictures):
    floating_point = Points(np.float32([[0.0, -1.0, 0.0]]), np.uint8([[255, 0, 255]]))
    sparse_points = Points(
        np.concatenate([PLANE_POINTS.positions, floating_point.positions]),
        np.concatenate([PLANE_POINTS.colors, floating_point.colors]),
    )

    points = add_dense_points(*cameras_and_pictures, sparse_points)

    assert not (points.positions == floating_point.positions).all(axis=1).any()
    assert (points.positions == PLANE_POINTS.positions[7]).all(axis=1).any()


def test_two_cameras_cannot_confirm_a_point(cameras_and_pictures):
    cameras, pictures = cameras_and_pictures

    points = add_dense_points(cameras[:2], pictures[:2], PLANE_POINTS)

    np.testing.assert_array_equal(points.positions, PLANE_POINTS.positions)


def test_pictures_without_texture_add_no_points(cameras_and_pictures):
    cameras, pictures = cameras_and_pictures

    points = add_dense_points(
        cameras, [np.full_like(picture, 128) for picture in pictures], PLANE_POINTS
    )

    np.testing.assert_array_equal(points.positions, PLANE_POINTS.positions)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_the_best_two_correlations_are_averaged(count):
    correlations = np.random.default_rng(0).normal(size=(count, 6, 8)).astype(np.float32)
    expected = np.sort(correlations, axis=0)[-2:].mean(axis=0)

    assert np.array_equal(average_best_two(correlations), expected)
