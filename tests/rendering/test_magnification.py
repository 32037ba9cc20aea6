"""Pictures of other sizes than those of the capture show the same scene (SPEC 10.3)."""

from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.decoder import Splats
from quarc_ref.rendering.magnification import (
    UNMAGNIFIED,
    Magnification,
    measure_magnification,
)
from quarc_ref.rendering.pictures import render_depth, render_picture
from quarc_ref.viewing.outline import resize_camera
from tests.small_streams import CAMERA

_WIDE, _TELE = (replace(CAMERA, fx=fx, fy=fx + 10) for fx in (100.0, 200.0))


@pytest.mark.parametrize(
    ("fx", "fy", "expected"),
    [
        (100.0, 110.0, (1, 1)),
        (150.0, 180.0, (1, 1)),
        (50.0, 420.0, (0.5, 2)),
        (400.0, 55.0, (2, 0.5)),
    ],
)
def test_a_magnification_is_relative_to_the_range_of_focal_lengths(fx, fy, expected):
    camera = replace(CAMERA, fx=fx, fy=fy)

    assert measure_magnification(camera, [_WIDE, _TELE]) == Magnification(*expected)


def test_without_cameras_pictures_are_not_magnified():
    assert measure_magnification(CAMERA, []) == UNMAGNIFIED


def test_the_filter_grows_with_a_picture_but_does_not_shrink():
    low_pass = Magnification(3.0, 0.5).max_low_pass

    assert low_pass == pytest.approx((0.3 * 9, 0.3))


def test_the_nearest_cameras_determine_the_center_of_the_capture():
    left, right = (replace(CAMERA, translation=(-x, 0, 2)) for x in (-1.0, 1.0))
    camera = replace(CAMERA, translation=(-0.5, 0, 0))  # 1.5 and 0.5 to the side, and 2 ahead

    center = measure_magnification(camera, [left, right]).center

    weight = (2.5**2 / 17 * 4) ** 4
    assert center == pytest.approx(((weight - 1) / (weight + 1), 0, -2))
    assert measure_magnification(left, [left, right]).center is None


@pytest.fixture(scope="module")
def thin_splats():
    """Gaussians that are thinner than a pixel and form a surface."""
    rng = np.random.default_rng(3)
    count = 3000
    positions = np.column_stack([rng.uniform(-1, 1, (count, 2)), rng.uniform(2.5, 2.6, count)])
    return Splats(
        positions.astype(np.float32),
        rng.normal(size=(count, 4)).astype(np.float32),
        rng.uniform(-7, -4, (count, 3)).astype(np.float32),
        rng.normal(1, 2, count).astype(np.float32),
        rng.normal(0, 1, (count, 1, 3)).astype(np.float32),
    )


def _shrink(picture, factor):
    height, width, _ = picture.shape
    return picture.reshape(height // factor, factor, width // factor, factor, 3).mean(axis=(1, 3))


@pytest.mark.parametrize("factor", [2, 4])
def test_a_larger_picture_shows_what_the_capture_shows(thin_splats, factor):
    large_camera = resize_camera(CAMERA, factor * CAMERA.width)
    magnification = measure_magnification(large_camera, [CAMERA])
    expected = render_picture(thin_splats, CAMERA)
    scaled = _shrink(render_picture(thin_splats, large_camera, magnification), factor)
    unscaled = _shrink(render_picture(thin_splats, large_camera), factor)

    assert np.abs(scaled - expected).mean() < 0.2 * np.abs(unscaled - expected).mean()


@pytest.mark.parametrize("factor", [2, 4])
def test_a_smaller_picture_shows_what_the_capture_shows(thin_splats, factor):
    small_camera = resize_camera(CAMERA, CAMERA.width // factor)
    magnification = measure_magnification(small_camera, [CAMERA])
    expected = _shrink(render_picture(thin_splats, CAMERA), factor)
    scaled = render_picture(thin_splats, small_camera, magnification)
    unscaled = render_picture(thin_splats, small_camera)

    assert np.abs(scaled - expected).mean() < 0.5 * np.abs(unscaled - expected).mean()


@pytest.mark.parametrize("distance", [2.54, 9.08])
def test_from_other_distances_gaussians_keep_their_filter_relative_to_the_scene(
    distance, thin_splats
):
    moved_camera = replace(CAMERA, translation=(0, 0, distance - 2.55))  # 4.54 from the Gaussians
    factor = 4.54 / distance
    zoomed_camera = replace(CAMERA, fx=CAMERA.fx * factor, fy=CAMERA.fy * factor)
    expected, scaled, unscaled = (
        render_picture(thin_splats, camera, magnification)
        for camera, magnification in (
            (zoomed_camera, measure_magnification(zoomed_camera, [CAMERA])),
            (moved_camera, measure_magnification(moved_camera, [CAMERA])),
            (moved_camera, UNMAGNIFIED),
        )
    )

    assert np.abs(scaled - expected).mean() < 0.5 * np.abs(unscaled - expected).mean()


def test_gaussians_that_become_too_faint_are_not_rendered(thin_splats):
    points = replace(thin_splats, log_scales=np.full_like(thin_splats.log_scales, -12))

    assert render_depth(points, CAMERA, Magnification(0.1, 0.1))[1].max() > 0
    assert render_depth(points, CAMERA, Magnification(1e-3, 1e-3))[1].max() == 0


def test_gaussians_that_become_too_large_are_not_rendered(thin_splats):
    assert render_picture(thin_splats, CAMERA, Magnification(1e200, 1e200)).max() == 0


def test_a_picture_of_the_capture_does_not_change(thin_splats):
    magnification = measure_magnification(CAMERA, [CAMERA])

    assert magnification == UNMAGNIFIED
    picture = render_picture(thin_splats, CAMERA, magnification)
    assert np.array_equal(picture, render_picture(thin_splats, CAMERA))
