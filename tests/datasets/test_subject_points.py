"""Tests the initial points of a subject: a ball in the middle of a ring of cameras."""

import math
from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.datasets.camera_geometry import project_points
from quarc_ref.datasets.capture import Points
from quarc_ref.datasets.errors import UnreadablePointsError
from quarc_ref.datasets.subject_points import choose_subject_points
from quarc_ref.format.cameras import Camera

CENTER, RADIUS, DISTANCE = np.array([0.3, -0.2, 0.1]), 0.5, 4.0
WIDTH, HEIGHT, FOCAL = 96, 80, 90.0


def _make_camera(index, count=6):
    angle = 2 * math.pi * index / count
    c, s = math.cos(angle), math.sin(angle)
    rotation = (c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c)
    return Camera(
        f"cam{index:02}", WIDTH, HEIGHT, FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2, rotation,
        (0.0, 0.0, DISTANCE), 0.5, held_out=False,
    )  # fmt: skip


CAMERAS = [_make_camera(index) for index in range(6)]


def _draw_ball(camera):
    """Return the alpha of the ball: opaque where a ray passes its center within its radius."""
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    rays = np.stack([(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, np.ones_like(x)], -1)
    rays /= np.linalg.norm(rays, axis=2, keepdims=True)
    center = np.reshape(camera.rotation, (3, 3)) @ CENTER + camera.translation
    distances = np.linalg.norm(np.cross(rays, center), axis=2)
    return np.where(distances < RADIUS, 255, 0).astype(np.uint8)


ALPHAS = [_draw_ball(camera) for camera in CAMERAS]


def _paint(index):
    return np.full((HEIGHT, WIDTH, 3), 40 * index, np.uint8)


def _draw_positions(count, reach):
    return np.random.default_rng(1).uniform(-reach, reach, (count, 3)).astype(np.float32)


def test_points_that_a_camera_sees_as_transparent_are_removed():
    positions = _draw_positions(20_000, reach=1.0)  # all are inside all pictures
    colors = np.random.default_rng(2).integers(0, 256, positions.shape, np.uint8)

    chosen = choose_subject_points(Points(positions, colors), CAMERAS, ALPHAS, _paint)

    distances = np.linalg.norm(positions - CENTER, axis=1)
    is_chosen = (positions[:, None] == chosen.positions).all(axis=2).any(axis=1)
    pixel = DISTANCE / FOCAL
    assert is_chosen[distances < RADIUS].all()
    assert not is_chosen[distances > 1.25 * RADIUS + 5 * pixel].any()
    assert np.array_equal(chosen.colors, colors[is_chosen])


def test_wrong_alpha_in_one_of_twelve_pictures_removes_no_points():
    cameras = [_make_camera(index, count=12) for index in range(12)]
    alphas = [_draw_ball(camera) for camera in cameras]
    alphas[4] = np.zeros_like(alphas[4])
    positions = (CENTER + _draw_positions(1000, reach=0.25)).astype(np.float32)
    points = Points(positions, np.zeros((1000, 3), np.uint8))

    assert len(choose_subject_points(points, cameras, alphas, _paint).positions) == 1000
    alphas[5] = np.zeros_like(alphas[5])
    with pytest.raises(UnreadablePointsError, match="cam04, cam05 cannot see it at all"):
        choose_subject_points(points, cameras, alphas, _paint)


def test_points_outside_all_pictures_are_kept():
    inside = (CENTER + _draw_positions(1000, reach=0.2)).astype(np.float32)
    high = np.float32([[0, 50, 0]])
    points = Points(np.concatenate([inside, high]), np.zeros((1001, 3), np.uint8))
    assert len(choose_subject_points(points, CAMERAS, ALPHAS, _paint).positions) == 1001


@pytest.mark.parametrize("given_count", [None, 0, 999])
def test_too_few_points_are_replaced_by_the_visual_hull(given_count):
    points = None
    if given_count is not None:
        positions = (CENTER + _draw_positions(given_count, reach=0.1)).astype(np.float32)
        points = Points(positions, np.zeros((given_count, 3), np.uint8))

    hull = choose_subject_points(points, CAMERAS, ALPHAS, _paint)

    assert len(hull.positions) == 10_000
    distances = np.linalg.norm(hull.positions - CENTER, axis=1)
    assert (distances < RADIUS).mean() > 0.6
    assert np.abs(hull.positions.mean(axis=0) - CENTER).max() < 0.05
    spread = np.quantile(np.abs(hull.positions - CENTER), 0.95, axis=0)
    assert (spread > 0.7 * RADIUS).all()


def test_no_point_is_drawn_where_few_cameras_see_the_hull():
    # Four of six cameras do not see the lower half of the ball.
    cameras = [
        camera if index in (0, 3) else replace(camera, cy=camera.cy + 44)
        for index, camera in enumerate(CAMERAS)
    ]
    alphas = [_draw_ball(camera) for camera in cameras]
    hull = choose_subject_points(None, cameras, alphas, _paint)
    views = sum(project_points(camera, hull.positions).is_visible.astype(int) for camera in cameras)
    assert views.min() >= 3


def test_hull_points_have_the_color_of_the_nearest_camera():
    hull = choose_subject_points(None, CAMERAS, ALPHAS, _paint)
    depths = np.stack([project_points(camera, hull.positions).depths for camera in CAMERAS])
    assert np.array_equal(hull.colors[:, 0], 40 * depths.argmin(axis=0))


def test_alpha_without_a_subject_is_an_error():
    nothing = [np.zeros((HEIGHT, WIDTH), np.uint8)] * len(CAMERAS)
    with pytest.raises(UnreadablePointsError, match="visible to 0 of 6 training cameras"):
        choose_subject_points(None, CAMERAS, nothing, _paint)
    with pytest.raises(UnreadablePointsError, match="visible to 1 of 6 training cameras"):
        choose_subject_points(None, CAMERAS, [ALPHAS[0], *nothing[1:]], _paint)
    corner = np.zeros((HEIGHT, WIDTH), np.uint8)
    corner[:4, :4] = 255
    with pytest.raises(UnreadablePointsError, match="no place is covered"):
        choose_subject_points(None, CAMERAS, [*ALPHAS[:5], corner], _paint)


def test_hull_points_are_in_two_pictures_even_if_a_subject_fills_a_picture():
    opaque = np.full((HEIGHT, WIDTH), 255, np.uint8)
    for alphas in ([opaque, *ALPHAS[1:3]], [opaque] * 3):
        hull = choose_subject_points(None, CAMERAS[:3], alphas, _paint)
        views = [project_points(camera, hull.positions).is_visible for camera in CAMERAS[:3]]
        assert (np.sum(views, axis=0) >= 2).all()
