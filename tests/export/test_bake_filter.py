from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.export.bake_filter import bake_filter
from quarc_ref.rendering.pictures import render_picture
from quarc_ref.viewing.outline import resize_camera
from tests.export.frames import make_frame
from tests.small_streams import CAMERA


@pytest.fixture(scope="module")
def splats():
    """Thin Gaussians, all of them in the picture of CAMERA."""
    splats = make_frame(1)[1]
    return replace(splats, log_scales=np.full_like(splats.log_scales, -6))


def test_variances_grow_by_the_filter_of_the_camera_with_the_largest_picture(splats):
    far_camera = replace(CAMERA, translation=(0, 0, 5))
    near_camera = replace(CAMERA, fx=62.5, fy=40.0)  # whose geometric mean is 50
    baked = bake_filter(splats, [far_camera, near_camera])

    depths = splats.positions[:, 2] + 2
    expected = np.exp(2 * -6.0) + 0.3 * (depths / 50) ** 2
    assert np.exp(2 * baked.log_scales) == pytest.approx(np.tile(expected, (3, 1)).T, rel=1e-5)


def test_gaussians_outside_all_pictures_get_the_median_filter(splats):
    positions = splats.positions.copy()
    positions[0] = (0, 0, -9)
    baked = bake_filter(replace(splats, positions=positions), [CAMERA])

    assert baked.log_scales[0] == pytest.approx(np.median(baked.log_scales[1:]), abs=1e-3)


def test_if_no_camera_sees_a_gaussian_nothing_changes(splats):
    assert bake_filter(splats, [replace(CAMERA, translation=(0, 0, -9))]) is splats


def test_a_viewer_with_a_high_resolution_shows_what_the_capture_shows(splats):
    camera = resize_camera(CAMERA, 4 * CAMERA.width)
    expected = render_picture(splats, CAMERA)
    baked, plain = (
        render_picture(shown, camera).reshape(48, 4, 64, 4, 3).mean(axis=(1, 3))
        for shown in (bake_filter(splats, [CAMERA]), splats)
    )

    assert np.abs(baked - expected).mean() < 0.3 * np.abs(plain - expected).mean()
